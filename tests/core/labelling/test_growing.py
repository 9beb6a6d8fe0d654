"""Rails grown in files: tiles, messages about seeds, and what stays as it was."""

import numpy as np
import pytest
from heard import Heard
from rail_extract.core.clouds.header import list_tiles
from rail_extract.core.clouds.las import laspy
from rail_extract.core.clouds.points import ask
from rail_extract.core.disk import scratch_folder
from rail_extract.core.grow import growth as many_seeds
from rail_extract.core.grow.growth import Reason
from rail_extract.core.grow.heads import GrowSettings
from rail_extract.core.grow.start import find_start
from rail_extract.core.labelling.files import Content, plan_output
from rail_extract.core.labelling.growing import grow_files
from rail_extract.core.parameters import GrowParameters
from rail_extract.core.run.tasks import Runner
from rail_extract.core.standards import SEARCHED_CLASSES
from rail_extract.laboratory.scenes.las import write_las
from rail_extract.laboratory.scenes.raw_strips import GAUGE_M, SPACING_M, WIDTH_M, strip

CORNER = np.array([500_003.0, 5_000_008.0, 100.0])
TRACK = strip(24.0)
TEN = Content(10, reset=False)
SEED = CORNER[:2] + TRACK.at(12.0, SPACING_M / 2)


def save(path, xyz, codes=1):
    intensity = np.arange(len(xyz)) % 60_000
    where = {"offsets": CORNER, "scales": 0.0005}
    return write_las(path, xyz + CORNER, **where, classification=codes, intensity=intensity)


def grow(tmp_path, paths, output, seeds, choice=TEN, **changes):
    progress = Heard()
    planned = plan_output(paths, output, choice.class_code, progress)
    request = ask(paths, SEARCHED_CLASSES, None, None, progress)
    settings = GrowSettings(GAUGE_M, WIDTH_M, GrowParameters(**changes))
    seeds = [np.atleast_2d(seed) for seed in seeds]
    with scratch_folder(tmp_path) as work:
        return grow_files(request, seeds, settings, choice, planned, work, Runner(), progress), progress


def test_only_the_class_of_points_on_the_rails_changes(tmp_path):
    source = save(tmp_path / "raw.laz", TRACK.xyz, np.where(np.arange(len(TRACK.xyz)) % 7, 2, 10))
    result, progress = grow(tmp_path, [source], tmp_path / "new.las", [SEED])
    before, after = laspy.read(source), laspy.read(result.file)
    changed = np.asarray(after.classification) != np.asarray(before.classification)
    assert np.all(np.asarray(after.classification)[changed] == 10)
    assert (changed & TRACK.head).sum() > 0.96 * (TRACK.head & (before.classification != 10)).sum()
    assert (changed & ~TRACK.head).sum() < 0.03 * changed.sum()
    for name in ("X", "Y", "Z", "intensity"):
        assert np.array_equal(np.asarray(after[name]), np.asarray(before[name])), name
    figures = result.figures
    assert result.point_count == len(TRACK.xyz)
    assert figures.paired_m == pytest.approx(47.0, abs=2.0)
    assert figures.single_m == 0.0
    assert figures.cells_per_m > 30
    assert [stop.reason for stop in result.stops] == [Reason.CLOUD, Reason.CLOUD]
    assert sorted(stop.xyz[0] for stop in result.stops) == pytest.approx([500_003.5, 500_026.5], abs=1.0)
    assert any(text.endswith(": at both ends, the cloud ends.") for text in progress.infos)


def test_tiles_give_the_same_points_as_one_file(tmp_path):
    west = TRACK.xyz[:, 0] < 9.0
    tiles = tmp_path / "tiles"
    tiles.mkdir()
    save(tiles / "a.laz", TRACK.xyz[west])
    save(tiles / "b.laz", TRACK.xyz[~west])
    one, _ = grow(tmp_path, [save(tmp_path / "raw.laz", TRACK.xyz)], tmp_path / "one.las", [SEED])
    several, _ = grow(tmp_path, [tiles], tmp_path / "several.vpc", [SEED])
    codes = np.asarray(laspy.read(one.file).classification)
    for path, own in zip(list_tiles(several.file), (west, ~west)):
        assert np.array_equal(np.asarray(laspy.read(path).classification), codes[own])


def test_a_second_run_adds_to_the_first(tmp_path):
    source = save(tmp_path / "raw.las", TRACK.xyz)
    first, _ = grow(tmp_path, [source], tmp_path / "first.las", [SEED], both=False)
    right = CORNER[:2] + TRACK.at(12.0, -SPACING_M / 2)
    second, _ = grow(tmp_path, [first.file], tmp_path / "second.las", [right], both=False)
    both, _ = grow(tmp_path, [source], tmp_path / "both.las", [SEED])
    rails = [np.asarray(laspy.read(one.file).classification) == 10 for one in (first, second, both)]
    assert rails[0].sum() < 0.6 * rails[1].sum()
    assert np.mean(rails[1] == rails[2]) > 0.999


def test_two_seeds_on_one_track_count_its_length_once(tmp_path):
    source = save(tmp_path / "raw.las", TRACK.xyz)
    seeds = [SEED, CORNER[:2] + TRACK.at(8.0, SPACING_M / 2), CORNER[:2] + TRACK.at(6.0, 0.0)]
    result, progress = grow(tmp_path, [source], tmp_path / "new.las", seeds)
    assert result.figures.paired_m == pytest.approx(47.0, abs=2.5)
    assert "1 of 3 seeds are not on a rail: move them onto railheads." in progress.warnings
    assert len(result.stops) == 2


def test_a_line_reaches_on_beyond_the_longest_run(tmp_path):
    long = strip(60.0)
    source = save(tmp_path / "raw.las", long.xyz)
    line = CORNER[:2] + [long.at(s, SPACING_M / 2) for s in (5.0, 30.0, 55.0)]
    alone, _ = grow(tmp_path, [source], tmp_path / "alone.las", [line[:1]], max_length_m=12.0)
    whole, _ = grow(tmp_path, [source], tmp_path / "whole.las", [line], max_length_m=12.0)
    assert alone.figures.paired_m == pytest.approx(2 * 17.0, abs=4.0)
    assert whole.figures.paired_m == pytest.approx(2 * 59.0, abs=3.0)


def test_places_of_a_line_outside_of_the_cloud_are_not_looked_at(tmp_path, monkeypatch):
    source = save(tmp_path / "raw.las", TRACK.xyz)
    looked_at = []
    monkeypatch.setattr(
        many_seeds, "find_start", lambda heads, place, own: looked_at.append(place) or find_start(heads, place, own)
    )
    line = CORNER[:2] + [TRACK.at(s, SPACING_M / 2) for s in (-90_000.0, 12.0, 90_000.0)]
    result, progress = grow(tmp_path, [source], tmp_path / "new.las", [line])
    assert result.figures.paired_m == pytest.approx(47.0, abs=2.5)
    assert len(looked_at) < 5
    assert not any("not on a rail" in text for text in progress.warnings)
