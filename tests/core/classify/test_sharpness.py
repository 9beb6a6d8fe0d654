"""Sharp or blunt, once per cloud."""

from typing import NamedTuple

import pytest
from rail_extract.core.classify.sharpness import search_alike
from rail_extract.core.rails import SearchFigures
from rail_extract.laboratory.ruler.classification import lines_from, score, settings_of
from rail_extract.laboratory.ruler.whole_clouds import classify_cloud
from rail_extract.laboratory.scenes.raw_catalogue import RAW_SCENES


class Found(NamedTuple):
    part: tuple[float, float]
    blunt: bool
    figures: SearchFigures


def ways(*parts):
    """Search parts with lengths of sharp and of round rails, and return in which way each was searched at last."""

    def search(some, blunt):
        for sharp_m, round_m in some:
            figures = SearchFigures() if blunt else SearchFigures(sharp_m=sharp_m, round_m=round_m)
            yield Found((sharp_m, round_m), blunt, figures)

    found = list(search_alike(parts, search))
    assert [one.part for one in found] == list(parts)
    return [one.blunt for one in found]


@pytest.mark.parametrize(
    ("parts", "blunt"),
    [
        ([(80.0, 0.6)] * 3, False),
        ([(80.0, 0.6), (0.0, 90.0)], False),
        ([(0.0, 80.0)] * 9, True),
        ([(2.0, 80.0)] * 9, True),
        ([(0.0, 0.0)] * 9, False),
        ([(0.0, 0.0)] * 7 + [(0.0, 12.0)], True),
        ([(0.0, 0.0)] * 7 + [(12.0, 3.0)], False),
        ([], False),
    ],
)
def test_all_parts_are_searched_in_one_way(parts, blunt):
    assert ways(*parts) == [blunt] * len(parts)


def test_a_stray_piece_does_not_blunt_a_sharp_cloud():
    scene = RAW_SCENES["thin ballast"](1)
    found, rail = score(scene)
    assert found.figures.blunt_m == 0
    assert found.recall > 0.99
    lines = lines_from(scene, rail).within(0.05)
    assert lines.completeness > 0.99
    assert abs(lines.lateral_rmse_m) < 0.001
    assert abs(lines.height_rmse_m) < 0.001


def test_a_blunt_cloud_is_blunt_everywhere():
    scene = RAW_SCENES["photo curve blunt"](2)
    figures = classify_cloud(scene.xyz, settings_of(scene)).figures
    assert figures.blunt_m == pytest.approx(figures.paired_m + figures.single_m)
    assert figures.blunt_m > 200
