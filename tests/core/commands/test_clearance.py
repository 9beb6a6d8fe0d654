"""Measure Clearance as a command: own profiles, kilometres, other coordinate systems, and wrong inputs."""

import os
import shutil

import numpy as np
import pytest
from rail_extract.__main__ import main
from rail_extract.core.clouds.crs import parse_crs
from rail_extract.core.disk import Destination
from rail_extract.core.fields import CENTERLINES, RAILS
from rail_extract.core.files.layers import lines_layer
from rail_extract.core.files.writing import write_layers
from rail_extract.core.frame import LocalFrame
from rail_extract.laboratory.curves import Element
from rail_extract.laboratory.scenes import clearance as scenes
from rail_extract.laboratory.scenes.las import write_las

pyogrio, shapely = pytest.importorskip("pyogrio"), pytest.importorskip("shapely")
pyproj = pytest.importorskip("pyproj")

ORIGIN = np.array([578_000.0, 5_804_000.0, 0.0])
BOX = [(-1.7, 0.3), (1.7, 0.3), (1.7, 4.0), (-1.7, 4.0), (-1.7, 0.3)]


def written(path, layer, geometry, kind, crs=None):
    wkb = np.array([shapely.to_wkb(geometry, output_dimension=3 if kind.endswith("Z") else 2)], object)
    pyogrio.raw.write(
        str(path), layer=layer, driver="GPKG", geometry_type=kind, crs=crs, geometry=wkb, field_data=[], fields=[]
    )
    return path


@pytest.fixture(scope="module")
def place(tmp_path_factory):
    """A straight of 60 m in EPSG:25832 with a plate 1.645 m - 50 mm to the left at 20 m, and its lines."""
    folder = tmp_path_factory.mktemp("clearance")
    scene = scenes.double_track(1, 500.0, (Element(60.0),), 0.0, 0.0, apart_m=0.0)
    scenes.bed(scene, 3.0)
    scenes.plate(scene, 20.0, 1, 1.645 - 0.050, (1.5, 2.5))
    write_las(folder / "cloud.laz", scene.points + ORIGIN, "EPSG:25832", classification=scene.codes)
    tracks, rails = scenes.lines_of(scene)
    for name, crs in (("own", "EPSG:25832"), ("other", "EPSG:25833")):
        change = pyproj.Transformer.from_crs(parse_crs("EPSG:25832"), parse_crs(crs), always_xy=True).transform
        frame = LocalFrame(np.zeros(3), crs_wkt=parse_crs(crs).to_wkt())

        def moved(line, change=change):
            x, y, z = (line.xyz + ORIGIN).T
            return np.column_stack([*change(x, y), z])

        layers = [
            lines_layer(product, [type(one)(**{**vars(one), "xyz": moved(one)}) for one in lines])
            for product, lines in ((RAILS, rails), (CENTERLINES, tracks))
        ]
        write_layers(layers, Destination.at(folder / f"{name}.gpkg"), frame)
    axis = shapely.LineString((tracks[0].xyz + ORIGIN)[:, :2])
    written(folder / "axis.gpkg", "axis", axis, "LineString", "EPSG:25832")
    written(folder / "box.gpkg", "box", shapely.Polygon(BOX), "Polygon")
    return folder


def clearance(place, out, *more, lines="own", cloud=None):
    """Run the command; returns its exit status and the rows of the intrusions."""
    given = [f"{place / lines}.gpkg|layername=centerlines", str(cloud or place / "cloud.laz")]
    given += ["--rails", f"{place / lines}.gpkg|layername=rails", "--intrusions", str(out)]
    status = main(["clearance", *given, *map(str, more)])
    if status:
        return status, []
    meta, _, _, columns = pyogrio.raw.read(str(out))
    return status, [dict(zip(meta["fields"].tolist(), row)) for row in zip(*columns)]


def test_kilometres_are_those_of_the_axis(place, tmp_path):
    status, (row,) = clearance(place, tmp_path / "out.gpkg", "--axis", place / "axis.gpkg", "--start-km", "12.3")
    assert status == 0
    assert row["km"] == pytest.approx(12.3 + row["chainage_m"] / 1000, abs=1e-5)
    assert row["km_text"].startswith("12.3+2")
    assert row["pen_mm"] == pytest.approx(50, abs=4)


def quality(path, fields=("track_id", "chainage_m", "strip_mm")):
    """Write stations whose strips are apart by 2 mm, and by 60 mm at the plate, 20 m from the start."""
    chainage_m = np.arange(0.0, 61.0, 10.0)
    values = {"track_id": np.ones(7, int), "chainage_m": chainage_m, "strip_mm": np.where(chainage_m == 20, 60.0, 2.0)}
    points = np.array([shapely.to_wkb(shapely.Point(*ORIGIN[:2]))] * 7, object)
    columns = [values[name] for name in fields]
    pyogrio.raw.write(
        str(path),
        driver="GPKG",
        geometry_type="Point",
        crs="EPSG:25832",
        geometry=points,
        field_data=columns,
        fields=fields,
    )
    return path


def test_the_steps_between_strips_are_stated(place, tmp_path, capsys):
    given = ("--quality", quality(tmp_path / "quality.gpkg"), "--report", tmp_path / "page.html")
    clearance(place, tmp_path / "out.gpkg", *given)
    said = "The strips of the survey are up to 60.0 mm apart on track 1, at 20 m; the standard errors do not hold this."
    less = "1 place inside the profile: less deep than the strips are apart there."
    assert f"{said} {less}" in capsys.readouterr().err
    page = (tmp_path / "page.html").read_text(encoding="utf-8")
    assert said in page and "up to 60.0 mm" in page
    clearance(place, tmp_path / "out.gpkg", "--quality", quality(tmp_path / "none.gpkg", ("track_id", "chainage_m")))
    assert "--quality has no field strip_mm: take the points of Extract Rails" in capsys.readouterr().err


def test_a_drawn_polygon_is_a_profile(place, tmp_path):
    _, (row,) = clearance(place, tmp_path / "out.gpkg", "--profile", "CUSTOM", "--profile-file", place / "box.gpkg")
    assert row["pen_mm"] == pytest.approx(105, abs=4)
    assert row["side"] == "left"


def test_lines_in_another_coordinate_system_give_the_same(place, tmp_path):
    (row,), (same,) = (clearance(place, tmp_path / f"{one}.gpkg", lines=one)[1] for one in ("own", "other"))
    assert same["pen_mm"] == pytest.approx(row["pen_mm"], abs=0.5)
    assert same["chainage_m"] == pytest.approx(row["chainage_m"], abs=0.05)


@pytest.mark.parametrize(
    ("more", "words"),
    [
        (("--profile", "CUSTOM"), "--profile is CUSTOM: name a file with the columns v_m and w_m in --profile-file."),
        (("--profile", "US_WA", "--widening", "EBO"), "--profile US_WA has no rule for curves"),
        (("--margin", "3000"), "--margin can't be 3000: give a number from 0 to 2,000."),
        (("--classes-out", "trees"), '--classes-out "trees" must be whole numbers'),
    ],
)
def test_a_wrong_input_gets_one_sentence(place, tmp_path, capsys, more, words):
    try:
        status, _ = clearance(place, tmp_path / "out.gpkg", *more)
    except SystemExit as ended:
        status = ended.code
    said = capsys.readouterr().err
    assert status
    assert words in said
    assert "Traceback" not in said
    assert not (tmp_path / "out.gpkg").exists()


def columns_of(path):
    """Return the layers of a file as lists of values, by layer and field."""
    found = {}
    for name, _ in pyogrio.list_layers(str(path)).tolist():
        meta, _, places, columns = pyogrio.raw.read(str(path), layer=name)
        found[name] = dict(zip(meta["fields"].tolist(), [one.tolist() for one in columns]), places=places.tolist())
    return found


def test_another_profile_takes_the_points_that_a_run_has_kept(place, tmp_path, capsys):
    cloud, layers = tmp_path / "cloud.laz", ("--output", "--platforms", "--wires")
    shutil.copy(place / "cloud.laz", cloud)
    times = cloud.stat()

    def rows(out, *more, profile="EBO_MAIN"):
        named = [word for layer in layers for word in (layer, out)]
        status, _ = clearance(place, out, *named, "--profile", profile, *more, cloud=cloud)
        assert status == 0
        return columns_of(out)

    fresh = rows(tmp_path / "fresh.gpkg", "--margin", "100")
    rows(tmp_path / "first.gpkg", "--work", tmp_path / "work", profile="EBO_G1")
    assert "not read again" not in capsys.readouterr().err
    with cloud.open("r+b") as file:  # the header stays, the points can't be read any more
        file.seek(times.st_size // 2)
        file.write(bytes(times.st_size // 4))
    os.utime(cloud, ns=(times.st_atime_ns, times.st_mtime_ns))
    assert clearance(place, tmp_path / "none.gpkg", cloud=cloud)[0] == 1
    kept = rows(tmp_path / "kept.gpkg", "--margin", "100", "--work", tmp_path / "work")
    assert "1 file of 1 is not read again: an earlier run has kept its points." in capsys.readouterr().err
    assert str(kept) == str(fresh) and len(fresh["clearance"]["places"]) == 61


def test_kept_points_that_do_not_reach_far_enough_are_read_again(place, tmp_path, capsys):
    work = ("--work", tmp_path / "work")
    clearance(place, tmp_path / "out.gpkg", *work)
    assert clearance(place, tmp_path / "out.gpkg", *work, "--margin", "1900", "--profile", "EBO_MAIN")[0] == 0
    assert "not read again" not in capsys.readouterr().err
