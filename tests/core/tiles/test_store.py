"""The store of points: every point is in its square, and in the margins of its neighbours, from all files."""

import os
import re
import shutil
import tracemalloc
from dataclasses import replace

import numpy as np
import pytest
from heard import Heard
from hypothesis import given
from hypothesis import strategies as st
from rail_extract.core.clouds.points import ask, read_rail_points
from rail_extract.core.errors import Cancelled, NoRailPointsError
from rail_extract.core.frame import LocalFrame
from rail_extract.core.progress import Progress
from rail_extract.core.tiles.grid import MemorySource, Square, Tiling, lay_out
from rail_extract.core.tiles.store import (
    Census,
    SortedFile,
    SpooledPoints,
    append,
    counts_of,
    files_of,
    fingerprint,
    read_stored,
    spool,
)
from rail_extract.laboratory.scenes.las import las_data, write_las

POINT = np.dtype([("xyz", "<f8", 3), ("number", "<i8")])

SIDE, CORNER = 30.0, [500_000, 5_400_000, 0]


def stored(folder, xyz, tiling, chunks=3):
    """Sort points on disk as a task sorts those of a file: chunk by chunk, into a folder of its own."""
    mine, counts = SortedFile.new_folder(folder), {}
    for numbers in np.array_split(np.arange(len(xyz)), chunks):
        points = np.empty(len(numbers), POINT)
        points["xyz"], points["number"] = xyz[numbers], numbers
        for key, chosen in tiling.sort(points["xyz"]).items():
            append(mine, key, points[chosen])
            counts[key] = counts.get(key, 0) + len(chosen)
    return SortedFile(str(mine), counts)


@given(st.integers(0, 2**32 - 1), st.floats(1, 300), st.floats(0, 0.49))
def test_a_square_holds_all_points_in_it_and_in_its_margin(seed, side_m, share):
    random = np.random.default_rng(seed)
    xyz, tiling = random.uniform(-500, 500, (200, 3)), Tiling(side_m, share * side_m)
    keys, number = Tiling(side_m).keys(xyz)
    for key, chosen in tiling.sort(xyz).items():
        low = np.multiply(key, side_m) - tiling.margin_m
        inside = ((xyz[:, :2] >= low) & (xyz[:, :2] < low + side_m + 2 * tiling.margin_m)).all(axis=1)
        near_border = (
            np.abs(np.stack([xyz[:, :2] - low, xyz[:, :2] - low - side_m - 2 * tiling.margin_m])) < 1e-9
        ).any()
        assert near_border or np.sort(chosen).tolist() == np.flatnonzero(inside).tolist()
    assert all(set(np.flatnonzero(number == at)) <= set(tiling.sort(xyz)[key]) for at, key in enumerate(keys))


def test_points_of_all_files_come_back_with_their_square(tmp_path):
    random = np.random.default_rng(3)
    tiling = Tiling(40.0, 5.0)
    clouds = [random.uniform(-100, 100, (500, 3)), random.uniform(-60, 140, (400, 3))]
    files = [stored(tmp_path, xyz, tiling) for xyz in clouds]
    counts = counts_of(files)
    assert set(counts) == {key for xyz in clouds for key in tiling.sort(xyz)}
    for key, count in counts.items():
        points = read_stored(files_of(key, files), POINT)
        own = [tiling.sort(xyz).get(key, np.empty(0, int)) for xyz in clouds]
        assert len(points) == count == sum(map(len, own))
        expected = np.concatenate([xyz[one] for xyz, one in zip(clouds, own)])
        assert np.array_equal(np.sort(points["xyz"], axis=0), np.sort(expected, axis=0))
    assert len(read_stored(files_of((99, 99), files), POINT)) == 0


def test_what_a_worker_left_half_way_is_not_read(tmp_path):
    tiling, xyz = Tiling(40.0), np.random.default_rng(1).uniform(0, 40, (50, 3))
    stored(tmp_path, xyz, tiling)
    again = stored(tmp_path, xyz, tiling)
    assert len(read_stored(files_of((0, 0), [again]), POINT)) == 50


@pytest.fixture
def files(tmp_path):
    """Two files with points of two classes along a slanted line."""
    along = np.random.RandomState(0).uniform(0, 100, 6000)
    xyz = np.column_stack([500_000 + along, 5_400_000 - 0.7 * along, 300 + 0.01 * along])
    codes = np.random.RandomState(1).choice([2, 10, 11], 6000).astype(np.uint8)
    folder = tmp_path / "cloud"
    folder.mkdir()
    for number, part in enumerate((along < 47, along >= 47)):
        write_las(folder / f"{number}.laz", xyz[part], offsets=CORNER, classification=codes[part])
    return folder


def test_disk_and_memory_give_the_same_points_in_the_same_frame(files, tmp_path):
    spooled = spool(ask(files, [10, 11]), SIDE, tmp_path)
    read = read_rail_points(files, [10, 11])
    assert [one.class_code for one in spooled] == [one.class_code for one in read] == [10, 11]
    for source, points in zip(spooled, read):
        np.testing.assert_array_equal(source.frame.origin, points.frame.origin)
        memory = MemorySource(points, SIDE)
        assert source.counts == memory.counts
        assert source.span_m == pytest.approx(memory.span_m, abs=1e-6)
        for square in lay_out([source], source):
            one, two = source.near(square, 7.0).xyz, memory.near(square, 7.0).xyz
            np.testing.assert_allclose(one[np.lexsort(one.T)], two[np.lexsort(two.T)], rtol=0, atol=1e-8)
        whole = source.near(Square((0, 0), source.frame, np.inf), 0.0).xyz
        np.testing.assert_array_equal(whole[np.lexsort(whole.T)], points.xyz[np.lexsort(points.xyz.T)])


def test_files_that_have_not_changed_are_not_read_again(files, tmp_path):
    first = spool(ask(files, [10]), SIDE, tmp_path)
    kept = {file: file.stat().st_mtime_ns for file in tmp_path.rglob("10_*")}
    second = spool(ask(files, [10]), SIDE, tmp_path)
    assert {file: file.stat().st_mtime_ns for file in tmp_path.rglob("10_*")} == kept
    assert second[0].counts == first[0].counts and second[0].span_m == first[0].span_m
    np.testing.assert_array_equal(second[0].frame.origin, first[0].frame.origin)


def test_an_interrupted_reading_starts_again(files, tmp_path):
    with pytest.raises(Cancelled):
        spool(ask(files, [10]), SIDE, tmp_path, Heard(cancel_after=1))
    again = spool(ask(files, [10]), SIDE, tmp_path)
    assert sum(again[0].counts.values()) == len(read_rail_points(files, [10])[0].xyz)


def test_two_readers_of_one_file_do_not_disturb_each_other(files, tmp_path):
    class Racing(Progress):
        others = 0

        def is_cancelled(self):
            if not self.others:
                self.others = sum(spool(ask(files, [10]), SIDE, tmp_path)[0].counts.values())
            return False

    progress = Racing()
    (source,) = spool(ask(files, [10]), SIDE, tmp_path, progress)
    expected = len(read_rail_points(files, [10])[0].xyz)
    assert sum(source.counts.values()) == progress.others == expected
    assert len(source.near(Square((0, 0), source.frame, np.inf), 0.0).xyz) == expected
    assert len([folder for folder in tmp_path.iterdir() if folder != files]) == 2


def test_an_extent_and_missing_classes(files, tmp_path):
    extent = (500_000, 5_399_900, 500_020, 5_400_000)
    (part,) = spool(ask(files, [10], extent=extent), SIDE, tmp_path)
    assert sum(part.counts.values()) == len(read_rail_points(files, [10], extent=extent)[0].xyz)
    with pytest.raises(NoRailPointsError, match="2 .*10 .*11"):
        spool(ask(files, [7]), SIDE, tmp_path)


def test_a_file_of_the_same_size_that_has_changed_is_read_again(tmp_path):
    file, folder = tmp_path / "cloud.las", tmp_path / "points"
    folder.mkdir()

    def write(count, time):
        codes = np.where(np.arange(100) < count, 10, 2)
        write_las(file, np.tile([500_001.0, 5_400_001.0, 0.0], (100, 1)), offsets=CORNER, classification=codes)
        os.utime(file, (time, time))
        return file.stat().st_size

    sizes, counts = [], []
    for count, time in ((40, 1_000_000_000), (70, 1_000_000_001)):
        sizes.append(write(count, time))
        (source,) = spool(ask(file, [10]), SIDE, folder)
        counts.append(sum(source.counts.values()))
    assert sizes[0] == sizes[1]
    assert counts == [40, 70]


def cut(path):
    path.write_bytes(path.read_bytes()[:-24])


def change(path):
    data = bytearray(path.read_bytes())
    data[len(data) // 2] ^= 1
    path.write_bytes(data)


def put_a_folder(path):
    path.unlink()
    path.mkdir()


@pytest.mark.parametrize(
    "damage", [cut, change, put_a_folder, lambda path: path.unlink(), lambda path: path.write_text("{}")]
)
@pytest.mark.parametrize("what", ["report.json", "10_*"])
def test_damaged_points_are_read_again_with_a_warning(files, tmp_path, damage, what):
    work = tmp_path / "work"
    work.mkdir()
    first = spool(ask(files, [10]), SIDE, work)
    before = {file: file.read_bytes() for file in work.rglob("*") if file.is_file()}
    damage(sorted(work.rglob(what))[0])
    heard = Heard()
    second = spool(ask(files, [10]), SIDE, work, heard)
    (warning,) = heard.warnings
    assert re.fullmatch(r"The stored points of [01]\.laz are damaged: the file is read again\.", warning)
    assert second[0].counts == first[0].counts
    assert {file: file.read_bytes() for file in work.rglob("*") if file.is_file()} == before


def test_a_file_in_place_of_the_points_is_replaced(files, tmp_path):
    work = tmp_path / "work"
    work.mkdir()
    first = spool(ask(files, [10]), SIDE, work)
    for folder in list(work.iterdir()):
        shutil.rmtree(folder)
        folder.write_text("no folder")
    assert spool(ask(files, [10]), SIDE, work)[0].counts == first[0].counts


def test_points_keep_their_strips(tmp_path):
    random, folder = np.random.RandomState(2), tmp_path / "cloud"
    folder.mkdir()
    xyz = random.uniform(0, 1, (4000, 3)) * [80.0, 20.0, 0.02] + [500_000, 5_400_000, 300]
    strips = np.where(xyz[:, 0] < 500_060, random.choice([0, 7], 4000), 9)
    cloud = las_data(xyz, offsets=CORNER, classification=10, point_source_id=strips)
    cloud.header.file_source_id = 4
    cloud.write(folder / "a.laz")
    expected = np.where(strips == 0, 4, strips)  # a point without a source id has that of its file
    (points,) = read_rail_points(folder, [10])
    np.testing.assert_array_equal(points.strips, expected)
    (source,) = spool(ask(folder, [10]), SIDE, tmp_path)
    for one in (source, MemorySource(points, SIDE)):
        whole = one.near(Square((0, 0), points.frame, np.inf), 0.0)
        order, wanted = np.lexsort(whole.xyz.T), np.lexsort(points.xyz.T)
        np.testing.assert_array_equal(whole.strips[order], expected[wanted])
        near = [one.near(square, 3.0) for square in lay_out([one], one)]
        for part in near:
            assert part.strips is None or len(part.strips) == len(part.xyz)
        assert {4, 7, 9} == {int(one) for part in near if part.strips is not None for one in part.strips}


def test_points_at_one_place_are_read_with_few_copies(tmp_path):
    """A cloud that lies in one square is held as stored and in local metres, and with the place of each point."""
    points = np.random.RandomState(0).uniform(0, 1, (200_000, 3)) * [SIDE, 0.06, 0.02]
    points.tofile(tmp_path / "10_0_0_0")
    square = Square.on_grid((0, 0), SIDE, LocalFrame(np.zeros(3)))
    files = {(0, 0): (str(tmp_path / "10_0_0_0"),)}
    source = SpooledPoints(square.frame, 10, SIDE, {(0, 0): len(points)}, SIDE, files, {0: 1})
    tracemalloc.start()
    try:
        near = source.near(square, 0.0)
        _, peak = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
    np.testing.assert_array_equal(near.xyz, points)
    assert peak < 4 * points.nbytes


def test_the_order_of_classes_counts_where_the_first_one_holds_all_points(files):
    request = ask(files, [10, 11])
    names = set()
    for merged, codes in ((False, (10, 11)), (False, (11, 10)), (True, (10, 11)), (True, (11, 10))):
        names.add(fingerprint(replace(request, merged=merged, class_codes=codes), request.headers[0], SIDE))
    assert len(names) == 3


def test_a_part_without_points_counts_nothing(tmp_path):
    census, frame = Census(), LocalFrame(np.zeros(3))
    census.add(10, np.empty((0, 3)), np.empty(0, dtype=int), frame, SIDE, tmp_path)
    assert census.report()["classes"] == {}
    census.add(10, np.ones((2, 3)), np.zeros(2, dtype=int), frame, SIDE, tmp_path)
    assert list(census.report()["classes"]) == ["10"]


def test_the_points_of_some_strips_are_the_same_on_disk_and_in_memory(tmp_path):
    along = np.random.RandomState(0).uniform(0, 100, 3000)
    xyz = np.column_stack([500_000 + along, 5_400_000 - 0.7 * along, np.full(3000, 300.0)])
    ids = np.random.RandomState(1).choice(np.array([4, 7, 9], np.uint16), 3000)
    file = write_las(tmp_path / "strips.laz", xyz, offsets=CORNER, classification=10, point_source_id=ids)
    (spooled,), (points,) = spool(ask([file], [10]), SIDE, tmp_path), read_rail_points([file], [10])
    memory = MemorySource(points, SIDE)
    for among in (True, False):
        one, two = spooled.of_strips([4, 9], among), memory.of_strips([4, 9], among)
        assert one.counts == two.counts
        assert sum(one.counts.values()) == np.count_nonzero(np.isin(ids, [4, 9]) == among)
        for square in lay_out([one], one):
            assert len(one.near(square, 7.0).xyz) == len(two.near(square, 7.0).xyz)
