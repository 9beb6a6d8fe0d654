"""The front door: one call from a file to lines, and lines as tables, files and a report."""

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import rail_extract as rx
from rail_extract.core.errors import ParameterError
from rail_extract.core.fields import CENTERLINE_FIELDS, QUALITY_FIELDS, RAIL_FIELDS

SAMPLE = Path(rx.__file__).parent / "resources" / "sample" / "sample.laz"


@pytest.fixture(scope="module")
def network():
    return rx.extract(SAMPLE, standard="IN_75R_1000", iterations=1, engine="OPENCV", workers=1)


def test_importing_the_package_imports_no_numpy():
    code = "import sys, rail_extract; assert rail_extract.__version__ and 'numpy' not in sys.modules"
    subprocess.run([sys.executable, "-c", code], check=True)


def test_public_names_are_listed_and_others_are_not_there():
    assert set(rx.__all__) <= set(dir(rx))
    assert rx.__version__.count(".") == 2
    with pytest.raises(AttributeError, match="no attribute 'extrakt'"):
        rx.extrakt  # noqa: B018 - looked up only


def test_a_geopackage_gets_all_layers(network, tmp_path):
    pyogrio = pytest.importorskip("pyogrio")
    network.save(tmp_path / "out.gpkg")
    assert [name for name, _ in pyogrio.list_layers(tmp_path / "out.gpkg")] == [
        "rails",
        "centerlines",
        "quality",
        "findings",
    ]
    for name, fields in (("rails", RAIL_FIELDS), ("centerlines", CENTERLINE_FIELDS), ("quality", QUALITY_FIELDS)):
        info = pyogrio.read_info(tmp_path / "out.gpkg", layer=name)
        assert list(info["fields"]) == [field.name for field in fields]
    assert pyogrio.read_info(tmp_path / "out.gpkg", layer="rails")["features"] == len(network.found.rails)


def test_a_table_has_fields_geometry_and_coordinate_system(network):
    pytest.importorskip("geopandas")
    table = network.to_geodataframe("rails")
    assert list(table.columns) == [*(field.name for field in RAIL_FIELDS), "geometry"]
    assert table["rail_id"].tolist() == [rail.rail_id for rail in network.found.rails]
    assert table["length_m"].tolist() == pytest.approx([rail.length_m for rail in network.found.rails], abs=0.001)
    assert table.crs.to_epsg() == 32643
    place = table.geometry[0].coords[0]
    np.testing.assert_allclose(place, network.frame.to_crs(network.found.rails[0].xyz[:1])[0], atol=1e-6)


@pytest.mark.parametrize(
    ("call", "said"),
    [
        (lambda network: network.save("out.shp"), "out.shp can't be written: let the name end in .gpkg or .dxf"),
        (lambda network: rx.extract(SAMPLE, standard="UIC60"), "standard can't be UIC60: give one of its 48 choices"),
    ],
)
def test_a_wrong_argument_is_refused_with_a_remedy(network, call, said):
    with pytest.raises(ParameterError) as refused:
        call(network)
    assert said in str(refused.value)
