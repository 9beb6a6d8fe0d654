import pytest
from qgis.core import QgsCoordinateReferenceSystem, QgsPointCloudLayer, QgsProject, QgsProperty, QgsVectorLayer
from rail_extract.core.clouds.header import catalogue_text
from rail_extract.core.clouds.readers import read_header
from rail_extract.core.errors import CloudError
from rail_extract.core.jobs.clouds import CloudSource
from rail_extract.rail_extract_plugin.reading.clouds import cloud_source


@pytest.fixture
def path(write_cloud, track):
    return write_cloud(track(), "Größe 1.las")


@pytest.fixture
def layer(path):
    """A point cloud layer of QGIS; it may be invalid here, because this QGIS may lack PDAL."""
    layer = QgsPointCloudLayer(str(path), "my cloud", "pdal")
    layer.setCrs(QgsCoordinateReferenceSystem("EPSG:32643"))
    return layer


def test_a_file_or_a_folder_is_left_to_the_core(path, context):
    for place in (path, path.parent):
        for given in (str(place), QgsProperty.fromValue(str(place))):
            assert cloud_source(given, context) == CloudSource((place,))


def test_layer_has_its_coordinate_system(path, layer, context):
    source = cloud_source(layer, context)
    assert source.paths == (path,)
    assert "UTM zone 43N" in source.crs_wkt


def test_layer_without_coordinate_system(layer, context):
    layer.setCrs(QgsCoordinateReferenceSystem())
    assert cloud_source(layer, context).crs_wkt is None


@pytest.fixture
def catalogue_layer(path, context):
    """A layer of a virtual point cloud that states a coordinate system; QGIS reads these from 3.32 on."""
    header = read_header(path)
    wkt = QgsCoordinateReferenceSystem("EPSG:32643").toWkt()
    path.with_name("all.vpc").write_text(catalogue_text([(path.name, header.point_count, header.extent)], wkt))
    layer = QgsPointCloudLayer(str(path.with_name("all.vpc")), "my tiles", "vpc")
    if not layer.isValid():
        pytest.skip("this QGIS has no layers of virtual point clouds")
    return layer


def test_filtered_layer_is_refused(catalogue_layer, context):
    assert catalogue_layer.setSubsetString("Classification = 2")
    with pytest.raises(CloudError, match=r'"my tiles" is filtered \(Classification = 2\), but a run reads all points'):
        cloud_source(catalogue_layer, context)


def test_layer_with_another_system_than_its_file_is_refused(catalogue_layer, context):
    catalogue_layer.setCrs(QgsCoordinateReferenceSystem("EPSG:25832"))
    with pytest.raises(CloudError, match="was set to EPSG:25832, but its file states EPSG:32643"):
        cloud_source(catalogue_layer, context)


@pytest.mark.parametrize("value", [None, ""])
def test_missing_value(context, value):
    with pytest.raises(CloudError, match="No point cloud was given"):
        cloud_source(value, context)


def test_loaded_layer_of_another_kind(context):
    vector = QgsVectorLayer("LineStringZ?crs=EPSG:32643", "lines", "memory")
    QgsProject.instance().addMapLayer(vector)
    with pytest.raises(CloudError, match='The layer "lines" is not a point cloud'):
        cloud_source(vector.id(), context)
