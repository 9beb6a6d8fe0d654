"""Files of an algorithm: whole, alone in their place, and without harm to the tables next to them."""

import sqlite3

import pytest
from memory_layers import layer_of
from osgeo import ogr
from qgis.core import (
    QgsProcessingOutputLayerDefinition,
    QgsProperty,
    QgsRemappingSinkDefinition,
    QgsVectorLayer,
)

CENTERLINES = "buildtrackcenterlines"


@pytest.fixture
def rails():
    """Two rails of 20 m."""
    return layer_of(*(f"LINESTRING Z (500000 {y} 100, 500020 {y} 100)" for y in (3000000, 3000001.507)))


@pytest.fixture
def build(run_step, rails):
    """Build the centerline of a track into a destination."""

    def build(destination):
        outcome = run_step(CENTERLINES, {"INPUT": rails, "OUTPUT": destination})
        assert outcome.ok, outcome.error
        return outcome.results["OUTPUT"]

    return build


def tables(path):
    """Number of features by table."""
    dataset = ogr.Open(str(path))
    layers = (dataset.GetLayer(number) for number in range(dataset.GetLayerCount()))
    return {layer.GetName(): layer.GetFeatureCount() for layer in layers}


def others_in(path):
    """A GeoPackage with tables of other people, and one row of ours."""
    dataset = ogr.GetDriverByName("GPKG").CreateDataSource(str(path))
    for name, count in (("signals", 3), ("tracks", 5), ("notes", 2)):
        kind = ogr.wkbNone if name == "notes" else ogr.wkbPoint
        layer = dataset.CreateLayer(name, geom_type=kind)
        for _ in range(count):
            layer.CreateFeature(ogr.Feature(layer.GetLayerDefn()))
    return path


def as_path(path):
    return str(path)


def as_definition(path):
    return QgsProcessingOutputLayerDefinition(str(path))


def as_table(path):
    return f"ogr:dbname='{path}' table=\"tracks\" (geom)"


@pytest.mark.parametrize("form", [as_path, as_definition, as_table])
def test_the_other_tables_of_a_geopackage_stay(build, tmp_path, form):
    path = others_in(tmp_path / "tracks.gpkg")
    found = build(form(path))
    assert found == f"{path}|layername=tracks"
    assert tables(path) == {"signals": 3, "tracks": 1, "notes": 2}
    layer = QgsVectorLayer(found, "tracks", "ogr")
    (feature,) = layer.getFeatures()
    assert layer.crs().authid() == "EPSG:32643"
    assert (
        feature.geometry().asWkt(4).replace("LineString Z", "LineStringZ")
        == "LineStringZ (500000 3000000.7535 100, 500020 3000000.7535 100)"
    )
    assert feature["gauge_mm"] == 1435.0
    assert [file.name for file in tmp_path.iterdir()] == ["tracks.gpkg"]


def test_a_table_is_the_same_in_a_file_of_its_own_and_next_to_others(build, tmp_path):
    (tmp_path / "alone").mkdir()
    alone, among = tmp_path / "alone" / "tracks.gpkg", others_in(tmp_path / "tracks.gpkg")
    build(alone), build(among)
    rows = []
    for path in (alone, among):
        database = sqlite3.connect(path)
        columns = [row[1:] for row in database.execute("PRAGMA table_info(tracks)")]
        rows.append((columns, database.execute("SELECT * FROM tracks").fetchall()))
        (kind,) = database.execute(
            "SELECT geometry_type_name, z FROM gpkg_geometry_columns WHERE table_name = 'tracks'"
        )
        assert kind == ("LINESTRING", 1)
        database.close()
    assert rows[0] == rows[1]


def test_two_tables_of_one_file_in_one_run(run_step, bench, tmp_path):
    path = tmp_path / "both.gpkg"
    outputs = {name: f"ogr:dbname='{path}' table=\"{name.lower()}\" (geom)" for name in ("RAILS", "CENTERLINES")}
    cloud = bench.cloud(bench.track(length_m=6.0))
    outcome = run_step("extractrails", {"INPUT": cloud, "ITERATIONS": 1, **outputs})
    assert outcome.ok, outcome.error
    assert tables(path) == {"rails": 2, "centerlines": 1}


@pytest.mark.parametrize("name", ["100 % ä#1.gpkg", "a?b='c'.gpkg"])
def test_any_name_of_a_geopackage(build, tmp_path, name):
    found = build(tmp_path / name)
    assert QgsVectorLayer(found, "tracks", "ogr").featureCount() == 1
    assert [file.name for file in tmp_path.iterdir()] == [name]


def adding_to(source, crs, sink=None):
    """A destination to whose layer features are added."""
    layer = QgsVectorLayer(source, "tracks", "ogr")
    definition = QgsRemappingSinkDefinition()
    definition.setSourceCrs(crs)
    definition.setDestinationCrs(layer.crs())
    definition.setDestinationFields(layer.fields())
    definition.setDestinationWkbType(layer.wkbType())
    names = [field.name() for field in layer.fields() if field.name() != "fid"]
    definition.setFieldMap({name: QgsProperty.fromField(name) for name in names})
    value = QgsProcessingOutputLayerDefinition(sink or source)
    value.setRemappingDefinition(definition)
    return value


@pytest.mark.parametrize("name", ["tracks.gpkg", "it's.gpkg", "tracks.shp", "tracks.geojson"])
def test_features_can_be_added_to_a_layer(build, rails, tmp_path, name):
    path = tmp_path / name
    if name.endswith("gpkg"):
        others_in(path)
    first = as_table(path).replace("it's", "it\\'s") if name.endswith("gpkg") else path
    build(first)
    before = {file.name for file in tmp_path.iterdir()}
    source = f"{path}|layername=tracks" if name.endswith("gpkg") else str(path)
    for count, sink in ((2, source), (3, first if name.endswith("gpkg") else source)):
        found = build(adding_to(source, rails.crs(), sink))
        layer = QgsVectorLayer(found, "tracks", "ogr")
        features = list(layer.getFeatures())
        assert len(features) == count
        assert {feature["gauge_mm"] for feature in features} == {1435.0}
        assert len({feature.geometry().asWkt(4) for feature in features}) == 1
        assert layer.crs().authid() == "EPSG:32643"
        del layer
    assert {file.name for file in tmp_path.iterdir()} == before
    if name.endswith("gpkg"):
        assert tables(path) == {"signals": 3, "tracks": 3, "notes": 2}


def test_a_layer_that_takes_no_features_is_refused(run_step, rails, tmp_path):
    path = tmp_path / "tracks.gpkg"
    others_in(path)
    value = adding_to(f"{path}|layername=gone", rails.crs())
    outcome = run_step(CENTERLINES, {"INPUT": rails, "OUTPUT": value})
    assert not outcome.ok
    assert "Nothing can be added to" in outcome.error


@pytest.mark.parametrize("name", ["tracks.csv", "tracks.dxf"])
def test_nothing_is_added_to_files_for_other_programs(build, run_step, rails, tmp_path, name):
    build(tmp_path / name)
    before = (tmp_path / name).read_bytes()
    outcome = run_step(CENTERLINES, {"INPUT": rails, "OUTPUT": adding_to(str(tmp_path / name), rails.crs())})
    assert not outcome.ok
    assert f"Nothing can be added to {name}, because DXF and CSV files are written as a whole" in outcome.error
    assert (tmp_path / name).read_bytes() == before


def test_every_layer_can_be_an_existing_one(plugin):
    outputs = [output for one in plugin.provider.algorithms() for output in one.destinationParameterDefinitions()]
    layers = [output for output in outputs if output.type() == "sink"]
    assert len(layers) >= 6
    assert all(output.supportsAppend() for output in layers)
