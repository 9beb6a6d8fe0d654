from dataclasses import replace

import numpy as np
import pytest
from built import rails_of
from rail_extract.core.errors import NoTrackError
from rail_extract.core.parameters import Parameters
from rail_extract.core.tracks.centerlines import (
    build_centerlines,
)
from rail_extract.laboratory.curves import Element, trace, transition_curve
from rail_extract.laboratory.ruler.lines import compare_lines
from rail_extract.laboratory.scenes.tracks import Track

GAUGE, WIDTH = 1.435, 0.072
STANDARD = Parameters(GAUGE, WIDTH)
SPACING = GAUGE + WIDTH
STRAIGHT = trace([Element(60.0)], heading=0.7)
CURVED = trace(transition_curve(30, 40, 60, 1 / 300), heading=-0.6)


def track(curve, left_m=0.0, spacing=SPACING, height=0.0, cant=0.0):
    """Left rail, right rail and centerline."""
    laid = Track(curve, spacing, height, cant, left_m)
    return (*laid.rails(), laid.thinned(laid.centerline))


def without(line, start, end):
    """The parts of a line before and after a gap, given as shares of its vertices."""
    count = len(line)
    return line[: int(start * count)], line[int(end * count) :]


@pytest.mark.parametrize("radius", [25.0, 200.0, 1500.0])
@pytest.mark.parametrize("turned", [False, True])
def test_centerline_of_concentric_arcs_is_the_arc_between(radius, turned):
    angle = np.linspace(0, min(30 / radius, 2.5), 800)
    arcs = [
        (ring * np.column_stack([np.cos(angle), np.sin(angle)])) for ring in radius + SPACING * np.array([0.5, -0.5])
    ]
    (line,) = build_centerlines(rails_of(arcs[0], arcs[1][::-1] if turned else arcs[1]), STANDARD)
    tolerance = 1e-4 if radius > 100 else 4e-4  # in the tightest curve the chords between stations show
    np.testing.assert_allclose(np.hypot(*line.xyz[:, :2].T), radius, atol=tolerance)
    assert line.gauge_mm == pytest.approx(1435.0, abs=0.2)
    assert line.gaugesd_mm < 0.2


@pytest.mark.parametrize("turned", [False, True])
@pytest.mark.parametrize("begins", [0.0, 0.03, 0.05, 2.0, 6.2])
def test_a_ring_becomes_one_closed_centerline(begins, turned):
    """Wherever its two rails start, and in whichever direction they run."""
    angle = np.linspace(0, 2 * np.pi, 1500)
    outer, inner = (
        (radius * np.column_stack([np.cos(angle + start), np.sin(angle + start)]))
        for radius, start in ((30 + 0.5 * SPACING, 1.0), (30 - 0.5 * SPACING, 1.0 + begins))
    )
    outer[-1], inner[-1] = outer[0], inner[0]
    (line,) = build_centerlines(rails_of(outer, inner[::-1] if turned else inner), STANDARD)
    np.testing.assert_array_equal(line.xyz[0], line.xyz[-1])
    np.testing.assert_allclose(np.hypot(*line.xyz[:, :2].T), 30, atol=3e-4)
    assert line.length_m == pytest.approx(60 * np.pi, rel=1e-4)
    assert line.bridged_m < 0.1


@pytest.mark.parametrize("sign", [1, -1])
@pytest.mark.parametrize("heading", [0.5, 0.5 + np.pi])
def test_cant_is_left_minus_right_along_the_line(sign, heading):
    """Rails and curve may run in either direction: only that of the line counts, which starts in the west."""
    curve = trace([Element(50.0)], heading=heading)
    left, right, _ = track(curve, cant=sign * 0.1, height=0.002 * curve.chainage)
    (line,) = build_centerlines(rails_of(left, right[::-1]), STANDARD)
    seen = sign if np.cos(heading) > 0 else -sign
    assert line.xyz[0, 0] < line.xyz[-1, 0]
    assert line.cant_mm == pytest.approx(100 * seen, abs=0.1)
    assert line.cantmax_mm == pytest.approx(100 * seen, abs=0.1)
    assert line.gauge_mm == pytest.approx(1435.0, abs=0.1)
    assert (line.left_ids, line.right_ids) == (((1,), (2,)) if np.cos(heading) > 0 else ((2,), (1,)))
    along = np.linalg.norm(line.xyz[:, :2] - curve.xy[0], axis=1)
    np.testing.assert_allclose(line.xyz[:, 2], 0.002 * along, atol=0.002)


@pytest.mark.parametrize(("gap", "count"), [(4.0, 1), (8.0, 2)])
def test_gaps_in_both_rails_are_bridged_up_to_the_maximum(gap, count):
    share = gap / CURVED.length_m
    left, right, middle = track(CURVED)
    parts = [*without(left, 0.5, 0.5 + share), *without(right, 0.5, 0.5 + share)]
    found = build_centerlines(rails_of(*parts), STANDARD)
    assert len(found) == count
    assert compare_lines([line.xyz for line in found], [middle]).lateral_p95_m < 0.012


@pytest.mark.parametrize("cant", [0.0, 0.1])
@pytest.mark.parametrize("side", [0, 1])
def test_where_one_rail_is_missing_the_other_gives_the_height(cant, side):
    """Beyond the end of the rail on a gradient, and in a gap of the rail in a sag."""
    x = STRAIGHT.chainage
    for height, cut in ((0.04 * x, slice(0, -60)), (x**2 / 4000, slice(0, None))):
        left, right, middle = track(STRAIGHT, height=height, cant=cant)
        rails = [left, right]
        rails[side] = rails[side][cut]
        if cut.stop is None:
            rails[side : side + 1] = without(rails[side], 0.3, 0.7)
        (line,) = build_centerlines(rails_of(*rails), STANDARD)
        t = np.hypot(*(line.xyz[:, :2] - middle[0, :2]).T)
        expected = np.interp(t, np.hypot(*(middle[:, :2] - middle[0, :2]).T), middle[:, 2])
        np.testing.assert_allclose(line.xyz[:, 2], expected, atol=0.002)


def test_gaps_of_rails_count_for_the_track():
    left, right, _ = track(STRAIGHT)
    (left_rail, right_rail) = rails_of(left, right)
    left_rail = replace(left_rail, gaps=np.array([[10.0, 13.0], [30.0, 31.0]]), bridged_m=4.0)
    right_rail = replace(right_rail, gaps=np.array([[12.0, 15.0]]), bridged_m=3.0)
    # The gaps of both rails overlap by one metre, which counts once. Reversing a rail does not change its gaps.
    for rails in ([left_rail, right_rail], [left_rail.reversed(), right_rail], [left_rail, right_rail.reversed()]):
        (line,) = build_centerlines(rails, STANDARD)
        assert line.bridged_m == pytest.approx(6.0, abs=0.01)


@pytest.mark.parametrize("bridged_m", [3.0, np.nan])
def test_the_bridged_length_of_a_track_is_unknown_if_the_gaps_of_a_rail_are(bridged_m):
    """Lines drawn by hand, or from a file that has lost the sections."""
    left, right = rails_of(*track(STRAIGHT)[:2])
    (line,) = build_centerlines([left, replace(right, bridged_m=bridged_m)], STANDARD)
    assert np.isnan(line.bridged_m)


@pytest.mark.parametrize(
    ("gauge", "width", "question"),
    [(1.52, 0.072, ", is the gauge 1520 mm?"), (1.0, 0.072, ", is the gauge 1000 mm?"), (1.25, 0.072, ".")],
)
def test_another_gauge_is_refused_with_the_spacing_measured(gauge, width, question):
    left, right, _ = track(CURVED, spacing=gauge + width)
    with pytest.raises(NoTrackError) as refusal:
        build_centerlines(rails_of(left, right), STANDARD)
    apart = round(1000 * (gauge + width))
    assert str(refusal.value) == f"No track of 1435 mm gauge found: rails are {apart} mm apart{question}"


@pytest.mark.parametrize("curve", [STRAIGHT, CURVED])
@pytest.mark.parametrize("off", [-0.35, -0.24, 0.24, 0.45])
def test_rails_off_the_gauge_within_the_tolerance_make_a_track(curve, off):
    left, right, middle = track(curve, spacing=SPACING + off)
    (line,) = build_centerlines(rails_of(left, right), replace(STANDARD, centerline_tolerance_m=0.5))
    assert line.gauge_mm == pytest.approx(1000 * (GAUGE + off), abs=0.5)
    assert compare_lines([line.xyz], [middle]).lateral_rmse_m < 0.001


@pytest.mark.parametrize("sign", [1, -1])
def test_cant_keeps_its_sign_on_a_centerline_that_is_turned_around(sign):
    """The longer section of a horseshoe leads its chain, which therefore starts at the eastern one of the two ends."""
    curve = trace([Element(60.0), Element(30 * np.pi, 1 / 30, 1 / 30), Element(50.0)])
    left, right, _ = track(curve, cant=sign * np.linspace(0.02, 0.08, len(curve.xy)))
    parts = [part for line in (left, right) for part in without(line, 0.12, 0.12)]
    (line,) = build_centerlines(rails_of(*parts), STANDARD)
    np.testing.assert_allclose(line.xyz[[0, -1], :2], curve.xy[[0, -1]], atol=0.05)
    assert line.xyz[0, 0] < line.xyz[-1, 0]
    assert line.cantmax_mm == pytest.approx(sign * 80, abs=0.5)
    assert line.cant_mm == pytest.approx(sign * 50, abs=0.5)
    assert (line.left_ids, line.right_ids) == ((1, 2), (3, 4))
