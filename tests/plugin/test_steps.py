"""The four steps, alone and chained by hand."""

import numpy as np
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


def offsets(line, other):
    """Distances of the vertices of a line from another line, (n, 2): in plan and in height."""
    start, step = other[:-1], np.diff(other, axis=0)
    share = np.einsum("nij,ij->ni", (line[:, None] - start)[..., :2], step[:, :2]) / (step[:, :2] ** 2).sum(axis=1)
    away = line[:, None] - start - np.clip(share, 0, 1)[..., None] * step
    beside = np.hypot(away[..., 0], away[..., 1])
    nearest = beside.argmin(axis=1)
    number = np.arange(len(line))
    return np.column_stack([beside[number, nearest], np.abs(away[number, nearest, 2])])


def test_chained_by_hand_the_steps_give_the_lines_of_extract_rails(chain, run, cloud, tmp_path):
    whole = {"RAILS": tmp_path / "rails.gpkg", "CENTERLINES": tmp_path / "tracks.gpkg"}
    assert run({"INPUT": cloud, "ITERATIONS": 1, **whole}).ok
    _, _, rails, tracks = chain(cloud)
    for mine, theirs in ((rails, whole["RAILS"]), (tracks, whole["CENTERLINES"])):
        assert len(read_lines(mine)) == len(read_lines(theirs)) > 0
        for line, other in zip(read_lines(mine), read_lines(theirs)):
            assert max(offsets(line, other).max(), offsets(other, line).max()) < 0.001
    for mine, theirs in zip(read_features(rails), read_features(whole["RAILS"])):
        assert mine[1] == pytest.approx(theirs[1], rel=1e-6)
