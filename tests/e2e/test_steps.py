"""The steps and the model through qgis_process, on a short part of the sample."""

import pytest
from lines import farthest, read_lines

STANDARD = "IN_75R_1000"
CUT = "578214,578222,2494300,2494345"
"""Eight metres of three tracks, which the network processes quickly."""


@pytest.fixture(scope="module")
def source(sample):
    return {"INPUT": sample / "sample.laz", "STANDARD": STANDARD, "EXTENT": CUT}


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("Größe östlich 2")


@pytest.fixture(scope="module")
def whole(succeed, source, folder):
    """Lines of Extract Rails: rails, centerlines."""
    outputs = {"RAILS": folder / "rails.gpkg", "CENTERLINES": folder / "tracks.gpkg"}
    succeed("extractrails", {**source, "ITERATIONS": 1, **outputs})
    return [read_lines(path) for path in outputs.values()]


def test_the_model_gives_the_lines_of_extract_rails(succeed, source, folder, whole, request):
    outputs = {"rails:RAILS": folder / "mr.gpkg", "centerlines:CENTERLINES": folder / "mt.gpkg"}
    model = request.config.rootpath / "models" / "extract_rails.model3"
    written = succeed(model, {**source, "ITERATIONS": 1, **outputs})
    # Newer QGIS also lists skipped outputs.
    assert {one: path for one, path in written.items() if path} == {one: str(path) for one, path in outputs.items()}
    for path, lines in zip(outputs.values(), whole):
        assert farthest(read_lines(path), lines) < 0.001
