"""The appearance of results that QGIS loads."""

import gc

import numpy as np
import pytest
from qgis.core import (
    Qgis,
    QgsExpression,
    QgsExpressionContext,
    QgsExpressionContextUtils,
    QgsFeature,
    QgsGeometry,
    QgsMapRendererParallelJob,
    QgsMapSettings,
    QgsProcessingContext,
    QgsProject,
    QgsRasterLayer,
    QgsRectangle,
    QgsRenderContext,
    QgsVectorFileWriter,
    QgsVectorLayer,
)
from qgis.PyQt.QtCore import QSize
from qgis.PyQt.QtGui import QColor
from rail_extract.core import fields as core_fields
from rail_extract.core.fields import PRODUCTS
from rail_extract.core.frame import LocalFrame
from rail_extract.rail_extract_plugin import compat
from rail_extract.rail_extract_plugin.paths import STYLES
from rail_extract.rail_extract_plugin.reading.clouds import CloudSource
from rail_extract.rail_extract_plugin.writing.layers import fields
from rail_extract.rail_extract_plugin.writing.run import properties_of
from rail_extract.rail_extract_plugin.writing.styling import style_on_load

SHAPES = {
    **dict.fromkeys(("rails", "centerlines", "findings", "elements", "airborne", "proposed", "places"), "LineStringZ"),
    **dict.fromkeys(("quality", "stops", "differences", "deviations", "stations"), "PointZ"),
    "axes": "LineStringZM",
}
DRAWN = [style for style in SHAPES if style != "places"]
COLUMNS = {product.style: product.fields for product in reversed(PRODUCTS)}


@pytest.fixture
def styled(context, new_feedback):
    """A memory layer with these rows, styled as QGIS does after a run."""

    def make(style, rows=(), columns=()):
        layer = QgsVectorLayer(f"{SHAPES[style]}?crs=EPSG:32643", style, "memory")
        layer.dataProvider().addAttributes(fields(columns or COLUMNS[style]).toList())
        layer.updateFields()
        for wkt, values in rows:
            feature = QgsFeature(layer.fields())
            feature.setGeometry(QgsGeometry.fromWkt(wkt))
            for name, value in values.items():
                feature[name] = value
            assert layer.dataProvider().addFeature(feature)
        details = QgsProcessingContext.LayerDetails(style, QgsProject.instance(), style.upper())
        context.addLayerToLoadOnCompletion(layer.id(), details)
        style_on_load(layer.id(), style, context)
        gc.collect()
        post_processor = context.layerToLoadOnCompletionDetails(layer.id()).postProcessor()
        post_processor.postProcessLayer(layer, context, new_feedback())
        return layer

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


LINE = "LINESTRING Z (500000 3000000 1, 500100 3000000 1)"


def test_rails_are_coloured_by_their_standard_error(styled):
    errors = (0.5, 2.0, 4.0, 7.0, 30.0, None)
    assert colours(styled("rails", [(LINE, {"sigma_mm": sigma}) for sigma in errors])) == [
        "#1565c0",
        "#1565c0",
        "#4fb3bf",
        "#f28e2b",
        "#d62839",
        "#d62839",
    ]


def test_lone_rails_are_coloured_apart_unless_no_rail_has_been_paired(styled):
    rows = [(LINE, {"sigma_mm": 0.5, "track_ids": tracks}) for tracks in ("1", "1,2", "", None)]
    assert colours(styled("rails", rows)) == ["#1565c0", "#1565c0", "#825aa0", "#825aa0"]
    assert colours(styled("rails", rows[2:])) == ["#1565c0", "#1565c0"]


def test_quality_is_coloured_by_the_deviation_from_the_median_gauge_of_the_track(styled):
    gauges = {1: (1435, 1435, 1435, 1443, 1420, None), 2: (1000, 1000, 1001, 985, 1012)}
    rows = [
        ("POINT Z (500000 3000000 1)", {"track_id": track, "gauge_mm": gauge, "bridged": 0})
        for track, values in gauges.items()
        for gauge in values
    ]
    well, wide, too_wide, too_narrow, unknown = "#4da05a", "#ef8a62", "#b2182b", "#2166ac", "#969696"
    assert colours(styled("quality", rows)) == [
        *[well, well, well, wide, too_narrow, unknown],
        *[well, well, well, too_narrow, too_wide],
    ]


def test_findings_are_coloured_by_their_review(styled):
    rows = [(LINE, {"finding": 1, "review": review}) for review in (None, "", "accepted", "rejected")]
    assert colours(styled("findings", rows)) == ["#d62839", "#d62839", "#2e7d4f", "#787878"]


def test_elements_are_coloured_by_type_and_drawn_once(styled):
    types = ("line", "clothoid", "arc", "grade", "parabola", "constant", "ramp")
    found = colours(styled("elements", [(LINE, {"type": one}) for one in types]))
    assert found == ["#546e7a", "#f28e2b", "#1565c0", None, None, None, None]


def test_all_declared_fields_are_in_a_layer():
    declared = {one for fields in vars(core_fields).values() if isinstance(fields, tuple) for one in fields}
    declared -= set(PRODUCTS)
    assert {field for product in PRODUCTS for field in product.fields} == declared
    assert len(declared) > 100


@pytest.mark.parametrize("kind", PRODUCTS, ids=lambda kind: f"{kind.style}{len(kind.fields)}")
def test_fields_have_names_in_words_with_units(styled, kind):
    layer = styled(kind.style, columns=kind.fields)
    for field in kind.fields:
        alias = layer.attributeAlias(layer.fields().lookupField(field.name))
        assert alias and alias != field.name
        for ending, unit in (("_mm", "[mm]"), ("_m", "[m]"), ("_pm", "[‰]")):
            assert alias.endswith(unit) or not field.name.endswith(ending) or alias.endswith("[mm]"), alias


@pytest.mark.parametrize(
    ("style", "values", "said"),
    [
        ("rails", {"rail_id": 3, "sigma_mm": 1.25}, ["Rail 3", "Standard error: 1.3 mm", "In no track"]),
        ("centerlines", {"track_id": 2, "gauge_mm": 1436.04}, ["Track 2", "Gauge: 1,436.0 mm", "Cant: unknown"]),
        ("quality", {"track_id": 2, "chainage_m": 17.0}, ["Track 2, 17.0 m", "Gauge: unknown"]),
        ("stops", {"stop": 2, "reason": "the cloud ends"}, ["Stop 2", "the cloud ends"]),
        ("differences", {"line_id": 3, "chainage_m": 5.0, "state": "both"}, ["Line 3, 5 m: both", "height ? mm"]),
        ("findings", {"finding": 4, "reason": "gauge off", "track_id": 1}, ["4: gauge off", "Track 1", "Review: open"]),
    ],
)
def test_map_tips_say_what_is_under_the_mouse(styled, style, values, said):
    shape = "POINT Z (500000 3000000 1)" if style in ("quality", "stops", "differences") else LINE
    layer = styled(style, [(shape, values)])
    scopes = QgsExpressionContext(QgsExpressionContextUtils.globalProjectLayerScopes(layer))
    scopes.setFeature(next(layer.getFeatures()))
    tip = QgsExpression.replaceExpressionText(layer.mapTipTemplate(), scopes)
    for words in said:
        assert words in tip


ARC = {"layout": "H", "type": "arc", "r1_m": -500.0, "r2_m": -500.0, "length_m": 80.0, "track_id": 3}
GRADE = {"layout": "V", "type": "grade", "grade1_pm": 2.5, "grade2_pm": 2.5, "length_m": 40.0}


@pytest.mark.parametrize(
    ("style", "values", "label", "tip"),
    [
        ("elements", ARC, "R -500, 80.0 m", "Radius: -500.0 to -500.0"),
        (
            "elements",
            {**ARC, "type": "clothoid", "a_param": 200.0, "r1_m": None},
            "A 200, 80.0 m",
            "straight to -500.0",
        ),
        ("elements", GRADE, None, "Gradient: 2.50 to 2.50 ‰"),
        ("axes", {"name": "Siding", "km_from": 12.5, "km_to": 13.0}, "Siding km 12.500", "12.500 to 13.000"),
    ],
)
def test_labels_and_tips_of_alignments(styled, style, values, label, tip):
    layer = styled(style, [(LINE, values)])
    scopes = QgsExpressionContext(QgsExpressionContextUtils.globalProjectLayerScopes(layer))
    scopes.setFeature(next(layer.getFeatures()))
    expression = QgsExpression(layer.labeling().settings().fieldName)
    found = expression.evaluate(scopes)
    assert not expression.hasParserError() and (found or None) == label
    assert tip in QgsExpression.replaceExpressionText(layer.mapTipTemplate(), scopes)


def test_the_review_is_chosen_from_a_list(styled):
    layer = styled("findings")
    widget = layer.editorWidgetSetup(layer.fields().lookupField("review"))
    assert widget.type() == "ValueMap"
    # Newer QGIS gives None for an empty value.
    choices = {label: value or "" for one in widget.config()["map"] for label, value in one.items()}
    assert choices == {"open": "", "accepted": "accepted", "rejected": "rejected"}


def test_the_legend_names_the_ring(styled):
    layer = styled("quality")  # QGIS deletes the renderer with its layer
    labels = [item.label() for item in layer.renderer().legendSymbolItems()]
    assert labels[-1] == "orange ring: a rail has no points"


def test_layers_are_named_by_cloud_and_numbered_by_run(context, new_feedback, tmp_path):
    frame, project, names = LocalFrame(np.zeros(3)), QgsProject.instance(), []
    clouds = [CloudSource((tmp_path / name,)) for name in ("a.laz", "a.laz", "b.copc.laz")]
    runs = [properties_of(cloud, (10,), 0.072, frame) for cloud in clouds]
    for properties in (*runs, {}):
        for title in ("Rails", "Findings"):
            layer = project.addMapLayer(QgsVectorLayer("LineStringZ?crs=EPSG:32643", title, "memory"))
            context.addLayerToLoadOnCompletion(layer.id(), QgsProcessingContext.LayerDetails(title, project, title))
            style_on_load(layer.id(), "rails", context, properties, title)
            details = context.layerToLoadOnCompletionDetails(layer.id())
            details.postProcessor().postProcessLayer(layer, context, new_feedback())
            names.append(layer.name())
    named = [f"{title}{of_cloud}" for of_cloud in (": a", ": a 2", ": b", "") for title in ("Rails", "Findings")]
    assert names == named
    layer = project.addMapLayer(QgsVectorLayer("LineStringZ?crs=EPSG:32643", "my file", "memory"))
    context.addLayerToLoadOnCompletion(layer.id(), QgsProcessingContext.LayerDetails("Rails", project, "RAILS"))
    style_on_load(layer.id(), "rails", context, runs[0], "Rails")
    details = context.layerToLoadOnCompletionDetails(layer.id())
    details.postProcessor().postProcessLayer(layer, context, new_feedback())
    assert layer.name() == "my file"


def test_centerlines_show_their_number_and_direction(styled):
    layer = styled("centerlines", [(LINE, {"track_id": 7})])
    assert colours(layer) == ["#e64a19"]
    arrows = layer.renderer().symbol().symbolLayer(1)
    assert arrows.layerType() == "MarkerLine"
    assert arrows.subSymbol().symbolLayer(0).properties()["name"] == "filled_arrowhead"
    assert layer.labelsEnabled()
    settings = layer.labeling().settings()
    scopes = QgsExpressionContext(QgsExpressionContextUtils.globalProjectLayerScopes(layer))
    scopes.setFeature(next(layer.getFeatures()))
    assert settings.getLabelExpression().evaluate(scopes) == "Track 7"
    assert settings.format().buffer().enabled()


@pytest.mark.parametrize("style", DRAWN)
def test_layers_can_be_drawn(styled, style):
    """Something is drawn, and not in a random colour of QGIS."""
    rows = {
        "rails": (LINE, {"sigma_mm": 1.0}),
        "centerlines": (LINE, {"track_id": 1}),
        "quality": ("POINT Z (500050 3000000 1)", {"track_id": 1, "gauge_mm": 1435.0, "bridged": 1}),
        "findings": (LINE, {"finding": 1, "review": "accepted"}),
        "stops": ("POINT Z (500050 3000000 1)", {"stop": 1, "reason": "the cloud ends"}),
        "differences": ("POINT Z (500050 3000000 1)", {"line_id": 1, "state": "both", "moved": 1}),
        "elements": (LINE, {"type": "arc"}),
        "axes": (LINE, {"track_id": 1}),
        "deviations": ("POINT Z (500050 3000000 1)", {"track_id": 1, "slew_mm": 12.0}),
        "airborne": (LINE, {"track_id": 1}),
        "proposed": (LINE, {"guide_id": 1, "score": 90.0}),
        "stations": ("POINT Z (500050 3000000 1)", {"track_id": 1, "seen": 1}),
    }
    layer = styled(style, [rows[style]])
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
    seen = {image.pixelColor(x, y).name() for x in range(60, 200) for y in range(100, 200)}
    colours = {"rails": "#1565c0", "centerlines": "#e64a19", "quality": "#f28e2b", "findings": "#84b397"}
    colours.update(airborne="#e64a19", proposed="#8e24aa", stations="#2e7d4f")
    colours.update(stops="#e64a19", elements="#1565c0", axes="#8e5bb5", deviations="#b2182b", differences="#b2182b")
    assert colours[style] in seen


@pytest.mark.skipif(Qgis.QGIS_VERSION_INT < 32600, reason="vector layers have no elevation properties")
@pytest.mark.parametrize("style", DRAWN)
def test_elevation_of_layers_is_absolute(styled, style):
    layer = styled(style)
    properties = layer.elevationProperties()
    assert properties.clamping() == Qgis.AltitudeClamping.Absolute
    assert properties.binding() == Qgis.AltitudeBinding.Vertex


@pytest.mark.skipif(Qgis.QGIS_VERSION_INT < 33200, reason="no groups for results")
def test_layers_of_a_run_share_a_group(styled, context):
    layers = [styled(style) for style in ("findings", "rails", "centerlines")]
    details = [context.layerToLoadOnCompletionDetails(layer.id()) for layer in layers]
    assert {one.groupName for one in details} == {"Rail Extract"}


@pytest.mark.parametrize("loaded", [("quality", "rails", "findings", "centerlines"), ("findings", "quality", "rails")])
def test_layers_of_a_run_are_in_order_however_they_are_loaded(context, new_feedback, loaded):
    project, root = QgsProject.instance(), QgsProject.instance().layerTreeRoot()
    project.addMapLayer(QgsVectorLayer("LineString", "other", "memory"))
    for style in loaded:
        layer = QgsVectorLayer("LineStringZ", style, "memory")
        context.addLayerToLoadOnCompletion(layer.id(), QgsProcessingContext.LayerDetails(style, project, style))
        style_on_load(layer.id(), style, context, {"rail_extract/run": "one"})
        project.addMapLayer(layer)
        context.layerToLoadOnCompletionDetails(layer.id()).postProcessor().postProcessLayer(
            layer, context, new_feedback()
        )
    order = [style for style in ("findings", "centerlines", "rails", "quality") if style in loaded]
    assert [node.name() for node in root.findLayers()] == [*order, "other"]
    assert len(project.mapLayers()) == len(loaded) + 1


def test_a_layer_whose_file_was_replaced_shows_the_new_one(context, new_feedback, tmp_path):
    def write(path, reason):
        layer = QgsVectorLayer("LineStringZ?crs=EPSG:32643&field=reason:string", "findings", "memory")
        feature = QgsFeature(layer.fields())
        feature["reason"] = reason
        layer.dataProvider().addFeature(feature)
        options = QgsVectorFileWriter.SaveVectorOptions()
        QgsVectorFileWriter.writeAsVectorFormatV3(layer, str(path), context.transformContext(), options)

    shown, new = tmp_path / "findings.gpkg", tmp_path / "new.gpkg"
    write(shown, "old")
    layer = QgsProject.instance().addMapLayer(QgsVectorLayer(str(shown), "findings", "ogr"))
    assert [one["reason"] for one in layer.getFeatures()] == ["old"]
    write(new, "new")
    new.replace(shown)
    context.addLayerToLoadOnCompletion(layer.id(), QgsProcessingContext.LayerDetails("", QgsProject.instance(), ""))
    style_on_load(layer.id(), "findings", context)
    context.layerToLoadOnCompletionDetails(layer.id()).postProcessor().postProcessLayer(layer, context, new_feedback())
    assert [one["reason"] for one in layer.getFeatures()] == ["new"]


@pytest.mark.parametrize("style", DRAWN)
def test_columns_of_tables_are_as_wide_as_their_titles(styled, style):
    layer = styled(style)
    widths = {column.name: column.width for column in layer.attributeTableConfig().columns()}
    titles = {field.name(): field.displayName() for field in layer.fields()}
    assert set(titles) <= set(widths)
    assert {name: widths[name] for name, title in titles.items() if widths[name] < 8 * len(title)} == {}


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
        layers = [QgsVectorLayer("LineStringZ?field=sigma_mm:double", "rails", "memory") for _ in range(2)]
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


def test_layer_that_is_not_loaded_is_not_styled(context):
    style_on_load("unknown", "rails", context)
    assert not context.layersToLoadOnCompletion()


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
