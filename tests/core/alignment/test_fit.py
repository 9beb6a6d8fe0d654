"""The fit of alignments to tracks that were made from random designs."""

from dataclasses import replace

import numpy as np
import pytest
from rail_extract.core.alignment.elements import Alignment, CantElement, VerticalElement, chained
from rail_extract.core.alignment.fit import fit_track, fit_tracks
from rail_extract.core.alignment.layouts import noted, round_radius
from rail_extract.core.alignment.measured import Track
from rail_extract.core.errors import ParameterError
from rail_extract.core.fields import ELEMENT_FIELDS
from rail_extract.core.files.table import alignments, rows
from rail_extract.core.frame import LocalFrame
from rail_extract.core.parameters import FitParameters
from rail_extract.core.progress import Progress, Recording
from rail_extract.laboratory.designs import FAMILIES, random_design, surveyed

FRAME = LocalFrame(np.zeros(3))
NONE = np.zeros((0, 2))
SHAPES = [(120.0, 0, 0), (60.0, 0, 1 / 400), (150.0, 1 / 400, 1 / 400), (50.0, 1 / 400, 0), (140.0, 0, 0)]


def design(shapes=SHAPES):
    vertical = (VerticalElement(0, 200, 50, 0.01, 0.01), VerticalElement(200, 80, 52, 0.01, -0.01))
    vertical = (*vertical, VerticalElement(280, 240, 52, -0.01, -0.01))
    cant = (CantElement(0, 120, 0, 0), CantElement(120, 60, 0, -0.08), CantElement(180, 150, -0.08, -0.08))
    cant = (*cant, CantElement(330, 50, -0.08, 0), CantElement(380, 140, 0, 0))
    return Alignment(1, FRAME, chained((100.0, 200.0), 0.3, shapes), vertical, cant)


def track(one, seed=0, cant=False, **noise):
    random = np.random.default_rng(seed)
    line = surveyed(one, random, **noise)
    s = np.arange(len(line), dtype=float)
    measured = np.column_stack([s, one.cants(s) + 0.0004 * random.standard_normal(len(s))]) if cant else NONE
    return Track(1, line, measured, np.zeros(len(line), dtype=bool))


def fit(measured, fixed=None, progress=None, **settings):
    return fit_track(measured, FRAME, FitParameters(**settings), fixed, progress or Progress())


def test_the_reversed_track_gives_the_mirrored_elements():
    ahead = track(design(), seed=3)
    back = replace(ahead, xyz=ahead.xyz[::-1])
    one, other = fit(ahead).alignment, fit(back).alignment
    length = one.s_to
    np.testing.assert_allclose([x.s_from for x in one.plan], [length - x.s_to for x in other.plan[::-1]], atol=0.02)
    np.testing.assert_allclose([x.k_from for x in one.plan], [-x.k_to for x in other.plan[::-1]], atol=2e-7)


@pytest.mark.parametrize("seed", range(3))
def test_cant_that_waves_by_less_than_a_survey_shows_has_the_elements_of_its_clothoids(seed):
    one, s = design(), np.arange(521.0)
    phase = np.random.default_rng(seed).uniform(0, 2 * np.pi, 2)
    waves = 0.0004 * np.sin(s / 12 + phase[0]) + 0.0003 * np.sin(s / 5 + phase[1])
    cant, line = np.column_stack([s, one.cants(s) + waves]), surveyed(one, np.random.default_rng(seed), 0.0005)
    found = fit(Track(1, line, cant, np.zeros(len(s), dtype=bool))).alignment
    np.testing.assert_allclose([part.s_from for part in found.cant], [0, 120, 180, 330, 380], atol=0.5)
    np.testing.assert_allclose([part.cant_from_m for part in found.cant], [0, 0, -0.08, -0.08, 0], atol=0.0006)


@pytest.mark.parametrize("seed", [1, 2])
def test_short_waves_of_a_smoothed_line_are_not_taken_for_elements(seed):
    smooth = surveyed(design(), np.random.default_rng(seed), 0.00003, 0.0004, 6.0)[::3]
    found = fit(Track(1, smooth, NONE, np.zeros(len(smooth), dtype=bool))).alignment
    assert len(found.plan) == len(SHAPES)
    assert len(found.vertical) == 3


def test_a_straight_stays_one_element():
    straight = Alignment(1, FRAME, chained((0.0, 0.0), 1.0, [(400.0, 0, 0)]), (VerticalElement(0, 400, 0, 0, 0),))
    counts = [len(fit(track(straight, seed, white_m=0.004)).alignment.plan) for seed in range(10)]
    assert sum(count == 1 for count in counts) >= 9


@pytest.mark.parametrize("step", [5, 25])
def test_a_line_with_few_vertices_gives_a_curve_that_follows_it(step):
    whole = design()
    s = np.append(np.arange(0.0, 520.0, step), 520.0)
    found = fit(Track(1, whole.xyz(s), NONE, np.zeros(len(s), dtype=bool))).alignment
    off = found.foot(whole.places(np.arange(2.0, 518.0))).across_m
    assert np.abs(off).max() < 0.002 * step


def test_turnouts_have_jumps_unless_clothoids_are_required():
    siding = design([(80.0, 0, 0), (60.0, 1 / 300, 1 / 300), (80.0, 0, 0), (60.0, -1 / 300, -1 / 300), (80.0, 0, 0)])
    found = fit(track(siding)).alignment
    assert [(one.type, one.figures.joint) for one in found.plan] == [
        ("line", None), ("arc", "G1"), ("line", "G1"), ("arc", "G1"), ("line", "G1")
    ]  # fmt: skip
    smooth = fit(track(siding), transitions="CLOTHOIDS").alignment
    assert {one.figures.joint for one in smooth.plan[1:]} == {"G2"}


def test_round_radii_are_proposed_within_the_standard_error():
    found = fit(track(design(), seed=2)).alignment
    arc = found.plan[2]
    assert arc.figures.r_round_m == 400
    assert arc.figures.dev_rms_round_mm == pytest.approx(arc.figures.dev_rms_mm, abs=0.2)
    assert fit(track(design(), seed=2), rounded=False).alignment.plan[2].figures.r_round_m is None
    loose = replace(arc, k_from=-1 / 1004.0, k_to=-1 / 1004.0, figures=replace(arc.figures, sigma_r_m=3.0))
    assert round_radius(loose, 2.0) == -1000


def corrected(found, change):
    """The table of a fit after a person has edited it."""
    table = rows(found.alignment)
    change(table)
    return alignments([row for row in table if row["layout"]], FRAME)[0]


def test_edited_radii_and_starts_in_height_and_of_ramps_are_held():
    measured = track(design(), seed=2, cant=True)
    found = fit(measured)
    free = found.alignment
    parabola, ramp = (
        next(at for at, one in enumerate(free.elements) if one.type == kind) for kind in ("parabola", "ramp")
    )

    def edit(table):
        table[parabola].update(r1_m=-3950.0, s_from=200.5)
        table[ramp].update(s_from=119.0)

    held = fit(measured, corrected(found, edit)).alignment
    assert [one.type for one in held.elements] == [one.type for one in free.elements]
    assert 1 / held.elements[parabola].curvature == pytest.approx(-3950.0, rel=1e-6)
    assert held.elements[parabola].s_from == pytest.approx(200.5, abs=1e-6)
    assert held.elements[parabola].figures.sigma_r_m == held.elements[parabola].figures.sigma_s_m == 0.0
    assert held.elements[ramp].s_from == pytest.approx(119.0, abs=1e-6)
    assert held.elements[parabola + 1].s_from == pytest.approx(free.elements[parabola + 1].s_from, abs=3.0)
    s = np.arange(10.0, 510.0)
    np.testing.assert_allclose(held.heights(s), free.heights(s), atol=0.005)
    np.testing.assert_allclose(held.cants(s), free.cants(s), atol=0.003)


@pytest.mark.parametrize(("family", "seed"), [("branch line", 5), ("main line", 24)])
def test_a_table_without_changes_gives_back_its_alignment(family, seed):
    random = np.random.default_rng([77, seed])
    one = random_design(random, FAMILIES[family], 14)
    line = surveyed(one, random, 0.001, 0.003, 15.0)
    measured = replace(track(one, cant=True), xyz=line)
    free = fit(measured).alignment
    table = [{field.name: field.value(row[field.name]) for field in ELEMENT_FIELDS} for row in rows(free)]
    again = fit(measured, alignments(table, FRAME)[0]).alignment
    assert [x.type for x in again.elements] == [x.type for x in free.elements]
    s = np.arange(free.s_from, free.s_to)
    np.testing.assert_allclose(again.places(s), free.places(s), atol=0.001)
    np.testing.assert_allclose(again.heights(s), free.heights(s), atol=0.001)
    np.testing.assert_allclose(again.cants(s), free.cants(s), atol=0.0005)
    for x, y in zip((*free.plan, *free.vertical), (*again.plan, *again.vertical)):
        assert y.s_from == pytest.approx(x.s_from, abs=0.01)


def test_the_table_of_a_part_is_that_of_the_part():
    measured = with_errors(0, 50, 0.08)
    free = fit(measured).alignment
    again = fit(measured, alignments(rows(free), FRAME)[0]).alignment
    assert free.s_from > 45
    assert [x.type for x in again.elements] == [x.type for x in free.elements]
    np.testing.assert_allclose([x.s_from for x in again.plan], [x.s_from for x in free.plan], atol=0.005)


def test_two_elements_with_one_start_are_refused():
    found = fit(track(design(), seed=2))

    def edit(table):
        table[2].update(s_from=table[1]["s_from"])

    with pytest.raises(ParameterError, match="element 3 in layout H of track 1 does not start after the one before"):
        fit(track(design(), seed=2), corrected(found, edit))


def test_arcs_near_the_noise_are_said():
    shapes = [(60.0, 0, 0), *((60.0, sign / 2e5, sign / 2e5) for sign in (1, -1, 1, -1)), (60.0, 0, 0)]
    progress, measured = Recording(Progress()), track(design(shapes), white_m=0.003)
    types = replace(design(shapes), plan=tuple(map(noted, design(shapes).plan)))
    fit(measured, types, progress)
    assert any("of 4 arcs of track 1 are near the noise" in warning for warning in progress.warnings)
    progress = Recording(Progress())
    fit(track(design(), seed=2), None, progress)
    assert not progress.warnings


def test_an_arc_may_turn_round():
    spiral = design([(80.0, 0, 0), (60.0, 0, 1 / 150), (800.0, 1 / 150, 1 / 150), (60.0, 1 / 150, 0), (80.0, 0, 0)])
    spiral = replace(spiral, vertical=(VerticalElement(0, 1080, 50, 0.01, 0.01),))
    found = fit(track(spiral)).alignment
    assert [one.type for one in found.plan] == ["line", "clothoid", "arc", "clothoid", "line"]
    assert found.plan[2].k_from == pytest.approx(1 / 150, rel=1e-4)


def test_an_element_that_was_removed_stays_away():
    shapes = [(120.0, 0, 0), (15.0, 0, 1 / 400), (150.0, 1 / 400, 1 / 400), (50.0, 1 / 400, 0), (140.0, 0, 0)]
    measured = track(design(shapes), white_m=0.0005)
    free = fit(measured)
    assert free.alignment.plan[1].type == "clothoid"
    held = fit(measured, corrected(free, lambda table: table.pop(1)))
    assert [one.type for one in held.alignment.plan] == ["line", "arc", "clothoid", "line"]


def with_errors(first, last, size_m):
    """A track whose vertices lie off by random amounts between two metres."""
    line = track(design(), seed=2).xyz
    line[first:last, 1] += size_m * np.random.default_rng(4).standard_normal(last - first)
    return Track(1, line, NONE, np.zeros(len(line), dtype=bool))


def test_a_bad_start_does_not_bend_the_elements():
    progress = Recording(Progress())
    found = fit(with_errors(0, 50, 0.08), progress=progress)
    assert "only the elements from 51 to 520 m are given" in progress.warnings[1]
    assert [one.type for one in found.alignment.plan] == ["line", "clothoid", "arc", "clothoid", "line"]
    assert 45 < found.alignment.s_from < 60
    np.testing.assert_allclose(np.diff([one.s_from for one in found.alignment.plan[1:]]), [60, 150, 50], atol=1.0)
    np.testing.assert_allclose(
        [one.figures.s_fit_m for one in found.alignment.plan], [one.s_from for one in found.alignment.plan]
    )
    assert found.deviations.s[0] == np.ceil(found.alignment.s_from)


def test_a_track_that_cannot_be_fitted_does_not_stop_the_others():
    progress = Recording(Progress())
    whole = track(design())
    short = replace(whole, xyz=whole.xyz[:30], track_id=7)
    fits = fit_tracks([short, whole], FRAME, FitParameters(), {}, progress)
    assert [one.alignment.track_id for one in fits] == [1]
    assert "track 7" in progress.warnings[0]


def test_a_table_of_other_tracks_is_refused():
    with pytest.raises(ParameterError, match="FIXED has no elements"):
        fit_tracks([track(design())], FRAME, FitParameters(), {9: design()})
