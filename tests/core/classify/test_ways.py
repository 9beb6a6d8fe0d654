"""The way in which a cloud is searched, once per cloud."""

from dataclasses import replace
from typing import NamedTuple

import numpy as np
import pytest
from rail_extract.core.classify.settings import Settings, Way
from rail_extract.core.classify.square import classify_square
from rail_extract.core.classify.ways import any_sharp, blunt_among, is_blunt, search_alike, searched_alone
from rail_extract.core.rails import SearchFigures
from rail_extract.laboratory.ruler.classification import lines_from, score
from rail_extract.laboratory.scenes.raw_catalogue import DRONE, RAW_SCENES, double_track
from scipy.special import ndtr


class Found(NamedTuple):
    part: tuple[float, ...]
    way: Way
    figures: SearchFigures


def ways(*parts, again=1.0, clear=1.0, of_images=False, is_sharp=False):
    """Search parts and return in which way each was searched at last.

    They have lengths of sharp, of round, and of filled rails. Of the sharp ones, a share stands clear of the bed; of
    the round ones, the search of a blunt cloud finds a share.
    """

    def search(some, way):
        for part in some:
            sharp_m, round_m, *filled_m = part
            seen = SearchFigures(paired_m=sharp_m + round_m, sharp_m=sharp_m, round_m=round_m, clear_m=clear * sharp_m)
            filled, blunt = SearchFigures(paired_m=sum(filled_m)), SearchFigures(paired_m=again * round_m)
            yield Found(part, way, {Way.SHARP: seen, Way.FILLED: filled, Way.BLUNT: blunt}[way])

    found = list(search_alike(parts, search, of_images, is_sharp))
    assert [one.part for one in found] == list(parts)
    return [one.way for one in found]


@pytest.mark.parametrize(
    ("parts", "way"),
    [
        ([(80.0, 0.6)] * 3, Way.SHARP),
        ([(80.0, 0.6), (0.0, 90.0)], Way.SHARP),
        ([(0.0, 80.0)] * 9, Way.BLUNT),
        ([(2.0, 80.0)] * 9, Way.BLUNT),
        ([(8.0, 66.0)] * 4, Way.BLUNT),
        ([(15.0, 66.0)] * 4, Way.SHARP),
        ([(0.0, 0.0, 0.0)] * 9, Way.SHARP),
        ([(0.0, 0.0, 2.0)] * 9, Way.SHARP),
        ([(0.0, 0.0, 90.0)] * 9, Way.FILLED),
        ([(0.0, 0.0)] * 7 + [(0.0, 12.0)], Way.BLUNT),
        ([(0.0, 0.0)] * 7 + [(12.0, 3.0)], Way.SHARP),
        ([(0.0, 0.0)] * 7 + [(12.0, 3.0, 80.0)], Way.FILLED),
        ([(0.0, 0.0, 80.0)] * 3 + [(0.0, 1.7, 80.0)], Way.FILLED),
        ([(0.0, 0.0, 80.0)] * 7 + [(30.0, 3.0, 80.0)], Way.SHARP),
        ([], Way.SHARP),
    ],
)
def test_all_parts_are_searched_in_one_way(parts, way):
    assert ways(*parts) == [way] * len(parts)


@pytest.mark.parametrize(("again", "way"), [(0.9, Way.BLUNT), (0.6, Way.SHARP), (0.1, Way.SHARP)])
def test_a_cloud_whose_round_rails_are_no_ridges_of_a_surface_is_sharp(again, way):
    """A thin, wide beam rounds heads as images do, but its points are not a smooth surface."""
    assert ways(*[(6.0, 60.0)] * 9, again=again) == [way] * 9


@pytest.mark.parametrize(("again", "way"), [(1.0, Way.BLUNT), (0.8, Way.BLUNT), (0.6, Way.FILLED)])
def test_low_heads_of_images_are_ridges(again, way):
    """In worlds 10988 and 11008, the search of filled tracks found flanks of the ridges, and no switch."""
    low = [(9.0, 9.0, 30.0)] * 8
    assert ways(*low, again=2 * again, clear=0.0, of_images=True) == [way] * 8
    assert ways(*low, again=2 * again, clear=0.0) == [Way.FILLED] * 8


@pytest.mark.parametrize(("round_m", "unsure_m", "blunt"), [(157.0, 29.0, True), (5.0, 200.0, False)])
def test_rails_that_may_be_of_either_show_a_sharp_cloud_unless_round_ones_are_longer(round_m, unsure_m, blunt):
    """Grooves may be there by chance, and single metres of a rail may be round."""
    assert is_blunt(SearchFigures(round_m=round_m, unsure_m=unsure_m)) == blunt


@pytest.mark.parametrize(
    ("filled_m", "clear", "way"),
    [(50.0, 0.1, Way.FILLED), (50.0, 0.6, Way.FILLED), (50.0, 0.9, Way.SHARP), (30.0, 0.1, Way.SHARP)],
)
def test_a_cloud_of_which_many_rails_stand_low_keeps_the_search_that_finds_more(filled_m, clear, way):
    """However many they are, others may be lower, and parts of them."""
    assert ways(*[(40.0, 0.0, filled_m)] * 4, clear=clear) == [way] * 4


@pytest.mark.parametrize("lost", [0, 1, 4])
@pytest.mark.parametrize("round_m", [0.0, 66.0])
def test_parts_that_cannot_be_searched_are_left_out_once(lost, round_m):
    """A tolerant run notes their errors and has no answer for them."""

    def search(some, way):
        for number in some:
            if number != lost:
                figures = SearchFigures(paired_m=round_m, round_m=round_m)
                yield Found(number, way, figures)

    assert [one.part for one in search_alike(range(5), search)] == [number for number in range(5) if number != lost]


def test_a_stray_piece_does_not_blunt_a_sharp_cloud():
    scene = RAW_SCENES["thin ballast"](1)
    found, rail = score(scene)
    assert found.figures.blunt_m == 0
    assert found.recall > 0.99
    lines = lines_from(scene, rail).within(0.05)
    assert lines.completeness > 0.99
    assert abs(lines.lateral_rmse_m) < 0.001
    assert abs(lines.height_rmse_m) < 0.001


def test_images_that_blur_a_little_show_all_rails():
    """Their tops are hardly wider than heads: a limit must not find one rail narrow enough, and the next too wide."""
    found, _ = score(double_track(3, replace(DRONE, blur_m=0.032)))
    assert found.figures.blunt_m > 200
    assert found.recall > 0.99


def test_the_blur_is_that_of_rails():
    """Wide and steep things of a bridge blur less than rails, whose width is known."""
    side_m = np.arange(0.0, 16.0, 0.05)
    xy = np.array(np.meshgrid(side_m, side_m)).reshape(2, -1).T
    rng = np.random.RandomState(4)
    xy = xy + rng.uniform(-0.02, 0.02, xy.shape)
    off_m = xy[:, :1] - np.array([5.0, 5.0 + 1.435 + 0.072])
    rails_m = 0.13 * np.exp(-0.5 * (off_m / 0.062) ** 2).sum(axis=1)
    wall_m = xy[:, :1] - np.array([2.5, 9.0])
    walls_m = 0.32 * (ndtr((wall_m + 0.1) / 0.015) - ndtr((wall_m - 0.1) / 0.015)).sum(axis=1)
    xyz = np.column_stack([xy, rails_m + walls_m + 0.004 * rng.standard_normal(len(xy))])
    figures = classify_square(xyz, Settings((1.435,), 0.072, way=Way.BLUNT)).figures
    assert figures.blunt_m == pytest.approx(2 * 16.0, rel=0.1)
    assert figures.blur_m == pytest.approx(0.062, rel=0.2)


def filled_track(
    rise_m: float, per_m2: int, width_m: float = 0.072, shoulder_m: float = 0.0, rough_m: float = 0.008
) -> np.ndarray:
    """Two heads above rough ballast, with points per square metre; beyond them, a shoulder may fall or rise."""
    rng = np.random.RandomState(6)
    xy = rng.uniform(0.0, 16.0, (16 * 16 * per_m2, 2))
    off_m = np.abs(xy[:, 0] - 7.0) - (1.435 + 0.072) / 2
    z = np.where(np.abs(off_m) < width_m / 2, rise_m, rough_m * rng.standard_normal(len(xy)))
    z += np.where(off_m > 0.4, shoulder_m, 0.0) + 0.003 * rng.standard_normal(len(xy))
    return np.column_stack([xy, z])


def searched(xyz: np.ndarray, way: Way) -> SearchFigures:
    return classify_square(xyz, Settings((1.435,), 0.072, way=way)).figures


@pytest.mark.parametrize(
    ("track", "found_m"),
    [
        (filled_track(0.03, 900), 2 * 16.0),
        (filled_track(0.015, 900), 2 * 16.0),
        (filled_track(0.02, 900, shoulder_m=-0.10), 2 * 16.0),
        (filled_track(0.03, 900, shoulder_m=0.08), 2 * 16.0),
        (filled_track(0.0, 900), 0.0),
        (filled_track(0.03, 900, width_m=0.14), 0.0),
        (filled_track(0.03, 250), 0.0),
    ],
    ids=["3 cm", "1.5 cm", "beside a step down", "beside a heap", "none", "boards", "thin"],
)
def test_heads_just_above_the_ballast_are_above_both_sides_and_as_wide_as_heads(track, found_m):
    assert searched(track, Way.SHARP).paired_m == 0
    figures = searched(track, Way.FILLED)
    assert figures.paired_m == figures.filled_m == pytest.approx(found_m, abs=3.0)  # lines end in the cloud


def test_beside_a_head_that_stands_low_the_ground_is_lower_by_half_its_height():
    """Beside one of 4.5 cm, no stone is as much below its top as beside one of 15 cm."""
    assert searched(filled_track(0.045, 1500, rough_m=0.01), Way.SHARP).paired_m == pytest.approx(2 * 16.0, abs=1.0)


@pytest.mark.parametrize(("rise_m", "clear_m"), [(0.053, 0.0), (0.08, 0.0), (0.12, 2 * 16.0)])
def test_heads_of_which_rough_ballast_would_hide_tops_do_not_stand_clear(rise_m, clear_m):
    figures = searched(filled_track(rise_m, 1500, rough_m=0.006), Way.SHARP)
    assert figures.sharp_m == pytest.approx(2 * 16.0, abs=1.0)
    assert figures.clear_m == pytest.approx(clear_m, abs=1.0)


def test_rough_ballast_hides_tops_of_heads_that_do_not_stand_clear():
    track = filled_track(0.053, 1500, rough_m=0.014)
    assert searched(track, Way.SHARP).paired_m < 0.25 * 2 * 16.0
    assert searched(track, Way.FILLED).paired_m == pytest.approx(2 * 16.0, abs=3.0)


def test_a_search_for_heads_just_above_the_ballast_also_finds_those_that_stand_clear():
    tracks = np.concatenate([filled_track(0.02, 900), filled_track(0.14, 900) + [16.0, 0.0, 0.0]])
    assert searched(tracks, Way.SHARP).paired_m == pytest.approx(2 * 16.0, abs=3.0)
    figures = searched(tracks, Way.FILLED)
    assert figures.paired_m == pytest.approx(4 * 16.0, abs=4.0)
    assert figures.filled_m == pytest.approx(2 * 16.0, abs=3.0)


def test_heads_just_above_the_ballast_are_seen_under_the_vault_of_a_tunnel():
    tunnel = np.concatenate([filled_track(0.03, 900), filled_track(0.0, 1800) + [0.0, 0.0, 7.0]])
    assert searched(tunnel, Way.FILLED).filled_m == pytest.approx(2 * 16.0, abs=3.0)


def test_points_on_heads_just_above_the_ballast_are_in_the_middle_of_these():
    """In world 12035, the lines of cells were 30 mm aside, and lines were 16 mm off their heads."""
    track = filled_track(0.02, 1500, rough_m=0.01)
    on_heads = track[classify_square(track, Settings((1.435,), 0.072, way=Way.FILLED)).rail]
    off_m = np.abs(on_heads[:, 0] - 7.0) - 0.5 * (1.435 + 0.072)
    assert np.median(off_m) == pytest.approx(0.0, abs=0.003)
    assert np.quantile(np.abs(off_m), 0.95) < 0.040


SHARP, ROUND, NOTHING = (30.0, 2.0), (0.5, 60.0), (0.0, 0.0)
"""Lengths of sharp and of round rails in a part of a cloud."""


@pytest.mark.parametrize(
    ("sources", "blunt", "searched"),
    [
        ({1: [SHARP] * 9}, set(), 0),
        ({1: [SHARP] * 9, 2: [SHARP] * 9}, set(), 2),
        ({1: [ROUND] * 9, 2: [ROUND] * 9}, set(), 4),
        ({1: [SHARP] * 9, 2: [ROUND] * 9}, {2}, 3),
        ({1: [NOTHING] * 3 + [SHARP], 2: [ROUND] * 2, 3: [NOTHING] * 5}, {2}, 4 + 2 + 5),
        ({1: [SHARP], 2: [ROUND]}, set(), 2),
    ],
)
def test_sources_are_blunt_among_sharp_ones_only_if_both_are_certain(sources, blunt, searched):
    asked = []

    def search(parts):
        asked.extend(parts)
        return [(one, SearchFigures(sharp_m=sharp_m, round_m=round_m)) for one, (sharp_m, round_m) in parts]

    assert blunt_among(searched_alone(sources, search)) == blunt
    assert len(asked) == searched


def test_passes_that_are_apart_are_sharp_although_they_look_round_together():
    """In world 12589, two passes 4 cm apart were searched as a blunt cloud, and no line was drawn."""
    assert any_sharp({1: SearchFigures(sharp_m=50.0, round_m=4.0), 2: SearchFigures(sharp_m=12.0)})
    assert not any_sharp({1: SearchFigures(sharp_m=50.0, round_m=40.0), 2: SearchFigures(sharp_m=12.0)})
    assert ways(*[(0.0, 50.0)] * 4) == [Way.BLUNT] * 4
    assert ways(*[(0.0, 50.0)] * 4, is_sharp=True) == [Way.SHARP] * 4


def test_passes_of_one_wide_beam_are_of_one_kind():
    """World 263: one pass shows round rails only, the others both kinds."""
    assert not blunt_among({3: SearchFigures(round_m=110.5), 5: SearchFigures(sharp_m=33.0, round_m=34.6)})


def test_a_source_that_shows_little_is_not_called_blunt():
    figures = {1: SearchFigures(sharp_m=500.0), 2: SearchFigures(round_m=99.0), 3: SearchFigures(round_m=101.0)}
    assert blunt_among(figures) == {3}
