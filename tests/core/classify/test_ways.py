"""The way in which a cloud is searched, once per cloud."""

from dataclasses import replace
from typing import NamedTuple

import numpy as np
import pytest
from rail_extract.core.classify.settings import Settings, Way
from rail_extract.core.classify.square import classify_square
from rail_extract.core.classify.ways import blunt_among, blunt_sources, is_blunt, search_alike
from rail_extract.core.rails import SearchFigures
from rail_extract.laboratory.ruler.classification import lines_from, score
from rail_extract.laboratory.scenes.raw_catalogue import DRONE, RAW_SCENES, double_track
from scipy.special import ndtr


class Found(NamedTuple):
    part: tuple[float, float]
    way: Way
    figures: SearchFigures


def ways(*parts):
    """Search parts with lengths of sharp and of round rails, and return in which way each was searched at last."""

    def search(some, way):
        for sharp_m, round_m in some:
            seen = SearchFigures(paired_m=sharp_m + round_m, sharp_m=sharp_m, round_m=round_m)
            yield Found((sharp_m, round_m), way, seen if way is Way.SHARP else SearchFigures())

    found = list(search_alike(parts, search))
    assert [one.part for one in found] == list(parts)
    return [one.way for one in found]


@pytest.mark.parametrize(
    ("parts", "way"),
    [
        ([(80.0, 0.6)] * 3, Way.SHARP),
        ([(80.0, 0.6), (0.0, 90.0)], Way.SHARP),
        ([(0.0, 80.0)] * 9, Way.BLUNT),
        ([(2.0, 80.0)] * 9, Way.BLUNT),
        ([(0.0, 0.0)] * 9, Way.FILLED),
        ([(0.0, 0.0)] * 7 + [(0.0, 12.0)], Way.BLUNT),
        ([(0.0, 0.0)] * 7 + [(12.0, 3.0)], Way.SHARP),
        ([(0.0, 0.0)] * 7 + [(3.0, 1.0)], Way.FILLED),
        ([], Way.FILLED),
    ],
)
def test_all_parts_are_searched_in_one_way(parts, way):
    assert ways(*parts) == [way] * len(parts)


@pytest.mark.parametrize(("round_m", "unsure_m", "blunt"), [(157.0, 29.0, True), (5.0, 200.0, False)])
def test_rails_that_may_be_of_either_show_a_sharp_cloud_unless_round_ones_are_longer(round_m, unsure_m, blunt):
    """Grooves may be there by chance, and single metres of a rail may be round."""
    assert is_blunt(SearchFigures(round_m=round_m, unsure_m=unsure_m)) == blunt


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


def filled_track(share: float, per_m2: int) -> np.ndarray:
    """Two heads 3 cm above ballast, with points per square metre; a share of those of heads is on top, others below."""
    rng = np.random.RandomState(6)
    xy = rng.uniform(0.0, 16.0, (16 * 16 * per_m2, 2))
    on = np.abs(np.abs(xy[:, 0] - 7.0) - (1.435 + 0.072) / 2) < 0.036
    top = on & (rng.uniform(size=len(xy)) < share)
    z = np.where(top, 0.03, 0.008 * rng.standard_normal(len(xy))) + 0.003 * rng.standard_normal(len(xy))
    return np.column_stack([xy, z])


@pytest.mark.parametrize(
    ("share", "per_m2", "found_m"), [(1.0, 900, 2 * 16.0), (0.3, 900, 0.0), (0.45, 3000, 0.0), (1.0, 250, 0.0)]
)
def test_heads_just_above_the_ballast_are_flat(share, per_m2, found_m):
    xyz = filled_track(share, per_m2)
    figures = [classify_square(xyz, Settings((1.435,), 0.072, way=way)).figures for way in (Way.SHARP, Way.FILLED)]
    assert figures[0].paired_m == 0
    assert figures[1].paired_m == figures[1].filled_m == pytest.approx(found_m, abs=1.0)


def test_heads_just_above_the_ballast_are_flat_under_the_vault_of_a_tunnel():
    vault = filled_track(0.0, 1800) + [0.0, 0.0, 7.0]
    tunnel = np.concatenate([filled_track(1.0, 900), vault])
    figures = classify_square(tunnel, Settings((1.435,), 0.072, way=Way.FILLED)).figures
    assert figures.filled_m == pytest.approx(2 * 16.0, abs=1.0)


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

    assert blunt_sources(sources, search) == blunt
    assert len(asked) == searched


def test_passes_of_one_wide_beam_are_of_one_kind():
    """World 263: one pass shows round rails only, the others both kinds."""
    assert not blunt_among({3: SearchFigures(round_m=110.5), 5: SearchFigures(sharp_m=33.0, round_m=34.6)})


def test_a_source_that_shows_little_is_not_called_blunt():
    figures = {1: SearchFigures(sharp_m=500.0), 2: SearchFigures(round_m=99.0), 3: SearchFigures(round_m=101.0)}
    assert blunt_among(figures) == {3}
