"""The store of points: every point is in its square, and in the margins of its neighbours, from all files."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from rail_extract.core.tiles.grid import Tiling
from rail_extract.core.tiles.store import SortedFile, append, counts_of, files_of, read_stored

POINT = np.dtype([("xyz", "<f8", 3), ("number", "<i8")])


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
