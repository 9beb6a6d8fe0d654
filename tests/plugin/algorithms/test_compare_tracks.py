"""Lines of two surveys compared in QGIS, with the rails of both; `tests/core/test_comparison.py` has the measures."""

import numpy as np
import pytest
from memory_layers import layer_of

SPACING_M = 1.507


def layer(lines, fields, values):
    """Make a layer of lines, (n, 3) metres from a corner."""
    return layer_of(*(line + [500_000.0, 3_000_000.0, 100.0] for line in lines), fields=fields, values=values)


def arc(left_m=0.0, up_m=0.0):
    angle = np.arange(0, 100.25, 0.5) / 300
    r = 300.0 - left_m
    return np.column_stack([r * np.sin(angle), 300 - r * np.cos(angle), np.full(len(angle), up_m)])


def rails(left, right, sigma_mm):
    fields = "&field=rail_id:integer&field=sigma_mm:double&field=sigmaz_mm:double"
    return layer([left, right], fields, [(number, sigma_mm, sigma_mm) for number in (1, 2)])


def test_centerlines_with_their_rails(run_table):
    before, after = (layer([line], "&field=track_id:integer", [(1,)]) for line in (arc(), arc(0.002, 0.003)))
    half = SPACING_M / 2
    given = {"REFERENCE": before, "REFERENCE_RAILS": rails(arc(half), arc(-half), 1)}
    given |= {"INPUT": after, "RAILS": rails(arc(half + 0.004, 0.006), arc(-half), 2)}
    _, _, values, _ = run_table("comparetracks", **given)
    assert values["gauge_mm"] == pytest.approx([4.0] * len(values["gauge_mm"]), abs=0.1)
    assert values["cant_mm"] == pytest.approx([6.0] * len(values["gauge_mm"]), abs=0.1)
    assert values["sigma_mm"] == pytest.approx([np.hypot(1, 2) / np.sqrt(2)] * len(values["gauge_mm"]), abs=0.006)
