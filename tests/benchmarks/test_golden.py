"""The golden table: scenes run as the published figures say, and the comparison finds what moved."""

import json
from pathlib import Path

import numpy as np
import pytest
from rail_extract.laboratory.ruler.golden import PLAIN, QUICK, TORCH, VARIANTS, Golden, Variant, build_scene, figures_of

TABLE = Path(__file__).resolve().parents[2] / "benchmarks" / "golden.json"


@pytest.mark.parametrize(
    ("variant", "place"), [*((PLAIN, place) for place in QUICK), *((TORCH, place) for place in TORCH.places)]
)
def test_scene_gives_its_published_figures(variant, place):
    if variant is TORCH:
        pytest.importorskip("torch", reason="PyTorch draws other lines than OpenCV; it is not installed here")
    differences = Golden(TABLE).differences(variant, place, figures_of(place, build_scene(place), variant))
    assert not differences, "\n".join(
        ["", f"{'scene':<24}{'figure':<16}{'before':>10}    now", *map(str, differences), "Meant so? `make golden`"]
    )


def test_table_has_scenes_and_variants_that_exist_and_all_of_the_quick_part():
    figures = Golden(TABLE).figures
    assert set(figures) <= {variant.name for variant in VARIANTS}
    assert all(set(scenes) <= set(variant.places) for variant in VARIANTS for scenes in [figures.get(variant.name, {})])
    assert set(QUICK) <= set(figures[PLAIN.name]) and set(TORCH.places) == set(figures[TORCH.name])


def test_figures_that_moved_appeared_or_vanished_differ(tmp_path):
    path = tmp_path / "golden.json"
    path.write_text(json.dumps({"tolerances": {"across mm": 0.2, "tracks": 0, "fork m": 1}, "figures": {}}), "utf-8")
    golden = Golden(path)
    golden.put(PLAIN, "straight", {"across mm": 1.0, "tracks": 2, "fork m": np.nan})
    golden.save()
    again = Golden(path)
    same = {"across mm": 1.19, "tracks": 2}
    assert again.differences(PLAIN, "straight", same) == []
    moved = again.differences(PLAIN, "straight", {"across mm": 1.25, "tracks": np.nan, "fork m": 0.1})
    assert [difference.figure for difference in moved] == ["across mm", "tracks", "fork m"]
    assert str(moved[0]).split() == ["straight", "across", "mm", "1.00", "->", "1.25"]


def test_a_variant_may_have_tolerances_of_its_own(tmp_path):
    path = tmp_path / "golden.json"
    path.write_text(json.dumps({"tolerances": {"across mm": 0.2, "bridged m": 0.3}, "figures": {}}), "utf-8")
    golden = Golden(path)
    rough = Variant("rough", tolerances={"bridged m": 0.7})
    for variant in (PLAIN, rough):
        golden.put(variant, "straight", {"across mm": 1.0, "bridged m": 41.0})
    now = {"across mm": 1.3, "bridged m": 41.5}
    assert [moved.figure for moved in golden.differences(PLAIN, "straight", now)] == ["across mm", "bridged m"]
    assert [moved.figure for moved in golden.differences(rough, "straight", now)] == ["across mm"]
