"""The appearance of results that QGIS loads."""

import gc
from functools import partial

import pytest
from memory_layers import layer_of
from qgis.core import (
    Qgis,
    QgsExpression,
    QgsExpressionContext,
    QgsExpressionContextUtils,
    QgsFeature,
    QgsGeometry,
    QgsLayerTree,
    QgsMapRendererParallelJob,
    QgsMapSettings,
    QgsProcessingContext,
    QgsProcessingUtils,
    QgsProject,
    QgsRasterLayer,
    QgsRectangle,
    QgsRenderContext,
    QgsVectorFileWriter,
    QgsVectorLayer,
)
from qgis.PyQt.QtCore import QSize
from qgis.PyQt.QtGui import QColor
from rail_extract.core.fields import PRODUCTS
from rail_extract.rail_extract_plugin import compat
from rail_extract.rail_extract_plugin.paths import STYLES
from rail_extract.rail_extract_plugin.writing.layers import fields
from rail_extract.rail_extract_plugin.writing.run import RUN, SOURCE, TOOL, new_run
from rail_extract.rail_extract_plugin.writing.styling import style_on_load

SHAPES = {
    **dict.fromkeys(("rails", "centerlines", "findings", "elements", "airborne", "places"), "LineStringZ"),
    **dict.fromkeys(("platforms", "wires"), "LineStringZ"),
    **dict.fromkeys(("quality", "stops", "differences", "deviations", "stations"), "PointZ"),
    **dict.fromkeys(("intrusions", "clearance"), "PointZ"),
    "axes": "LineStringZM",
}
COLUMNS = {product.style: product.fields for product in reversed(PRODUCTS)}


DRAWN = {
    "rails": ({"sigma_mm": 1.0}, "#1565c0"),
    "centerlines": ({"track_id": 1}, "#e64a19"),
    "quality": ({"track_id": 1, "gauge_mm": 1435.0, "bridged": 1}, "#f28e2b"),
    "findings": ({"finding": 1, "review": "accepted"}, "#84b397"),
    "stops": ({"stop": 1, "reason": "the cloud ends"}, "#e64a19"),
    "differences": ({"line_id": 1, "state": "both", "moved": 1}, "#b2182b"),
    "elements": ({"type": "arc"}, "#1565c0"),
    "axes": ({"track_id": 1}, "#8e5bb5"),
    "deviations": ({"track_id": 1, "slew_mm": 12.0}, "#b2182b"),
    "airborne": ({"track_id": 1}, "#e64a19"),
    "stations": ({"track_id": 1, "seen": 1}, "#2e7d4f"),
}
"""A row of each style, and a colour in which it is drawn."""

LINE, POINT = "LINESTRING Z (500000 3000000 1, 500100 3000000 1)", "POINT Z (500050 3000000 1)"


@pytest.fixture
def load(context, new_feedback):
    """Style and name a layer as QGIS does after a run."""

    def load(layer, style, properties=None, title=""):
        details = QgsProcessingContext.LayerDetails(title, QgsProject.instance(), title)
        context.addLayerToLoadOnCompletion(layer.id(), details)
        style_on_load(layer.id(), style, context, properties or {}, title)
        gc.collect()
        details = context.layerToLoadOnCompletionDetails(layer.id())
        details.postProcessor().postProcessLayer(layer, context, new_feedback())
        return layer

    return load


@pytest.fixture
def styled(load):
    """Load a memory layer with these rows, all at one place."""

    def make(style, rows=(), columns=()):
        layer = QgsVectorLayer(f"{SHAPES[style]}?crs=EPSG:32643", style, "memory")
        layer.dataProvider().addAttributes(fields(columns or COLUMNS[style]).toList())
        layer.updateFields()
        for values in rows:
            feature = QgsFeature(layer.fields())
            feature.setGeometry(QgsGeometry.fromWkt(POINT if "Point" in SHAPES[style] else LINE))
            for name, value in values.items():
                feature[name] = value
            assert layer.dataProvider().addFeature(feature)
        return load(layer, style)

    return make


def colours(layer):
    """Return the colour of each feature's symbol."""
    rendering = QgsRenderContext()
    rendering.setExpressionContext(QgsExpressionContext(QgsExpressionContextUtils.globalProjectLayerScopes(layer)))
    renderer = layer.renderer()
    renderer.startRender(rendering, layer.fields())
    found = []
    for feature in layer.getFeatures():
        rendering.expressionContext().setFeature(feature)
        symbol = renderer.symbolForFeature(feature, rendering)
        found.append(symbol and symbol.color().name())
    renderer.stopRender(rendering)
    return found


def test_rails_are_coloured_by_their_standard_error(styled):
    errors = (0.5, 2.0, 4.0, 7.0, 30.0, None)
    assert colours(styled("rails", [{"sigma_mm": sigma} for sigma in errors])) == [
        "#1565c0",
        "#1565c0",
        "#4fb3bf",
        "#f28e2b",
        "#d62839",
        "#d62839",
    ]


def test_lone_rails_are_coloured_apart_unless_no_rail_has_been_paired(styled):
    rows = [{"sigma_mm": 0.5, "track_ids": tracks} for tracks in ("1", "1,2", "", None)]
    assert colours(styled("rails", rows)) == ["#1565c0", "#1565c0", "#825aa0", "#825aa0"]
    assert colours(styled("rails", rows[2:])) == ["#1565c0", "#1565c0"]


def test_quality_is_coloured_by_the_deviation_from_the_median_gauge_of_the_track(styled):
    gauges = {1: (1435, 1435, 1435, 1443, 1420, None), 2: (1000, 1000, 1001, 985, 1012)}
    rows = [
        {"track_id": track, "gauge_mm": gauge, "bridged": 0} for track, values in gauges.items() for gauge in values
    ]
    well, wide, too_wide, too_narrow, unknown = "#4da05a", "#ef8a62", "#b2182b", "#2166ac", "#969696"
    assert colours(styled("quality", rows)) == [
        *[well, well, well, wide, too_narrow, unknown],
        *[well, well, well, too_narrow, too_wide],
    ]


def test_findings_are_coloured_by_their_review(styled):
    rows = [{"finding": 1, "review": review} for review in (None, "", "accepted", "rejected")]
    assert colours(styled("findings", rows)) == ["#d62839", "#d62839", "#2e7d4f", "#787878"]


def test_intrusions_are_redder_the_deeper_they_are(styled):
    rows = [{"pen_mm": depth, "sure": sure, "what": what} for depth, sure, what in INTRUSIONS]
    assert colours(styled("intrusions", rows)) == ["#9aa5b1", "#ffffff", "#fcbba1", "#fb6a4a", "#cb181d", "#67000d"]


INTRUSIONS = [(900, 1, "platform"), (4, 0, ""), (8, 1, ""), (30, 1, ""), (90, 1, ""), (200, 1, "")]


def test_elements_are_coloured_by_type_and_drawn_once(styled):
    types = ("line", "clothoid", "arc", "grade", "parabola", "constant", "ramp")
    found = colours(styled("elements", [{"type": one} for one in types]))
    assert found == ["#546e7a", "#f28e2b", "#1565c0", None, None, None, None]


@pytest.mark.parametrize("kind", PRODUCTS, ids=lambda kind: f"{kind.style}{len(kind.fields)}")
def test_fields_have_names_in_words_with_units(styled, kind):
    layer = styled(kind.style, columns=kind.fields)
    for field in kind.fields:
        alias = layer.attributeAlias(layer.fields().lookupField(field.name))
        assert alias and alias != field.name
        for ending, unit in (("_mm", "[mm]"), ("_m", "[m]"), ("_pm", "[‰]")):
            assert alias.endswith(unit) or not field.name.endswith(ending) or alias.endswith("[mm]"), alias


def said(layer, text):
    """Evaluate a text of a layer, such as its map tip, for its first feature."""
    scopes = QgsExpressionContext(QgsExpressionContextUtils.globalProjectLayerScopes(layer))
    scopes.setFeature(next(layer.getFeatures()))
    return QgsExpression.replaceExpressionText(text, scopes)


ARC = {"layout": "H", "type": "arc", "r1_m": -500.0, "r2_m": -500.0, "length_m": 80.0, "track_id": 3}
CLOTHOID = {**ARC, "type": "clothoid", "a_param": 200.0, "r1_m": None}
GRADE = {"layout": "V", "type": "grade", "grade1_pm": 2.5, "grade2_pm": 2.5, "length_m": 40.0}


@pytest.mark.parametrize(
    ("style", "values", "tip"),
    [
        ("rails", {"rail_id": 3, "sigma_mm": 1.25}, ["Rail 3", "Standard error: 1.3 mm", "In no track"]),
        ("centerlines", {"track_id": 2, "gauge_mm": 1436.04}, ["Track 2", "Gauge: 1,436.0 mm", "Cant: unknown"]),
        ("quality", {"track_id": 2, "chainage_m": 17.0}, ["Track 2, 17.0 m", "Gauge: unknown"]),
        ("stops", {"stop": 2, "reason": "the cloud ends"}, ["Stop 2", "the cloud ends"]),
        ("differences", {"line_id": 3, "chainage_m": 5.0, "state": "both"}, ["Line 3, 5 m: both", "height ? mm"]),
        ("findings", {"finding": 4, "reason": "gauge off", "track_id": 1}, ["4: gauge off", "Track 1", "Review: open"]),
        ("elements", ARC, ["Radius: -500.0 to -500.0"]),
        ("elements", CLOTHOID, ["straight to -500.0"]),
        ("elements", GRADE, ["Gradient: 2.50 to 2.50 ‰"]),
        ("intrusions", {"intrusion": 2, "pen_mm": 12.34, "track_id": 1, "side": "left"}, ["2: 12.3 mm inside", "left"]),
        (
            "clearance",
            {"track_id": 1, "chainage_m": 7.0, "lmar_mm": 120.0},
            ["Track 1, 7.0 m", "left: 120 mm", "unknown"],
        ),
        ("platforms", {"platform": 3, "offset_mm": 1650.0}, ["Platform 3", "Offset: 1,650.0 mm"]),
        ("wires", {"wire": 1, "height_mm": 5500.0}, ["Wire 1", "5,500.0 mm"]),
        ("axes", {"name": "Siding", "km_from": 12.5, "km_to": 13.0}, ["12.500 to 13.000"]),
    ],
)
def test_map_tips_say_what_is_under_the_mouse(styled, style, values, tip):
    layer = styled(style, [values])
    shown = said(layer, layer.mapTipTemplate())
    assert [words for words in tip if words not in shown] == []


@pytest.mark.parametrize(
    ("style", "values", "label"),
    [
        ("elements", ARC, "R -500, 80.0 m"),
        ("elements", CLOTHOID, "A 200, 80.0 m"),
        ("elements", GRADE, ""),
        ("axes", {"name": "Siding", "km_from": 12.5, "km_to": 13.0}, "Siding km 12.500"),
        ("centerlines", {"track_id": 7}, "Track 7"),
    ],
)
def test_labels(styled, style, values, label):
    layer = styled(style, [values])
    assert layer.labelsEnabled()
    settings = layer.labeling().settings()
    expression = settings.fieldName if settings.isExpression else f'"{settings.fieldName}"'
    assert said(layer, f"[% {expression} %]") == label


def test_the_review_is_chosen_from_a_list(styled):
    layer = styled("findings")
    widget = layer.editorWidgetSetup(layer.fields().lookupField("review"))
    assert widget.type() == "ValueMap"
    # Newer QGIS gives None for an empty value.
    choices = {label: value or "" for one in widget.config()["map"] for label, value in one.items()}
    assert choices == {"open": "", "accepted": "accepted", "rejected": "rejected"}


def groups():
    """Return the names of the groups of the project, with those of their layers."""
    top = QgsProject.instance().layerTreeRoot().children()
    return {one.name(): [node.name() for node in one.children()] for one in top if QgsLayerTree.isGroup(one)}


def test_layers_are_named_by_input_and_grouped_and_numbered_by_run(load, context, tmp_path):
    project, fit = QgsProject.instance(), "Fit alignment"
    run = partial(new_run, "Extract rails", context=context)
    tracks = project.addMapLayer(layer_of())
    tracks.setName("siding 4")
    runs = [run(value=str(tmp_path / name)) for name in ("a.laz", "a.laz", "b.copc.laz")]
    runs += [run(value=f"{tmp_path}/all.gpkg|layername=tracks"), new_run(fit, tracks.id(), context)]
    for properties in (*runs, run(value=f"{QgsProcessingUtils.tempFolder()}/between.tif")):
        for title in ("Rails", "Findings"):
            layer = project.addMapLayer(layer_of())
            layer.setName(title)
            load(layer, title.lower(), properties, title)
    rails = next(one for one in project.mapLayers().values() if one.name() == "Rails: b")
    elements = project.addMapLayer(layer_of())
    elements.setName("Elements")
    load(elements, "elements", new_run(fit, rails.id(), context), "Elements")
    named = {"Extract rails: a": "a", "Extract rails: a 2": "a 2", "Extract rails: b": "b"}
    named |= {"Extract rails: tracks": "tracks", "Fit alignment: siding 4": "siding 4"}
    expected = {group: [f"Findings: {of}", f"Rails: {of}"] for group, of in named.items()}
    assert groups() == {**expected, "Fit alignment: b": ["Elements: b"]}
    mine = project.addMapLayer(layer_of())
    mine.setName("my file")
    assert load(mine, "rails", runs[0], "Rails").name() == "my file"
    assert "my file" in groups()["Extract rails: a"]


def test_a_copy_with_kilometres_looks_like_its_original(load, context):
    original = QgsProject.instance().addMapLayer(layer_of(LINE, fields="&field=kind:string"))
    original.renderer().symbol().setColor(QColor("#123456"))
    original.setFieldAlias(0, "Kind of crossing")
    original.setCustomProperty(RUN, "another run")
    copy = layer_of(LINE, fields="&field=kind:string&field=km:double")
    load(copy, "places", new_run("Station along axis", original.id(), context))
    assert copy.renderer().symbol().color().name() == "#123456"
    assert [copy.attributeAlias(number) for number in range(2)] == ["Kind of crossing", "Kilometre"]
    assert copy.customProperty(RUN) != "another run"


@pytest.mark.parametrize("style", DRAWN)
def test_layers_can_be_drawn(styled, style):
    """Something is drawn, and not in a random colour of QGIS."""
    values, colour = DRAWN[style]
    layer = styled(style, [values])
    settings = QgsMapSettings()
    settings.setLayers([layer])
    settings.setDestinationCrs(layer.crs())
    settings.setExtent(QgsRectangle(500000, 2999950, 500100, 3000050))
    settings.setOutputSize(QSize(300, 300))
    settings.setBackgroundColor(QColor("white"))
    job = QgsMapRendererParallelJob(settings)
    job.start()
    job.waitForFinished()
    image = job.renderedImage()
    assert colour in {image.pixelColor(x, y).name() for x in range(60, 200) for y in range(100, 200)}


@pytest.mark.skipif(Qgis.QGIS_VERSION_INT < 32600, reason="vector layers have no elevation properties")
@pytest.mark.parametrize("style", DRAWN)
def test_elevation_of_layers_is_absolute(styled, style):
    layer = styled(style)
    properties = layer.elevationProperties()
    assert properties.clamping() == Qgis.AltitudeClamping.Absolute
    assert properties.binding() == Qgis.AltitudeBinding.Vertex


@pytest.mark.parametrize("loaded", [("quality", "rails", "findings", "centerlines"), ("findings", "quality", "rails")])
def test_layers_of_a_run_are_in_order_however_they_are_loaded(load, context, loaded):
    project, root = QgsProject.instance(), QgsProject.instance().layerTreeRoot()
    project.addMapLayer(QgsVectorLayer("LineString", "other", "memory"))
    for style in loaded:
        layer = project.addMapLayer(QgsVectorLayer("LineStringZ", style, "memory"), False)
        # QGIS adds layers to the group in which one is selected: here, from the second on, to that of the run.
        (root.findGroup("Extract rails: a") or root).insertLayer(0, layer)
        load(layer, style, {RUN: "one", TOOL: "Extract rails", SOURCE: "a"})
    order = [style for style in ("findings", "centerlines", "rails", "quality") if style in loaded]
    assert [node.name() for node in root.findLayers()] == [*order, "other"]
    assert len(project.mapLayers()) == len(loaded) + 1


def test_a_layer_whose_file_was_replaced_shows_the_new_one(load, tmp_path):
    def write(path, reason):
        layer, options = (
            layer_of(LINE, fields="&field=reason:string", values=[(reason,)]),
            QgsVectorFileWriter.SaveVectorOptions(),
        )
        QgsVectorFileWriter.writeAsVectorFormatV3(layer, str(path), QgsProject.instance().transformContext(), options)

    shown, new = tmp_path / "shown.gpkg", tmp_path / "new.gpkg"
    write(shown, "old")
    layer = QgsProject.instance().addMapLayer(QgsVectorLayer(str(shown), "findings", "ogr"))
    assert [one["reason"] for one in layer.getFeatures()] == ["old"]
    write(new, "new")
    new.replace(shown)
    assert [one["reason"] for one in load(layer, "findings").getFeatures()] == ["new"]


def test_rasters_are_black_on_transparent(qgis, write_cloud, track, run_step, tmp_path):
    path = tmp_path / "raster.tif"
    assert run_step("rasterizerailpoints", {"INPUT": write_cloud(track()), "OUTPUT": path}).ok
    layer = QgsRasterLayer(str(path), "raster")
    layer.loadNamedStyle(str(STYLES / "raster.qml"))
    (entry,) = layer.renderer().classes()
    assert (entry.value, entry.color.name(), entry.color.alpha()) == (1, "#000000", 255)
    assert layer.dataProvider().sourceNoDataValue(1) == 0  # drawn as nothing


def test_styles_are_applied_again_in_a_second_run(qgis, new_feedback):
    """QGIS deletes the stylers with its context; each of two layers of a run has its own."""
    for _ in range(2):
        context = QgsProcessingContext()
        layers = [layer_of(fields="&field=sigma_mm:double") for _ in range(2)]
        for layer in layers:
            details = QgsProcessingContext.LayerDetails("rails", QgsProject.instance(), "RAILS")
            context.addLayerToLoadOnCompletion(layer.id(), details)
            style_on_load(layer.id(), "rails", context)
        gc.collect()
        for layer in layers:
            details = context.layerToLoadOnCompletionDetails(layer.id())
            details.postProcessor().postProcessLayer(layer, context, new_feedback())
            assert layer.renderer().type() == "graduatedSymbol"
        del details, context
        gc.collect()


@pytest.mark.parametrize("style", ["rails", "centerlines", "findings"])
def test_lines_keep_their_heights_in_3d(styled, style):
    symbols = pytest.importorskip("qgis._3d")
    layer = styled(style, ())
    gc.collect()
    symbol = layer.renderer3D().symbol()
    bare = symbols.QgsLine3DSymbol()
    compat.keep_heights(bare)
    assert (symbol.altitudeClamping(), symbol.altitudeBinding()) == (bare.altitudeClamping(), bare.altitudeBinding())
    if Qgis.QGIS_VERSION_INT < 34400:  # where heights are relative to the terrain by default
        assert bare.altitudeClamping() != symbols.QgsLine3DSymbol().altitudeClamping()
    assert layer.renderer3D().layer() == layer
    assert symbol.renderAsSimpleLines() and symbol.width() >= 2
