"""The steps of an extraction in QGIS; `tests/core/jobs/test_steps.py` chains them."""

import pytest


@pytest.fixture
def cloud(write_cloud, track):
    return write_cloud(track())


@pytest.fixture
def raster(run_step, cloud, tmp_path):
    """The raster of a short track with dense points, which can be vectorized without the network."""
    outcome = run_step("rasterizerailpoints", {"INPUT": cloud, "OUTPUT": tmp_path / "raster.tif"})
    assert outcome.ok, outcome.error
    return tmp_path / "raster.tif"


def test_vectorize_without_points_gives_flat_lines_with_a_warning(run_step, raster, context, new_feedback):
    feedback = new_feedback()
    outcome = run_step("vectorizerails", {"INPUT": raster, "OUTPUT": "memory:rails"}, feedback)
    assert outcome.ok, outcome.error
    assert "no heights" in feedback.warnings[0]
    rails = list(context.getMapLayer(outcome.results["OUTPUT"]).getFeatures())
    assert outcome.results["RAIL_COUNT"] == len(rails) == 2
    assert outcome.results["RAIL_LENGTH"] == pytest.approx(24, abs=0.5)
    assert not any(rail.geometry().constGet().is3D() for rail in rails)
    sides = sorted(rail.geometry().centroid().asPoint().y() - 3_000_000 for rail in rails)
    assert sides == pytest.approx([-0.7535, 0.7535], abs=0.02)


@pytest.mark.parametrize("name", ["rasterizerailpoints", "frpdfcleanup", "vectorizerails"])
def test_cancelled_step_writes_nothing(run_step, raster, cloud, tmp_path, new_feedback, name):
    output = tmp_path / ("o.gpkg" if name == "vectorizerails" else "o.tif")
    source = {"INPUT": cloud} if name == "rasterizerailpoints" else {"INPUT": raster, "POINTS": cloud}
    outcome = run_step(name, {**source, "OUTPUT": output}, new_feedback(cancel_at=1))
    assert outcome.error == "Cancelled; nothing was written."
    assert not output.exists()
