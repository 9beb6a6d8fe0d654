"""Invalid and unusual element tables and LandXML files."""

import json
from dataclasses import replace

import pytest
from faults import faults
from memory_layers import layer_of
from qgis.core import QgsFeature
from rail_extract.core.fields import ELEMENT_FIELDS
from rail_extract.rail_extract_plugin.writing.layers import fields

METRIC = '<Units><Metric linearUnit="meter"/></Units>'
SYSTEM = '<CoordinateSystem epsgCode="25832"/>'
LINE = "<Line><Start>5804300 578200</Start><End>5804300 578300</End></Line>"
CURVE = (
    '<Curve rot="cw" radius="300"><Start>5804300 578300</Start><Center>5804000 578300</Center>'
    "<End>5804259.807621 578450</End></Curve>"
)
SPIRAL = (
    '<Spiral rot="cw" spiType="clothoid" length="60" radiusStart="INF" radiusEnd="300">'
    "<Start>5804300 578300</Start><PI>5804300 578340.046</PI><End>5804298.003 578359.940</End></Spiral>"
)


TINY = (
    '<Curve rot="cw" radius="0.001" length="1000"><Start>5804300 578300</Start><Center>5804299.999 578300</Center>'
    "<End>5804300 578300</End></Curve>"
)
COINCIDENT = (
    '<Curve rot="cw"><Start>5804300 578300</Start><Center>5804300 578300</Center><End>5804300 578300</End></Curve>'
)
CANT = '<Cant><CantStation station="0" appliedCant="INF" curvature="cw"/></Cant>'


def landxml(parts=LINE + CURVE, head=METRIC + SYSTEM, start="0", more=""):
    return (
        f'<LandXML version="1.2">{head}<Alignments><Alignment name="A" staStart="{start}">'
        f"<CoordGeom>{parts}</CoordGeom>{more}</Alignment></Alignments></LandXML>"
    )


def profile(*meetings):
    points = "".join(f"<PVI>{station} {z}</PVI>" for station, z in meetings)
    return of_file(landxml(more=f"<Profile><ProfAlign>{points}</ProfAlign></Profile>"))


def swapped(text):
    """Exchange northing and easting."""
    for name in ("Start", "Center", "End"):
        head, *rest = text.split(f"<{name}>")
        text = head + "".join(
            f"<{name}>{' '.join(reversed(one.split('<')[0].split()))}<{one.split('<', 1)[1]}" for one in rest
        )
    return text


def of_file(text=None, **parameters):
    def prepare(bench):
        (bench.folder / "design.xml").write_text(text or landxml(), encoding="utf-8")
        return {"INPUT": bench.folder / "design.xml", **parameters}

    return prepare


def line_at(bench, x):
    line = f"LineString({x} 5804300, {x + 90} 5804300)"
    bench.layer = layer_of(line, kind="LineString", crs="EPSG:25832")  # which QGIS deletes with its Python object
    return bench.layer


def of_table(change=lambda rows: rows, columns=ELEMENT_FIELDS, **parameters):
    """An element table of a straight and an arc."""

    def prepare(bench):
        layer = layer_of(kind="LineString", crs="EPSG:25832")
        layer.dataProvider().addAttributes(fields(columns).toList())
        layer.updateFields()
        line = {"track_id": 1, "no": 1, "layout": "H", "type": "line", "s_from": 0.0, "s_to": 100.0, "x": 578200.0}
        line.update(y=5804300.0, heading=0.0)
        arc = {**line, "no": 2, "type": "arc", "s_from": 100.0, "s_to": 150.0, "x": 578300.0, "r1_m": 300.0}
        for row in change([line, arc]) if len(columns) > 2 else ():
            feature = QgsFeature(layer.fields())
            for name, value in row.items():
                feature[name] = value
            layer.dataProvider().addFeature(feature)
        bench.layer = layer
        return {"INPUT": layer, **parameters}

    return prepare


def as_texts(name):
    """The fields of the table, of which the one with this name, or all, are texts."""
    return [replace(one, kind=str) if name in (one.name, "") else one for one in ELEMENT_FIELDS]


def all_texts(rows):
    return [{name: str(value) for name, value in row.items()} for row in rows]


def mixed_geojson(bench):
    """A table whose field of tracks has a number in one row and a text in the other."""
    rows = [{"track_id": track, "layout": "H", "s_from": 0.0, "s_to": 9.0} for track in (1, "two")]
    features = [{"type": "Feature", "properties": row, "geometry": None} for row in rows]
    path = bench.folder / "table.geojson"
    path.write_text(json.dumps({"type": "FeatureCollection", "features": features}), encoding="utf-8")
    return {"INPUT": path}


def changed(number, **values):
    return lambda rows: [{**row, **(values if at == number else {})} for at, row in enumerate(rows)]


FAULTS = {
    "importalignment": {
        "a LandXML file": of_file(),
        "a LandXML in feet": of_file(landxml(head='<Units><Imperial linearUnit="foot"/></Units>')),
        "a LandXML with the easting first": of_file(swapped(landxml())),
        "the same without a curve": of_file(swapped(landxml(LINE))),
        "EAST_FIRST for a file with the northing first": of_file(EAST_FIRST=True),
        "an IFC file given as LandXML": of_file("ISO-10303-21;\nHEADER;\n"),
        "a transition curve that is not a clothoid": of_file(landxml(LINE + SPIRAL.replace("clothoid", "bloss"))),
        "a LandXML that is cut off": of_file(landxml()[:-30]),
        "a LandXML with entities that would expand to gigabytes": of_file(
            '<!DOCTYPE x [<!ENTITY a "aaaaaaaaaa"><!ENTITY b "&a;&a;&a;&a;&a;&a;&a;&a;">]>'
            + landxml().replace("A", "&b;")
        ),
        "other XML": of_file("<gml/>"),
        "a file without alignments": of_file(f"<LandXML>{METRIC}{SYSTEM}<Surfaces/></LandXML>"),
        "an arc that turns to the wrong side": of_file(landxml(LINE + SPIRAL + CURVE.replace("cw", "ccw"))),
        "an element that is missing": of_file(
            landxml(LINE + CURVE.replace("5782", "5783").replace("578300<", "578301<").replace("578450", "578451"))
        ),
        "a length that does not fit the ends": of_file(landxml(LINE + SPIRAL.replace('"60"', '"62"'))),
        "a file without a coordinate system": of_file(landxml(head=METRIC)),
        "a coordinate system that does not fit": of_file(landxml(head=METRIC), CRS="EPSG:31467"),
        "a coordinate system in feet": of_file(landxml(head=METRIC + '<CoordinateSystem epsgCode="2222"/>')),
        "deviations without tracks": of_file(DEVIATIONS="memory:"),
        "tracks elsewhere": lambda bench: {**of_file()(bench), "TRACKS": line_at(bench, 579_000.0)},
        "a curve whose points coincide": of_file(landxml(LINE + COINCIDENT)),
        "a curve of 1 mm radius that is 1000 m long": of_file(landxml(LINE + TINY)),
        "a spiral of infinite length": of_file(landxml(LINE + SPIRAL.replace('"60"', '"INF"'))),
        "a curve of negative length": of_file(landxml(LINE + CURVE.replace('"300"', '"300" length="-139"'))),
        "a curve of negative length, and line breaks in the name of its alignment": of_file(
            landxml(LINE + CURVE.replace('"300"', '"300" length="-139"')).replace('"A"', '"A&#10;0&#10;EOF"')
        ),
        "an infinite cant": of_file(landxml(more=CANT)),
        "an infinite station": of_file(landxml(start="INF")),
        "a profile off the plan": profile((700, 10), (900, 12)),
        "a profile that ends before the plan": profile((0, 10), (200, 12)),
        "a profile that is 1,000,000 km long": profile((0, 10), (1e9, 12)),
        "a file that does not exist": lambda bench: {"INPUT": bench.folder / "gone.xml"},
    },
    "exportalignment": {
        "a layer that is not an element table": of_table(columns=ELEMENT_FIELDS[:2]),
        "a table whose elements were edited apart": of_table(changed(1, x=578300.5)),
        "a table without elements in plan": of_table(lambda rows: [{**row, "layout": "C"} for row in rows]),
        "an arc without a radius": of_table(changed(1, r1_m=None, r2_m=None)),
        "a radius that is a text": of_table(changed(1, r1_m="R 300"), as_texts("r1_m")),
        "a radius of 1e308": of_table(changed(1, r1_m=1e308)),
        "a track number with line breaks": of_table(changed(0, track_id="7\n  0\nENDSEC"), as_texts("track_id")),
        "a table whose values are all texts": of_table(all_texts, as_texts("")),
        "a GeoJSON table with a number and a text in one field": mixed_geojson,
        "an ending that is not a format": of_table(OUTPUT="design.dwg"),
    },
}


@pytest.mark.parametrize("fault", faults("Alignments", FAULTS), ids=str)
def test_fault(meet, fault):
    meet(fault)
