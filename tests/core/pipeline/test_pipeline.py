"""The walk: several gauges in one run, lines with and without points, and squares compared with an undivided run."""

from contextlib import nullcontext
from dataclasses import dataclass, replace

import numpy as np
import pytest
from built import cloud_of, rails_of, source_of
from heard import Heard
from rail_extract.core.checks.warnings import warn_of_split_classes
from rail_extract.core.errors import Cancelled, ParameterError
from rail_extract.core.pipeline import Parameters, drawing, extract_files, extract_rails
from rail_extract.core.polyline import length_along, project
from rail_extract.core.rails import SearchFigures
from rail_extract.core.raster import cell_size, rasterize
from rail_extract.core.run.tasks import Runner
from rail_extract.core.squares import steps
from rail_extract.core.squares.steps import lines_of
from rail_extract.core.standards import STANDARDS, RailStandard
from rail_extract.core.tiles.grid import SortedPoints
from rail_extract.core.tracks.centerlines import tracks_of
from rail_extract.laboratory.curves import Element, trace, transition_curve
from rail_extract.laboratory.ruler.lines import match
from rail_extract.laboratory.scenes import strips
from rail_extract.laboratory.scenes.plain import straight
from rail_extract.laboratory.scenes.scanner import Scanner
from rail_extract.laboratory.scenes.scene import Plan, build
from rail_extract.laboratory.scenes.tracks import Track

WIDTH = 0.072
CURVES = [trace([Element(40.0)], heading=0.4), trace(transition_curve(15, 20, 15, 1 / 300), heading=-0.6)]


def rails_at(curve, *lefts):
    """Exact rails at distances to the left of a curve."""
    lines = [np.column_stack([curve.offset(left), np.full(len(curve.xy), 100.0)]) for left in lefts]
    return rails_of(*lines, points=100)


@pytest.mark.parametrize("curve", CURVES)
@pytest.mark.parametrize("narrow", [1.0, 1.067])
def test_the_shared_rail_of_a_three_rail_track_serves_both_gauges(curve, narrow):
    rails = rails_at(curve, 0.0, narrow + WIDTH, 1.435 + WIDTH)
    wide, small = tracks_of(rails, Parameters(1.435, WIDTH, other_gauges_m=(narrow,)))
    assert (wide.track_id, small.track_id) == (1, 2)
    assert {wide.left_ids + wide.right_ids, small.left_ids + small.right_ids} == {(3, 1), (2, 1)}
    assert wide.gauge_mm == pytest.approx(1435, abs=0.2)
    assert small.gauge_mm == pytest.approx(1000 * narrow, abs=0.2)
    assert wide.length_m == pytest.approx(small.length_m, rel=0.02)


def test_four_rails_of_two_gauges_on_one_axis_are_two_tracks():
    rails = rails_at(CURVES[0], *((side * (gauge + WIDTH) / 2) for gauge in (1.435, 1.0) for side in (-1, 1)))
    tracks = tracks_of(rails, Parameters(1.435, WIDTH, other_gauges_m=(1.0,)))
    assert [round(track.gauge_mm) for track in tracks] == [1435, 1000]
    assert [sorted(track.left_ids + track.right_ids) for track in tracks] == [[1, 2], [3, 4]]


@pytest.mark.parametrize("gauge", [1.000, 1.020, 1.030, 1.040, 1.050, 1.067])
def test_a_track_between_two_gauges_is_one_track(gauge):
    rails = rails_at(CURVES[1], 0.0, gauge + WIDTH)
    settings = [Parameters(one, WIDTH, other_gauges_m=(other,)) for one, other in ((1.0, 1.067), (1.067, 1.0))]
    first, second = (tracks_of(rails, one) for one in settings)
    assert len(first) == len(second) == 1
    assert first[0].gauge_mm == pytest.approx(1000 * gauge, abs=0.2)
    assert first[0].length_m == pytest.approx(second[0].length_m, abs=1e-6)


def test_a_class_without_track_is_a_warning_if_another_class_has_one():
    fits, other = rails_at(CURVES[0], 0.0, 1.435 + WIDTH), rails_at(CURVES[0], 5.0, 6.0 + WIDTH)
    other = [replace(rail, class_code=11) for rail in other]
    heard = Heard()
    (track,) = tracks_of([*other, *fits], Parameters(1.435, WIDTH), heard)
    assert (track.track_id, track.class_code) == (1, 10)
    (said,) = heard.warnings
    assert said.startswith("Class 11: No track of 1435 mm gauge found")


SPLIT = "Rails of the classes 10, 11 form tracks or continue each other"


def split_between_classes(by_rail):
    """A track whose rails, or halves of rails, have the classes 10 and 11."""
    whole = rails_at(CURVES[0], 0.0, 1.435 + WIDTH)
    if by_rail:
        return [replace(rail, class_code=code, rail_id=code) for rail, code in zip(whole, (10, 11))]
    middle = whole[0].length_m / 2
    parts = [(rail, *span) for rail in whole for span in ((0.0, middle - 0.1), (middle + 0.1, 2 * middle))]
    return [
        replace(rail.between(start, end), class_code=10 + (start > 0), rail_id=number, track_ids=(1 + (start > 0),))
        for number, (rail, start, end) in enumerate(parts)
    ]


@pytest.mark.parametrize("by_rail", [True, False])
def test_a_track_that_is_split_between_classes_is_a_warning(by_rail):
    heard = Heard()
    warn_of_split_classes(split_between_classes(by_rail), Parameters(1.435, WIDTH), heard)
    (said,) = heard.warnings
    assert said.startswith(SPLIT)
    assert said.endswith("set MERGE_CLASSES.")


def test_tracks_of_two_classes_are_not_a_warning():
    heard = Heard()
    rails = rails_at(CURVES[0], 0.0, 1.435 + WIDTH, 5.0, 5.0 + 1.435 + WIDTH)
    rails = [
        replace(rail, class_code=10 + number // 2, rail_id=number, track_ids=(1 + number // 2,))
        for number, rail in enumerate(rails)
    ]
    warn_of_split_classes(rails, Parameters(1.435, WIDTH), heard)
    assert heard.warnings == []


def test_lines_without_points_stay_in_their_cells_and_have_no_heights():
    along = np.arange(0, 20, 0.005)
    xyz = np.column_stack([along, 0.3 * along, np.full(len(along), 100.0)])
    raster = rasterize(xyz, cell_size(1.435, WIDTH))
    (flat,) = lines_of(raster, 11, None, Parameters(1.435, WIDTH), first_id=4)
    (high,) = lines_of(raster, 11, cloud_of(xyz, code=11), Parameters(1.435, WIDTH), first_id=4)
    assert (
        (flat.rail_id, flat.class_code, flat.points) == (4, 11, 0) == (high.rail_id, high.class_code, 0 * high.points)
    )
    assert np.isnan(flat.xyz[:, 2]).all()
    assert flat.length_m == pytest.approx(20 * np.hypot(1, 0.3), abs=0.1)
    assert np.abs(flat.xyz[:, 1] - 0.3 * flat.xyz[:, 0]).max() < raster.cell_m
    np.testing.assert_allclose(high.xyz[:, 2], 100, atol=1e-6)


def largest_step(xyz):
    """Return the largest distance of a vertex from the chord between its neighbours."""
    t = length_along(xyz[:, :2])
    share = ((t[1:-1] - t[:-2]) / (t[2:] - t[:-2]))[:, None]
    return np.abs(xyz[1:-1] - xyz[:-2] - share * (xyz[2:] - xyz[:-2])).max()


def test_a_line_in_squares_is_the_line_of_an_undivided_run(monkeypatch):
    # Clean points need no network; without it, the test sees only what the seams change.
    monkeypatch.setattr(steps, "clean", lambda raster, *_: raster)
    points = straight().rail_points()
    whole_settings = Parameters(
        1.435, STANDARDS["EN_60E1_1435"].head_width_m, keep_cleaned=True, quality_step_m=1.0, simplify_xy_m=0.0
    )
    whole = extract_rails([points], whole_settings)
    parts = extract_rails([points], replace(whole_settings, square_tiles=4))
    assert [rail.rail_id for rail in parts.rails] == [1, 2]
    for one, two in zip(whole.rails, parts.rails):
        across = project([one.xyz[:, :2]], two.xyz[:, :2], 0.01).across
        assert len(across) >= len(two.xyz) - 4
        assert np.abs(across).max() < 1.5e-3 and np.sqrt(np.mean(across**2)) < 3e-4
        assert largest_step(two.xyz) < largest_step(one.xyz) + 1e-4
        assert two.length_m == pytest.approx(one.length_m, abs=0.1)
        assert two.points == pytest.approx(one.points, rel=0.01)
        assert two.sigma_mm == pytest.approx(one.sigma_mm, rel=0.1)
        assert len(two.support.t) == pytest.approx(len(one.support.t), abs=5)
    assert parts.centerlines[0].length_m == pytest.approx(whole.centerlines[0].length_m, abs=0.1)
    assert parts.cleaned[0].count() == pytest.approx(whole.cleaned[0].count(), rel=0.02)
    one, two = whole.geometry[0], parts.geometry[0]
    count = min(len(one.chainage_m), len(two.chainage_m))
    np.testing.assert_allclose(two.gauge_mm[:count], one.gauge_mm[:count], atol=1.0)
    np.testing.assert_allclose(two.cant_mm[:count], one.cant_mm[:count], atol=0.5)


def test_the_minimum_length_is_that_of_whole_lines_not_of_their_parts_in_squares(monkeypatch):
    """Two lines of 120 m and 90 m that cross a border of squares, at x = 0, after 30 m."""
    monkeypatch.setattr(steps, "clean", lambda raster, *_: raster)
    lines = [np.arange(-30, end, 0.005) for end in (90, 60)]
    points = [np.column_stack([x, np.full(len(x), 5.0 + 4 * y), np.full(len(x), 100.0)]) for y, x in enumerate(lines)]
    cloud = cloud_of(*points)
    for shortest, lengths in ((1, [120, 90]), (60, [120, 90]), (100, [120]), (130, [])):
        settings = Parameters(1.435, WIDTH, min_length_m=shortest, square_tiles=4)
        found = _by_length(extract_rails([cloud], settings).rails)[::-1]
        assert [rail.length_m for rail in found] == pytest.approx(lengths, abs=0.2)


def test_the_width_of_heads_may_depend_on_the_gauge(monkeypatch):
    """A mixed line: 72 mm heads on 1435 mm, and 66 mm heads on 1000 mm beside them."""
    monkeypatch.setattr(steps, "clean", lambda raster, *_: raster)
    standards = STANDARDS["EN_60E1_1435"], RailStandard("CUSTOM", "", 1.0, 0.066)
    curve, clouds = trace([Element(25.0)], heading=0.4), []
    for standard, left_m in zip(standards, (0.0, 6.0)):
        spacing_m = standard.gauge_m + standard.head_width_m
        track = Track(curve, spacing_m, np.full(len(curve.xy), 100.0), left_m=left_m)
        plan = Plan([track], standard, Scanner(left_m=left_m))
        clouds.append(build("mixed", plan, np.random.RandomState(1)).rail_points().xyz)
    points = cloud_of(*clouds)
    settings = Parameters(1.435, WIDTH, quality_step_m=2.0, other_gauges_m=(1.0,))
    for heads_m, narrow_mm in (((), 994.0), ((0.066,), 1000.0)):
        found = extract_rails([points], replace(settings, other_heads_m=heads_m))
        assert [line.gauge_mm for line in found.centerlines] == pytest.approx([1435, narrow_mm], abs=1)
        assert [np.nanmean(one.gauge_mm) for one in found.geometry] == pytest.approx([1435, narrow_mm], abs=1)


def test_a_ring_stays_closed(monkeypatch):
    """In several squares, one of which sees all of it and the others a part."""
    monkeypatch.setattr(steps, "clean", lambda raster, *_: raster)
    standard, radius = STANDARDS["EN_49E1_1435"], 39.5
    curve = trace([Element(2 * np.pi * radius, 1 / radius, 1 / radius)], start=(3.0, -2.0 - radius))
    height = 100 + 0.3 * np.sin(curve.heading)
    track = Track(curve, standard.gauge_m + standard.head_width_m, height)
    scene = build("ring", Plan([track], standard, Scanner(profile_step_m=0.1)), np.random.RandomState(3))
    settings = Parameters(standard.gauge_m, standard.head_width_m, square_tiles=4)
    found = extract_rails([scene.rail_points()], settings)
    assert (len(found.rails), len(found.centerlines)) == (2, 1)
    for line, true in (*zip(_by_length(found.rails), sorted(scene.rails, key=len)), (found.centerlines[0], curve.xy)):
        np.testing.assert_array_equal(line.xyz[0], line.xyz[-1])
        expected = length_along(np.concatenate([true, true[:1]])[:, :2])[-1]
        assert length_along(line.xyz[:, :2])[-1] == pytest.approx(expected, rel=1e-3)
        off = np.hypot(*(line.xyz[:, :2] - [3.0, -2.0]).T) - expected / (2 * np.pi)
        assert np.sqrt(np.mean(off**2)) < 2e-3
        assert largest_step(line.xyz) < 0.05


def ridges(rng, *lefts, wander_m=0.0):
    """Points on ridges without edges that wander against each other, at distances to the left of a line of 100 m."""
    t, left = rng.uniform(0, 100, 20_000 * len(lefts)), rng.uniform(-0.056, 0.056, 20_000 * len(lefts))
    place = rng.choice(lefts, len(t))
    across = place + np.sign(place) * wander_m * np.sin(2 * np.pi * t / 50) + left
    return np.column_stack([t, across, rng.normal(0, 0.01, len(t)) - 5 * left**2])


@dataclass(frozen=True)
class Given:
    """A source whose points are there."""

    points: SortedPoints
    run_time = 1.0

    def sort(self, *_):
        return nullcontext(self.points)


@pytest.mark.parametrize("classify", [True, False])
def test_a_blunt_ridge_without_a_partner_is_a_rail_only_if_someone_says_so(monkeypatch, tmp_path, classify):
    monkeypatch.setattr(steps, "clean", lambda raster, *_: raster)
    half = 0.5 * (1.435 + WIDTH)
    xyz = ridges(np.random.RandomState(6), half, -half, 6.0)
    source = source_of(xyz)
    points = SortedPoints([source], SearchFigures(blunt_m=300.0), only_pairs=classify)
    network = extract_files(Given(points), tmp_path, Parameters(1.435, WIDTH), Runner())
    assert len(network.rails) == (2 if classify else 3)
    assert len(network.centerlines) == 1


def test_errors_of_blunt_rails_explain_what_their_gauge_scatters(monkeypatch):
    """Ridges that wander against each other by 24 mm over 50 m, which a curve along a single rail follows."""
    monkeypatch.setattr(steps, "clean", lambda raster, *_: raster)
    half = 0.5 * (1.435 + WIDTH)
    xyz = ridges(np.random.RandomState(5), half, -half, wander_m=0.012)
    points = cloud_of(xyz)
    found = extract_rails([points], Parameters(1.435, WIDTH, quality_step_m=1.0))
    (track,) = found.centerlines
    assert 9 < track.gaugesd_mm < 24 / np.sqrt(2)
    assert np.hypot(*(rail.sigma_mm for rail in found.rails)) == pytest.approx(track.gaugesd_mm, rel=0.1)
    assert np.median(found.geometry[0].sigma_mm) == pytest.approx(track.gaugesd_mm / 2, rel=0.15)


def test_a_tile_far_from_the_others_does_not_decide_alone_whether_heads_are_blunt(monkeypatch):
    """A sharp track, and 20 m of ridges in another square."""
    monkeypatch.setattr(steps, "clean", lambda raster, *_: raster)
    rng, half = np.random.RandomState(8), 0.5 * (1.435 + WIDTH)
    few = ridges(rng, half, -half)
    few = few[few[:, 0] < 20]
    t, side = rng.uniform(0, 100, 40_000), rng.choice([half, -half], 40_000)
    sharp = np.column_stack([t, side + rng.uniform(-WIDTH / 2, WIDTH / 2, len(t)), rng.normal(0, 0.002, len(t))])
    points = cloud_of(sharp, few + [900.0, 0.0, 0.0])
    parameters = Parameters(1.435, WIDTH, quality_step_m=1.0)
    itself, told, other = (extract_rails([replace(points, blunt=blunt)], parameters) for blunt in (None, False, True))
    assert not itself.heads.blunt and other.heads.blunt
    for one, same, different in zip(itself.rails, told.rails, other.rails):
        np.testing.assert_array_equal(one.xyz, same.xyz)
        assert one.sigma_mm == same.sigma_mm != different.sigma_mm


def _by_length(lines):
    return sorted(lines, key=lambda line: line.length_m)


def test_a_run_in_squares_can_be_cancelled():
    with pytest.raises(Cancelled):
        extract_rails([straight().rail_points()], Parameters(1.435, WIDTH, square_tiles=4), Heard(cancel_after=0))


def test_squares_smaller_than_their_overlap_are_refused():
    with pytest.raises(ParameterError, match="4"):
        extract_rails([straight().rail_points()], Parameters(1.435, WIDTH, square_tiles=2))


def test_the_progress_rises_to_the_end_and_cleaning_has_its_share_of_it(monkeypatch):
    """Until the tracks are paired, at nine tenths, squares of equal points have equal shares."""
    cleaning, heard = [], Heard()

    def clean(raster, engine, passes, progress):
        start = heard.fractions[-1] if heard.fractions else 0.0
        progress.set_fraction(1.0)
        cleaning.append(heard.fractions[-1] - start)
        return raster

    monkeypatch.setattr(steps, "clean", clean)
    settings = Parameters(1.435, STANDARDS["EN_60E1_1435"].head_width_m, square_tiles=4, quality_step_m=1.0)
    extract_rails([straight().rail_points()], settings, heard)
    assert len(cleaning) > 2
    share = drawing.CLEAN_S / (drawing.CLEAN_S + drawing.DRAW_S)
    assert sum(cleaning) == pytest.approx(share * 0.9, abs=1e-9)
    assert (np.diff(heard.fractions) >= -1e-12).all()
    assert min(heard.fractions) >= 0.0 and heard.fractions[-1] == max(heard.fractions) == 1.0


def scanned_and_surveyed(scanned_m=60.0, imaged=True):
    """A track of 60 m that a scanner shows from its start on, and images, 3 cm aside and lower, throughout."""
    rng, spacing_m = np.random.RandomState(4), 1.435 + WIDTH
    x, y, left = rng.uniform(0, scanned_m, 9000), rng.uniform(-0.5, 0.5, 9000) * WIDTH, rng.randint(2, size=9000)
    parts = [np.column_stack([x, y + spacing_m * left, rng.normal(0, 0.002, 9000)])]
    if imaged:
        x, y, left = rng.uniform(0, 60, 6000), rng.uniform(-0.12, 0.12, 6000), rng.randint(2, size=6000)
        z = 0.12 * np.exp(-0.5 * (y / 0.06) ** 2) - 0.16 + rng.normal(0, 0.004, 6000)
        parts.append(np.column_stack([x, y + spacing_m * left + 0.03, z]))
    strips = np.repeat([5, 6], [9000, 6000])[: sum(map(len, parts))]
    return cloud_of(*parts, strips=strips if imaged else None)


def test_images_show_the_rails_where_the_scanner_does_not():
    both = extract_rails(
        [scanned_and_surveyed(25.0)], Parameters(1.435, WIDTH, engine="OPENCV", quality_step_m=1.0, keep_cleaned=True)
    )
    alone = extract_rails([scanned_and_surveyed(25.0, imaged=False)], Parameters(1.435, WIDTH, engine="OPENCV"))
    sharp, blunt = ([rail for rail in both.rails if rail.fills == fills] for fills in (False, True))
    assert [rail.xyz.tolist() for rail in sharp] == [rail.xyz.tolist() for rail in alone.rails]
    assert len(blunt) == 2
    for rail in blunt:
        assert rail.xyz[:, 0].min() < 26 and rail.xyz[:, 0].max() > 59
        left_m = 1.507 * (rail.xyz[0, 1] > 0.7) + 0.03
        assert np.abs(rail.xyz[:, 1] - left_m).max() < 0.01
        assert rail.sigma_mm > 2 * max(one.sigma_mm for one in sharp)
    (track,) = both.centerlines
    assert track.length_m > 58
    (geometry,) = both.geometry
    assert len(geometry.chainage_m) == pytest.approx(track.length_m, abs=2)
    (raster,) = both.cleaned
    along = raster.to_local(raster.cells())[:, 0]
    assert all(np.count_nonzero((along > start) & (along < start + 5)) > 200 for start in range(0, 60, 5))
    said = [warning for warning in both.warnings if "Where only blunt ones show a rail, on " in warning]
    assert float(said[0].split("a rail, on ")[1].split(" m")[0]) == pytest.approx(70, abs=2)


def test_sharp_passes_that_look_blunt_together_are_told_apart_first():
    """Two heads 4 cm aside and 2 cm apart in height look like a ridge, whose crest was 5 cm off."""
    of = [
        strips.Pass(side * 0.020, -side * 0.011, scanner=Scanner(noise_m=0.002, left_m=0.4 * side)) for side in (1, -1)
    ]
    scene = strips.passes("apart", 47, of, with_ids=False)
    points = cloud_of(scene.xyz[scene.classification == scene.classification.max()])
    network = extract_rails([points], Parameters(scene.standard.gauge_m, scene.standard.head_width_m, engine="OPENCV"))
    back = match([network.frame.to_crs(rail.xyz) for rail in network.rails], scene.rails).back
    assert len(network.rails) == 2
    assert np.sqrt(np.mean(back.lateral**2)) < 0.002 and np.sqrt(np.mean(back.height**2)) < 0.001


def test_passes_that_the_points_do_not_state_are_told_apart_by_levels():
    """Lines are on the mean of the passes; the log says it once, and the report has their offsets."""
    scene = strips.unmarked_heights()
    points = cloud_of(scene.xyz[scene.classification == scene.classification.max()])
    settings = Parameters(scene.standard.gauge_m, scene.standard.head_width_m, engine="OPENCV")
    heard = Heard()
    network = extract_rails([points], settings, heard)
    told = [text for text in heard.infos if "state no scanner passes" in text]
    assert told == ["Class 10: the points state no scanner passes; the heads show them on 2 levels."]
    assert [round(float(np.mean(course.up_mm))) for course in network.strips] == [-6, 6]
    found = match([network.frame.to_crs(rail.xyz) for rail in network.rails], scene.rails)
    assert len(network.rails) == 2 and abs(np.mean(found.back.height) - 0.006) < 0.001
    assert min(rail.sigmaz_mm for rail in network.rails) > 5
