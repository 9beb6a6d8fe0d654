"""What counts in worlds: right lines pass, and each kind of wrong line fails, silently or with a word."""

from dataclasses import replace

import numpy as np
import pytest
from built import geometry_of
from rail_extract.core.comparison import cut
from rail_extract.core.frame import LocalFrame
from rail_extract.core.polyline import length_along
from rail_extract.core.rails import Centerline, RailLine, RailNetwork, Support
from rail_extract.laboratory.ruler.rates import bounds, mcnemar, summary
from rail_extract.laboratory.ruler.worlds import ACROSS, FALSE, FEWER, HEIGHT, MISSING, MORE, judge, to_be_found
from rail_extract.laboratory.worlds.world import make

SEED = 6
"""A plain track on which everything is to be found."""


@pytest.fixture(scope="module")
def world():
    return make(SEED)


def network_of(world, lines, sigma_m=0.001):
    """Make a result whose lines are given, all in one good track."""
    rails = []
    for number, line in enumerate(lines, start=1):
        t = np.linspace(0, np.hypot(*np.diff(line[:, :2], axis=0).T).sum(), 50)
        support = Support.of_one_strip(t, np.full(50, 100), np.full(50, sigma_m), sigma_m)
        rails.append(RailLine(line, number, 10, 5000, 1.0, 1000 * sigma_m, 0.0, support=support))
    middle = 0.5 * (world.scene.rails[0] + world.scene.rails[1])
    ids = tuple(rail.rail_id for rail in rails)
    gauge = 1000 * world.scene.standard.gauge_m
    track = Centerline(middle, 1, 10, ids[:1], ids[1:2], gauge, 0.0, 0.0, 0.0, 0.0)
    errors = np.full(len(middle), 1000 * sigma_m)
    at = length_along(middle[:, :2])
    geometry = geometry_of(middle, at, gauge_mm=np.full(len(middle), gauge), sigma_mm=errors, sigmaz_mm=errors)
    return RailNetwork(tuple(rails), (track,), LocalFrame(np.zeros(3)), geometry=(geometry,))


def causes(world, lines, **more):
    return {fault.cause: fault.silent for fault in judge(world, network_of(world, lines, **more)).faults}


def moved(line, across_m=0.0, up_m=0.0, where=slice(None)):
    direction = np.gradient(line[:, :2], axis=0)
    direction /= np.linalg.norm(direction, axis=1, keepdims=True)
    off = np.zeros_like(line)
    off[where, 0], off[where, 1], off[where, 2] = (
        -across_m * direction[where, 1],
        across_m * direction[where, 0],
        up_m,
    )
    return line + off


def test_true_lines_do_not_fail(world):
    judged = judge(world, network_of(world, world.scene.rails))
    assert judged.faults == ()
    assert judged.figures["found %"] == 100
    assert judged.figures["to find m"] > 100
    assert judged.figures["expected"] == [2, 2]


def test_a_line_that_is_off_fails_silently_unless_its_standard_error_says_so(world):
    left, right = world.scene.rails
    off = [moved(left, 0.012), moved(right, 0.012)]
    assert causes(world, off) == {ACROSS: True}
    assert causes(world, off, sigma_m=0.0065) == {ACROSS: False}
    assert causes(world, [moved(left, 0.003), moved(right, -0.003)]) == {}
    assert causes(world, [moved(left, up_m=0.004), moved(right, up_m=0.004)]) == {HEIGHT: True}


def test_a_part_that_is_missing_fails(world):
    left, right = world.scene.rails
    assert causes(world, [left[: -len(left) // 4], right]) == {MISSING: True}
    assert causes(world, [left]) == {MISSING: True, FEWER: True}


def test_a_line_beside_the_rails_fails(world):
    left, right = world.scene.rails
    beside = moved(left, 0.7)
    assert causes(world, [left, right, beside]) == {FALSE: False, MORE: False}  # a lone rail is a finding
    assert causes(world, [left, right, beside[:30]])[MORE] is False


def test_a_line_in_two_pieces_is_one_too_many(world):
    left, right = world.scene.rails
    middle = len(left) // 2
    assert set(causes(world, [left[:middle], left[middle - 1 :], right])) == {MORE}


def test_what_the_cloud_does_not_show_need_not_be_found(world):
    scene = world.scene
    feet = np.linalg.norm(scene.xyz[:, None, :2] - scene.rails[0][len(scene.rails[0]) // 2, :2], axis=2)[:, 0]
    hidden = replace(world, scene=replace(scene, xyz=scene.xyz[feet > 10], kind=scene.kind[feet > 10]))
    left, right = scene.rails
    from_m = np.linalg.norm(left[:, :2] - left[len(left) // 2, :2], axis=1)
    ends = [left[from_m > 12][: (from_m > 12).argmin()], right]
    judged = judge(hidden, network_of(world, ends))
    assert judged.figures["to find m"] < judge(world, network_of(world, [left, right])).figures["to find m"] - 30
    assert 4 <= judged.figures["expected"][1] <= 8


def test_rates_have_bounds_and_pairs_a_test():
    assert bounds(0, 100)[0] == 0
    assert bounds(0, 100)[1] == pytest.approx(0.0362, abs=1e-4)
    assert bounds(100, 100)[1] == 1
    assert mcnemar([True, True, False], [False, True, True]) == (1, 1, 1.0)


def test_the_summary_lists_causes_with_their_seeds():
    lines = [
        {
            "seed": seed,
            "seconds": 9.0,
            "faults": [{"cause": MISSING, "silent": seed == 4}] if seed in (4, 7) else [],
            "world": {"survey": "mobile", "layout": "ladder" if seed < 5 else "plain"},
            "across mm": 1.0,
            "height mm": 0.5,
            "within": {"n m": 100.0, "across 1": 70.0, "across 2": 95.0, "height 1": 68.0, "height 2": 96.0},
        }
        for seed in range(1, 11)
    ]
    text = "\n".join(summary(lines))
    assert "fail:              2 of 10, 20.0 % (95 % bounds 2.5 to 55.6 %)" in text
    assert "fail silently:     1 of 10, 10.0 % (95 % bounds 0.3 to 44.5 %)" in text
    assert "rail not found" in text
    assert "4! 7" in text
    assert "70.0 % within the standard error" in text
    rows = [line.split()[:4] for line in text.splitlines()]
    assert ["ladder", "4", "1", "1"] in rows
    assert ["plain", "6", "1", "0"] in rows


@pytest.mark.parametrize(("kind", "expected"), [("mobile", True), ("drone", False)])
def test_rails_in_a_pavement_are_to_be_found_where_their_grooves_can_be_seen(world, kind, expected):
    paved = replace(world.surroundings, paved_m=(20.0, 30.0))
    pieces = cut(world.scene.shown)
    shown = to_be_found(replace(world, surroundings=paved, survey=replace(world.survey, kind=kind)), pieces)
    inside = (pieces.middle_t > 20.0) & (pieces.middle_t < 30.0)
    assert shown[inside].all() == shown[inside].any() == expected
    assert shown[(pieces.middle_t > 40.0) & (pieces.middle_t < 50.0)].all()
