"""Invalid and unusual element tables and LandXML files."""

from dataclasses import replace

import pytest
from faults import FINE, WARNED, Fault, refused
from memory_layers import layer_of
from qgis.core import QgsFeature, QgsVectorLayer
from rail_extract.core.fields import ELEMENT_FIELDS
from rail_extract.rail_extract_plugin.writing.layers import fields

TITLE = "Alignments"

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


def landxml(parts=LINE + CURVE, head=METRIC + SYSTEM):
    return (
        f'<LandXML version="1.2">{head}<Alignments><Alignment name="A" staStart="0"><CoordGeom>{parts}</CoordGeom>'
        "</Alignment></Alignments></LandXML>"
    )


def swapped(text):
    """Exchange northing and easting."""
    for name in ("Start", "Center", "End"):
        head, *rest = text.split(f"<{name}>")
        text = head + "".join(
            f"<{name}>{' '.join(reversed(one.split('<')[0].split()))}<{one.split('<', 1)[1]}" for one in rest
        )
    return text


def of_file(text=None, name="design.xml", **parameters):
    def prepare(bench):
        path = bench.folder / name
        path.write_text(landxml() if text is None else text, encoding="utf-8")
        return {"INPUT": path, **parameters}

    return prepare


def line_at(bench, x):
    line = f"LineString({x} 5804300, {x + 90} 5804300)"
    bench.layer = layer_of(line, kind="LineString", crs="EPSG:25832")  # which QGIS deletes with its Python object
    return bench.layer


IMPORTED = [
    Fault("a LandXML file", of_file(), FINE, gives={"ALIGNMENT_COUNT": 1, "ELEMENT_COUNT": 2}),
    refused(
        "a LandXML in feet",
        of_file(landxml(head='<Units><Imperial linearUnit="foot"/></Units>')),
        "design.xml is in another unit than metres (foot): export it again with metres as the unit of length.",
    ),
    refused(
        "a LandXML with the easting first",
        of_file(swapped(landxml())),
        "All curves of design.xml turn to the other side than they state, because its points are written easting "
        "first: set EAST_FIRST.",
    ),
    refused(
        "the same without a curve",
        of_file(swapped(landxml(LINE))),
        "design.xml is in the area of ETRS89 / UTM zone 32N if its points are written easting first: set EAST_FIRST.",
    ),
    Fault(
        "the same with EAST_FIRST",
        of_file(swapped(landxml()), EAST_FIRST=True),
        FINE,
        gives={"ALIGNMENT_COUNT": 1, "ELEMENT_COUNT": 2},
    ),
    refused(
        "EAST_FIRST for a file with the northing first",
        of_file(EAST_FIRST=True),
        "All curves of design.xml turn to the other side than they state, because its points are written northing "
        "first: leave EAST_FIRST off.",
    ),
    refused(
        "an IFC file given as LandXML",
        of_file("ISO-10303-21;\nHEADER;\n"),
        "design.xml is an IFC file, not LandXML: export the alignments as LandXML.",
    ),
    refused(
        "a transition curve that is not a clothoid",
        of_file(landxml(LINE + SPIRAL.replace("clothoid", "bloss"))),
        "The Spiral 2 of alignment A of design.xml is a transition of type bloss, and only clothoids can be read: "
        "export the alignment with clothoids.",
    ),
    refused(
        "a LandXML that is cut off",
        of_file(landxml()[:-30]),
        "design.xml is cut off, damaged or not XML (…): write it again in the program that made it.",
    ),
    refused(
        "a LandXML with entities that would expand to gigabytes",
        of_file(
            '<!DOCTYPE x [<!ENTITY a "aaaaaaaaaa"><!ENTITY b "&a;&a;&a;&a;&a;&a;&a;&a;">]>'
            + landxml().replace("A", "&b;")
        ),
        "design.xml declares a document type, which may hide anything behind its entities and which LandXML does not "
        "need: remove the DOCTYPE.",
    ),
    refused("other XML", of_file("<gml/>"), "design.xml is XML of another kind: its root is gml, not LandXML."),
    refused("an empty file", of_file(""), "design.xml is empty, not LandXML: export the alignments as LandXML."),
    refused(
        "a file without alignments",
        of_file(f"<LandXML>{METRIC}{SYSTEM}<Surfaces/></LandXML>"),
        "design.xml has no alignment with a CoordGeom: export the alignments from the design program, too.",
    ),
    refused(
        "an arc that turns to the wrong side",
        of_file(landxml(LINE + SPIRAL + CURVE.replace("cw", "ccw"))),
        "The Curve 3 of alignment A of design.xml turns to the other side than it states: repair it.",
    ),
    refused(
        "an element that is missing",
        of_file(
            landxml(LINE + CURVE.replace("5782", "5783").replace("578300<", "578301<").replace("578450", "578451"))
        ),
        "The Curve 2 of alignment A of design.xml starts 1.00 m from the end of the element before: the file lacks "
        "one.",
    ),
    refused(
        "a length that does not fit the ends",
        of_file(landxml(LINE + SPIRAL.replace('"60"', '"62"'))),
        "The Spiral 2 of alignment A of design.xml misses its end by … m with its length and radii: export the file "
        "again.",
    ),
    Fault(
        "a file without a coordinate system",
        of_file(landxml(head=METRIC)),
        WARNED,
        "design.xml has no coordinate system: choose CRS to see its tracks in their place.",
    ),
    Fault(
        "a coordinate system that does not fit",
        of_file(landxml(head=METRIC), CRS="EPSG:31467"),
        WARNED,
        "design.xml is outside the area of DHDN / 3-degree Gauss-Kruger zone 3: check its coordinate system.",
    ),
    refused(
        "a coordinate system in feet",
        of_file(landxml(head=METRIC + '<CoordinateSystem epsgCode="2222"/>')),
        "design.xml is in metres, but its coordinate system EPSG:2222 is not: choose another CRS, or correct the file.",
    ),
    refused(
        "deviations without tracks",
        lambda bench: {**of_file()(bench), "DEVIATIONS": bench.folder / "out" / "AXIS2.gpkg"},
        "DEVIATIONS and REPORT compare measured tracks with the alignments: choose TRACKS.",
    ),
    refused(
        "tracks elsewhere",
        lambda bench: {**of_file()(bench), "TRACKS": line_at(bench, 579_000.0)},
        "None of TRACKS lies along an alignment of INPUT: check the coordinate system of both.",
    ),
    refused(
        "a file that does not exist",
        lambda bench: {"INPUT": bench.folder / "gone.xml"},
        "…gone.xml can't be read (No such file or directory): check its name and your rights.",
    ),
]


def of_table(change=lambda rows: rows, columns=ELEMENT_FIELDS, **parameters):
    """An element table of a straight and an arc."""

    def prepare(bench):
        layer = QgsVectorLayer("LineString?crs=EPSG:25832", "elements", "memory")
        layer.dataProvider().addAttributes(fields(columns).toList())
        layer.updateFields()
        line = {"track_id": 1, "no": 1, "layout": "H", "type": "line", "s_from": 0.0, "s_to": 100.0, "x": 578200.0}
        line.update(y=5804300.0, heading=0.0)
        arc = {**line, "no": 2, "type": "arc", "s_from": 100.0, "s_to": 150.0, "x": 578300.0, "r1_m": 300.0}
        for row in change([line, arc]) if columns is ELEMENT_FIELDS else ():
            feature = QgsFeature(layer.fields())
            for name, value in row.items():
                feature[name] = value
            layer.dataProvider().addFeature(feature)
        bench.layer = layer
        return {"INPUT": layer, **parameters}

    return prepare


def changed(number, **values):
    return lambda rows: [{**row, **(values if at == number else {})} for at, row in enumerate(rows)]


EXPORTED = [
    Fault("an element table", of_table(), FINE, gives={"ALIGNMENT_COUNT": 1, "ELEMENT_COUNT": 2}),
    refused(
        "a layer that is not an element table",
        of_table(columns=ELEMENT_FIELDS[:2]),
        "INPUT is not an element table, because it lacks the fields layout, s_from, s_to: give the output ELEMENTS of "
        "Fit alignment or Import alignment.",
    ),
    refused(
        "a table whose elements were edited apart",
        of_table(changed(1, x=578300.5)),
        "Element 1 in layout H of track 1 ends 0.500 m from the start of element 2: run Fit alignment with the edited "
        "table as FIXED, which joins them.",
    ),
    refused(
        "a table without elements in plan",
        of_table(lambda rows: [{**row, "layout": "C"} for row in rows]),
        "The element table has no row with layout H for track 1: give it the elements in plan, too.",
    ),
    refused(
        "an arc without a radius",
        of_table(changed(1, r1_m=None, r2_m=None)),
        "The element 2 of layout H of track 1 is of type arc and has no radius: fill one, or make it a line.",
    ),
    refused(
        "an ending that is not a format",
        lambda bench: {**of_table()(bench), "OUTPUT": bench.folder / "out" / "design.dwg"},
        "OUTPUT can't be design.dwg: let it end in .xml for LandXML, in .ifc or in .dxf.",
    ),
]


FAULTS = [*IMPORTED, *(replace(fault, run="exportalignment") for fault in EXPORTED)]


@pytest.mark.parametrize("fault", FAULTS, ids=lambda fault: fault.name)
def test_fault(meet, fault):
    meet(fault, "importalignment")
