"""The four steps, alone and chained by hand."""

import pytest
from lines import read_features, read_lines


@pytest.fixture
def cloud(write_cloud, track):
    return write_cloud(track())


@pytest.fixture
def chain(run_step, tmp_path):
    """Run the steps one after the other, and give the paths of what they wrote."""

    def run(cloud, standard=None, folder=tmp_path):
        standard = standard or {}
        raster, cleaned, rails, tracks = (folder / f"{name}" for name in ("räster 1.tif", "c.tif", "r.gpkg", "t.gpkg"))
        for name, parameters in (
            ("rasterizerailpoints", {"INPUT": cloud, **standard, "OUTPUT": raster}),
            ("frpdfcleanup", {"INPUT": raster, "ITERATIONS": 1, "OUTPUT": cleaned}),
            ("vectorizerails", {"INPUT": cleaned, "POINTS": cloud, "OUTPUT": rails}),
            ("buildtrackcenterlines", {"INPUT": rails, **standard, "OUTPUT": tracks}),
        ):
            outcome = run_step(name, parameters)
            assert outcome.ok, outcome.error
        return raster, cleaned, rails, tracks

    return run


def test_chained_by_hand_the_steps_give_the_lines_of_extract_rails(chain, run, cloud, tmp_path, distance_of_lines):
    whole = {"RAILS": tmp_path / "rails.gpkg", "CENTERLINES": tmp_path / "tracks.gpkg"}
    assert run({"INPUT": cloud, "ITERATIONS": 1, **whole}).ok
    _, _, rails, tracks = chain(cloud)
    for mine, theirs in ((rails, whole["RAILS"]), (tracks, whole["CENTERLINES"])):
        assert distance_of_lines(read_lines(mine), read_lines(theirs)) < 0.001
    for mine, theirs in zip(read_features(rails), read_features(whole["RAILS"])):
        assert mine[1] == pytest.approx(theirs[1], rel=1e-6)
