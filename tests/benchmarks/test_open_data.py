"""The benchmark of open data, on clouds in the formats, classes, names and tiling of both sets."""

from __future__ import annotations

import importlib.util
import re
import sys
from pathlib import Path

import laspy
import numpy as np
import pytest
from rail_extract.core.checks.standard import detect_standard
from rail_extract.core.clouds.points import ask
from rail_extract.core.standards import STANDARDS
from rail_extract.laboratory.scenes.raw import scan_world
from rail_extract.laboratory.scenes.raw_catalogue import line, masts_at, parallel
from rail_extract.laboratory.scenes.raw_scanner import RawScanner
from rail_extract.laboratory.scenes.raw_world import FOOT, HEAD, MAST, WIRE, ground, running_rails

IBERIAN = STANDARDS["EN_60E1_1668"]
TILE_M = 10.0
SHIFT_M = np.array([0.0, 0.0, 0.02])
"""Error of registration of the second run."""

SCANNER = RawScanner(profile_step_m=0.06, ray_step_rad=0.0028)


@pytest.fixture(scope="module")
def benchmark():
    path = Path(__file__).resolve().parents[2] / "benchmarks" / "open_data.py"
    specification = importlib.util.spec_from_file_location("open_data_benchmark", path)
    module = importlib.util.module_from_spec(specification)
    sys.modules[specification.name] = module
    specification.loader.exec_module(module)
    return module


def scene_of(standard, seed, length_m=2 * TILE_M):
    curve = line(length_m, 1 / 600, 0.3)
    tracks = parallel(curve, (0.0,), 0.05, standard)
    return scan_world(
        "open", tracks, standard, [SCANNER], [ground, running_rails, masts_at(-3.4)], seed, half_width_m=6.0
    )


def write_tile(path, xyz, classes):
    """Write LAS 1.2, point format 3, as both sets have it."""
    path.parent.mkdir(parents=True, exist_ok=True)
    header = laspy.LasHeader(version="1.2", point_format=3)
    header.scales = np.full(3, 0.001)
    header.offsets = np.floor(xyz.min(axis=0))
    cloud = laspy.LasData(header)
    cloud.x, cloud.y, cloud.z = xyz.T
    cloud.classification = classes
    cloud.intensity = np.full(len(xyz), 1000)
    cloud.gps_time = np.linspace(48299.0, 48313.0, len(xyz))
    cloud.write(path)


def classes_of(scene, rail, wire, pole, ground_class):
    classes = np.full(len(scene.xyz), ground_class, dtype=np.uint8)
    for kinds, code in (((HEAD, FOOT), rail), ((WIRE,), wire), ((MAST,), pole)):
        classes[np.isin(scene.kind, kinds)] = code
    return classes


@pytest.fixture(scope="module")
def railcloud(tmp_path_factory):
    """Two acquisitions that meet, each of two tiles of consecutive chainage, in the coordinates of EPSG:3950."""
    folder = tmp_path_factory.mktemp("RailCloud-HdF_v1.0")
    for run, seed, shift in (("ACQ_286_Don_Lens", 3, 0.0), ("ACQ_289_Lille_Don", 4, SHIFT_M)):
        scene = scene_of(STANDARDS["EN_60E1_1435"], seed)
        classes = classes_of(scene, rail=5, wire=7, pole=4, ground_class=1)
        classes[::50] = 0
        xyz = scene.xyz + [1760100.0, 9222100.0, 140.0] + shift
        along = (scene.xyz[:, :2] - [3.0, 5.0]) @ [np.cos(0.3), np.sin(0.3)]
        for number in range(2):
            mine = np.floor(along / TILE_M).clip(0, 1) == number
            name = f"{run}_F_{number}+{950 if number == 0 else 0:03d}_1+{50 * number:03d}.laz"
            write_tile(folder / "data" / run / "cloud" / name, xyz[mine], classes[mine])
    return folder


@pytest.fixture(scope="module")
def semantic(tmp_path_factory):
    """One cloud in five segments, in local coordinates that begin at zero, with Iberian gauge."""
    folder = tmp_path_factory.mktemp("SemanticRail3D")
    scene = scene_of(IBERIAN, 5)
    xyz = scene.xyz - scene.xyz.min(axis=0)
    classes = classes_of(scene, rail=1, wire=4, pole=5, ground_class=0)
    for number, part in enumerate(np.array_split(np.argsort(scene.xyz[:, 0]), 5)):
        write_tile(folder / "Test" / f"cloud180_Seg{number + 1}.laz", xyz[part], classes[part])
    return folder


def figures(text, place):
    """Numbers of a row of the table, by name of the column."""
    names = "mio recall precision iou found right across height gauge rails tracks seconds".split()  # noqa: SIM905
    words = re.search(rf"^{re.escape(place)}\s(.*)$", text, re.MULTILINE)[1].split()
    return dict(zip(names, map(float, words))), words[len(names) :]


def test_railcloud_is_recognized_and_measured(benchmark, railcloud, capsys):
    pytest.importorskip("torch")
    benchmark.main([str(railcloud)])
    text = capsys.readouterr().out
    assert text.startswith("RailCloud-HdF: 2 places, class 5 is rail, EN_60E1_1435")
    whole, _ = figures(text, "all")
    first, standard = figures(text, "ACQ_286_Don_Lens_F_0+950_1+000")
    assert standard == ["EN_60E1_1435"]
    assert whole["recall"] > 0.95 and whole["precision"] > 0.90
    # Feet and webs are labelled as rail as well, and are never found.
    assert 0.2 < whole["iou"] < 0.9
    assert whole["found"] > 97 and whole["right"] > 99
    assert whole["across"] < 5 and whole["height"] < 5
    assert abs(whole["gauge"] - 1435) < 2
    assert whole["rails"] == pytest.approx(4 * 20, abs=2) and whole["tracks"] == pytest.approx(2 * 20, abs=2)
    repeated = text.splitlines()[-1]
    assert repeated.startswith("ACQ_286_Don_Lens_F, ACQ_289_Lille_Don_F")
    length_m, across, _, spread, height, _, spread_z = re.findall(r"[-\d.]+|±", repeated.split("_F ")[1])[:7]
    assert float(length_m) == pytest.approx(40, abs=2)
    assert abs(float(across)) < 1 and float(spread) < 3
    assert abs(float(height)) == pytest.approx(20, abs=1) and float(spread_z) < 3


def test_places_that_two_runs_cover_are_chosen_by_their_extent(benchmark, railcloud):
    _, places = benchmark.find_places(railcloud)
    assert [len(place.files) for place in places] == [2, 2]
    assert benchmark.covered_twice(places) == places
    with pytest.raises(benchmark.ParameterError, match="No place is covered by two runs"):
        benchmark.covered_twice(places[:1])


def test_semanticrail_has_iberian_gauge(benchmark, semantic, capsys):
    pytest.importorskip("torch")
    benchmark.main([str(semantic)])
    text = capsys.readouterr().out
    assert text.startswith("SemanticRail3D-V2: 1 places, class 1 is rail, EN_60E1_1668")
    found, standard = figures(text, "cloud180_Seg1")
    assert standard == ["EN_60E1_1668"]
    assert found["recall"] > 0.95 and found["found"] > 97 and found["right"] > 99
    assert abs(found["gauge"] - 1668) < 2


def test_an_iberian_track_is_detected_at_once(semantic):
    files = sorted(semantic.rglob("*.laz"))
    assert detect_standard(ask(files, [1])).name == IBERIAN.name


def test_a_wrong_class_of_rails_is_told(benchmark, semantic, capsys):
    pytest.importorskip("torch")
    benchmark.main([str(semantic), "--rail-class", "4"])
    assert "of class 1, not 4: if class 1 is rail, give --rail-class 1." in capsys.readouterr().out


def test_other_clouds_need_a_standard_and_folders_need_clouds(benchmark, tmp_path, semantic, capsys):
    with pytest.raises(SystemExit, match="has no LAS or LAZ files"):
        benchmark.main([str(tmp_path)])
    one = next(semantic.rglob("*.laz"))
    (tmp_path / "mine.laz").write_bytes(one.read_bytes())
    with pytest.raises(SystemExit, match="give --standard and --rail-class"):
        benchmark.main([str(tmp_path)])


def test_only_the_upper_part_of_labelled_rails_is_head(benchmark):
    place = np.array([[0.1, 0.1], [0.1, 0.12], [0.1, 0.15], [5.1, 0.1]])
    xyz = np.column_stack([place, [0.0, -0.03, -0.15, -1.0]])
    assert benchmark.on_heads(xyz).tolist() == [True, True, False, True]


def test_places_are_chosen_evenly(benchmark):
    assert benchmark.spread(list(range(10)), 4) == [0, 3, 6, 9]
    assert benchmark.spread(list(range(3)), 0) == [0, 1, 2]
