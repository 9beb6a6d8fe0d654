"""The steps and the model through qgis_process, on a short part of the sample."""

import json
from importlib.util import find_spec

import pytest
from lines import farthest, read_features, read_lines

STANDARD = "IN_75R_1000"
CUT = "578214,578222,2494300,2494345"
"""Eight metres of three tracks, which the network processes quickly."""


@pytest.fixture(scope="module")
def succeed(qgis_process):
    """Run an algorithm or a model, and return its results by name."""

    def run(algorithm, parameters):
        done = qgis_process(parameters, "--json", algorithm=algorithm)
        assert done.returncode == 0, done.stdout + done.stderr
        return json.loads(done.stdout[done.stdout.index("{") :])["results"]

    return run


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
    succeed("railextract:extractrails", {**source, "ITERATIONS": 1, **outputs})
    return [read_lines(path) for path in outputs.values()]


def total_length(path):
    return sum(items["length_m"] for _, items in read_features(path))


def test_chained_steps_give_the_lines_of_extract_rails(succeed, source, folder, whole):
    raster, cleaned, rails, tracks = (folder / name for name in ("räster 1.tif", "cleaned.tif", "r.gpkg", "t.shp"))
    succeed("railextract:rasterizerailpoints", {**source, "OUTPUT": raster})
    found = succeed("railextract:frpdfcleanup", {"INPUT": raster, "ITERATIONS": 1, "OUTPUT": cleaned})
    assert found["ENGINE_USED"].startswith("PyTorch" if find_spec("torch") else "OpenCV")
    found = succeed("railextract:vectorizerails", {"INPUT": cleaned, "POINTS": source["INPUT"], "OUTPUT": rails})
    assert found["RAIL_COUNT"] == len(whole[0])
    assert found["RAIL_LENGTH"] == pytest.approx(total_length(rails), abs=0.01)
    found = succeed("railextract:buildtrackcenterlines", {"INPUT": rails, "STANDARD": STANDARD, "OUTPUT": tracks})
    assert found["CENTERLINE_COUNT"] == len(whole[1])
    assert found["CENTERLINE_LENGTH"] == pytest.approx(total_length(tracks), abs=0.01)
    assert farthest(read_lines(rails), whole[0]) < 0.001
    assert farthest(read_lines(tracks), whole[1]) < 0.001


def test_the_model_gives_the_lines_of_extract_rails(succeed, source, folder, whole, request):
    outputs = {"rails:RAILS": folder / "mr.gpkg", "centerlines:CENTERLINES": folder / "mt.gpkg"}
    model = request.config.rootpath / "models" / "extract_rails.model3"
    written = succeed(model, {**source, "ITERATIONS": 1, **outputs})
    # Newer QGIS also lists skipped outputs.
    assert {one: path for one, path in written.items() if path} == {one: str(path) for one, path in outputs.items()}
    for path, lines in zip(outputs.values(), whole):
        assert farthest(read_lines(path), lines) < 0.001


@pytest.mark.parametrize(
    ("algorithm", "parameters", "sentence"),
    [
        ("rasterizerailpoints", {"INPUT": "gone.laz"}, "gone.laz does not exist"),
        ("frpdfcleanup", {"INPUT": "gone.tif"}, "gone.tif"),
        ("vectorizerails", {"INPUT": "gone.tif"}, "gone.tif"),
        ("buildtrackcenterlines", {"INPUT": "gone.gpkg"}, "gone.gpkg"),
        ("measuretrackgeometry", {"INPUT": "gone.gpkg"}, "gone.gpkg"),
    ],
)
def test_bad_input_is_one_sentence_and_an_exit_code(qgis_process, tmp_path, algorithm, parameters, sentence):
    output = tmp_path / ("o.tif" if algorithm in ("rasterizerailpoints", "frpdfcleanup") else "o.gpkg")
    run = qgis_process({**parameters, "OUTPUT": output}, algorithm=f"railextract:{algorithm}")
    assert run.returncode == 1
    assert sentence in run.stdout + run.stderr
    assert "Traceback" not in run.stdout + run.stderr
    assert not list(tmp_path.iterdir())
