"""Track Centerlines from Airborne Lidar: layers, figures and attributes from a simulated cloud."""

import pytest
from memory_layers import layer_of
from qgis.core import (
    QgsCoordinateReferenceSystem,
    QgsCoordinateTransform,
    QgsGeometry,
    QgsPointXY,
    QgsProject,
    QgsVectorLayer,
)
from rail_extract.laboratory.airborne.designs import curved_line, drawn_together
from rail_extract.laboratory.airborne.flight import Flight, fly
from rail_extract.laboratory.airborne.write import CRS, ORIGIN, write_airborne


@pytest.fixture(scope="module")
def flown(tmp_path_factory):
    design = curved_line(5, 200.0, cant_m=0.1, radius_m=450.0)
    design.world.bands.clear()
    cloud = fly(design.world, design.where, 8.0, Flight(10.0, 0.25, plants=0.03), seed=5)
    path = tmp_path_factory.mktemp("cloud") / "air ü.laz"
    write_airborne(cloud, path)
    return design, path


def guides(tracks, crs=CRS, off_m=0.4, fields="", values=()):
    """Lines drawn along tracks."""
    change = QgsCoordinateTransform(*map(QgsCoordinateReferenceSystem, (CRS, crs)), QgsProject.instance())
    lines = drawn_together(tracks, 5, off_m=off_m)
    shapes = [QgsGeometry.fromPolylineXY([QgsPointXY(*place) for place in line + ORIGIN[:2]]) for line in lines]
    for shape in shapes:
        shape.transform(change)
    return layer_of(*shapes, kind="LineString", crs=crs, fields=fields, values=values)


def test_lines_stations_and_report_from_guides_in_degrees(flown, run_step, tmp_path, new_feedback):
    design, path = flown
    fields, values = (
        "&field=name:string&field=ref:string&field=gauge:string",
        [("down", "1", "1435"), ("up", "1", "1435;1000")],
    )
    guide = guides(design.tracks, "EPSG:4326", fields=fields, values=values)
    outputs = {name: tmp_path / f"{name}.gpkg" for name in ("CENTERLINES", "STATIONS", "FINDINGS")}
    values = {"INPUT": path, "GUIDE": guide, "FOOTPRINT": 0.25, "REPORT": tmp_path / "report.html", **outputs}
    feedback = new_feedback()
    done = run_step("airbornecenterlines", values, feedback)
    assert done.ok, done.error
    assert not feedback.warnings
    assert done.results["CENTERLINE_COUNT"] == 2
    assert done.results["SEEN_LENGTH"] >= 0.95 * done.results["GUIDE_LENGTH"]
    assert done.results["DENSITY"] == pytest.approx(10, rel=0.2)
    lines = list(QgsVectorLayer(str(outputs["CENTERLINES"]), "lines").getFeatures())
    assert [(line["name"], line["ref"], line["gauge_mm"]) for line in lines] == [("down", "1", 1435), ("up", "1", 1435)]
    stations = list(QgsVectorLayer(str(outputs["STATIONS"]), "stations").getFeatures())
    assert len(stations) == done.results["GUIDE_LENGTH"] / 10
    assert {station["seen"] for station in stations if station["reason"] == ""} == {1}
    page = (tmp_path / "report.html").read_text(encoding="utf-8")
    for words in ("Good", 'aria-label="Map of the tracks"', "<dt>Date</dt>", f"<dd>{CRS} - "):
        assert words in page
