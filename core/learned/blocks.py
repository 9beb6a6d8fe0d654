"""What the network is given: the points of a square thinned by height zone and cut into blocks, and their neighbours.

Gribov and Chang, section 3: a zone of heights in which rails lie, thinned ground, blocks of 4 x 4 m with at most 3000
points each. The points of a block are in random order, so each layer of the network keeps the first quarter of those of
the layer before. Labelled blocks, from which the network learns, are on disk; some are kept back for validation.
"""

from __future__ import annotations

import json
import math
import zlib
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.spatial import cKDTree

from ..classify.bed import Bed, Coarse
from ..classify.tops import HIGH_M, LOW_M, TOP_M
from ..errors import ParameterError
from ..tiles.grid import Tiling

BLOCK_M = 4.0
"""Side of a block: it holds both rails of a track of any gauge."""

CORE_M = 3.0
"""Largest side of the middle of a block, whose points are labelled: those nearer to its border lack surroundings."""

MAX_POINTS = 3000
"""Most points of a block; one with more becomes several blocks of the same place, each with a part of its points."""

LEAST_M = -0.20
"""Height above the bed from which points are used."""

RAIL_VOXEL_M, CONTEXT_VOXEL_M = 0.05, 0.20
"""One point is kept of each cube of this side, in the zone of railheads and outside of it. A cloud from a train and one
from the air are then almost equally dense; the ground and what stands higher are surroundings only."""

SHUFFLE_SEED = 20_20
"""Of the order in which points are dropped from layer to layer: random, but the same for the same points."""

NEIGHBOURS = 16
"""Nearest points that each point looks at, itself included; Hu et al. use as many."""

RATIO = 4
"""Points of a layer for each one of the next layer."""

LAYERS = 4
"""Levels of the pyramid, each coarser than the one below it."""

POINT = np.dtype([("place", "<f4", 4), ("rail", "?"), ("core", "?"), ("rails", "<i4"), ("others", "<i4")])
"""A point of a block: place as `blocks.centred` gives it, its label, whether it lies in the core, and the numbers of
rail points and other points that it stands for."""

ENTRY = np.dtype(
    [("file", "<i4"), ("start", "<i8"), ("count", "<i4"), ("area", "<i8", 2), ("tile", "<i4"), ("rail", "<i4")]
)
"""A block in the index: file of the square, first point and number of points in it, area, tile of the cloud that most
of its points come from, and number of rail points in the core."""

AREAS = 2
"""Areas along a side of a square: places of some 20 m are kept back together, because neighbouring blocks show the same
rails."""

VALIDATION_SHARE = 0.2
"""Share of the areas kept back, at least one, with rails and without."""

INDEX = "index.npy"

CHECKS = "checks.json"
"""File with the checksums of all others, written last."""


@dataclass(frozen=True)
class Thinned:
    """The points of a square that the network sees, and the cells in which the bed was found.

    `number`, (n,), are their numbers among the points of the square, in an order that depends on their places only.
    `place`, (n, 4) float32, is in metres from the square's corner, the height counting from a multiple of
    `ORIGIN_STEP`, and the height above the bed. `railhigh`, (n,), are points in the zone of railheads; only these can
    be on rails. `band`, (m,), are the numbers of all points of the square in this zone, `band_place`, (m, 3), their
    places, and `stands_for`, (m,), the thinned point of their cube.
    """

    number: np.ndarray
    place: np.ndarray
    railhigh: np.ndarray
    band: np.ndarray
    band_place: np.ndarray
    stands_for: np.ndarray
    coarse: Coarse


@dataclass(frozen=True)
class Block:
    """Points that go through the network together, with the column and row of the block in the square.

    `number`, (n,), are their numbers among the thinned points, in the order in which layers drop them, the last ones
    first. `core`, (n,), are the points in the middle of the block that can be on rails; those of all blocks of a square
    cover it once.
    """

    number: np.ndarray
    core: np.ndarray
    key: tuple[int, int]


def thin(xyz: np.ndarray) -> Thinned:
    """Find the heights above the bed and thin the points, (n, 3) as in `classify.square.classify_square`."""
    bed, height, _, z = Bed.under(xyz)
    used = np.flatnonzero((height >= LEAST_M) & (height <= HIGH_M))
    place = np.column_stack([xyz[used, :2], z[used], height[used]]).astype(np.float32)
    railhigh = (place[:, 3] >= LOW_M) & (place[:, 3] <= TOP_M)
    band, context = np.flatnonzero(railhigh), np.flatnonzero(~railhigh)
    chosen, stands_for = _one_of_each(place[band], RAIL_VOXEL_M)
    kept = np.concatenate([band[chosen], context[_one_of_each(place[context], CONTEXT_VOXEL_M)[0]]])
    return Thinned(used[kept], place[kept], railhigh[kept], used[band], place[band, :3], stands_for, bed.coarse)


def _one_of_each(place: np.ndarray, side_m: float) -> tuple[np.ndarray, np.ndarray]:
    """Choose the point nearest to the middle of each cube; returns them, (k,) int, and the cube of each point, (n,).

    Points at the same distance are ordered by their places, so the choice does not depend on the order of the points.
    """
    scaled = place[:, :3].astype(float) / side_m
    cube = np.floor(scaled)
    off = np.square(scaled - cube - 0.5).sum(axis=1)
    order = np.lexsort((*place.T, off, *cube.T))
    first = np.ones(len(order), dtype=bool)
    first[1:] = np.any(np.diff(cube[order], axis=0) != 0, axis=1)
    number = np.empty(len(order), dtype=np.int64)
    number[order] = np.cumsum(first) - 1
    return order[first], number


def cut(thinned: Thinned, side_m: float) -> list[Block]:
    """Cut a square of `side_m` into blocks; places without a point in the zone of railheads are left out."""
    core_m = core_side(side_m)
    margin_m = min((BLOCK_M - core_m) / 2, core_m / 2 - 1e-6)
    inside = np.all((thinned.place[:, :2] >= 0) & (thinned.place[:, :2] < side_m), axis=1)
    labelled = inside & thinned.railhigh
    place = thinned.place[:, :2].astype(float)
    own = {key: numbers[labelled[numbers]] for key, numbers in Tiling(core_m).sort(place).items()}
    around = Tiling(core_m, margin_m).sort(place)
    blocks = []
    for key, core in own.items():
        if len(core):
            blocks += _parts(np.sort(around[key]), core, key)
    return blocks


def core_side(side_m: float) -> float:
    """Return the side of the cores that divide a square, metres."""
    return side_m / math.ceil(side_m / CORE_M)


def _parts(numbers: np.ndarray, core: np.ndarray, key: tuple[int, int]) -> list[Block]:
    """Shuffle the points of a block and divide them among as few blocks as can hold them."""
    shuffled = numbers[np.random.RandomState(SHUFFLE_SEED).permutation(len(numbers))]
    count = math.ceil(len(shuffled) / MAX_POINTS)
    parts = (shuffled[first::count] for first in range(count))
    blocks = (Block(part, np.isin(part, core, assume_unique=True), key) for part in parts)
    return [block for block in blocks if block.core.any()]


def centred(place: np.ndarray) -> np.ndarray:
    """Move the places of a block's points, (n, 4), to their middle in plan and their mean height, (n, 4) float32."""
    middle = np.append((place[:, :2].max(axis=0) + place[:, :2].min(axis=0)) / 2, place[:, 2].mean(dtype=float))
    return np.column_stack([place[:, :3] - middle, place[:, 3]]).astype(np.float32)


@dataclass(frozen=True)
class PointLayer:
    """The points of a layer, those of all blocks behind each other.

    `position`, (n, 3) float32, is in metres from the middle of the block. `near`, (n, NEIGHBOURS), are the numbers of
    the nearest points of the same block; a block with fewer repeats them. `kept`, (m,), are the numbers of the points
    that the next layer has, and `nearest`, (n,), is the number there of the nearest one for each point.
    """

    position: np.ndarray
    near: np.ndarray
    kept: np.ndarray
    nearest: np.ndarray


def build(blocks: Sequence[np.ndarray]) -> list[PointLayer]:
    """Find the neighbours of the points of blocks, (n, 3) each, on all layers."""
    layers = []
    for _ in range(LAYERS):
        parts = [_layer(position) for position in blocks]
        starts = np.cumsum([0, *(len(part.position) for part in parts)])
        next_starts = np.cumsum([0, *(len(part.kept) for part in parts)])
        layers.append(
            PointLayer(
                np.concatenate([part.position for part in parts]),
                np.concatenate([part.near + start for part, start in zip(parts, starts)]),
                np.concatenate([part.kept + start for part, start in zip(parts, starts)]),
                np.concatenate([part.nearest + start for part, start in zip(parts, next_starts)]),
            )
        )
        blocks = [part.position[part.kept] for part in parts]
    return layers


def _layer(position: np.ndarray) -> PointLayer:
    """Find the neighbours within one block."""
    count = len(position)
    near = cKDTree(position).query(position, k=np.arange(1, min(NEIGHBOURS, count) + 1))[1]
    near = np.resize(near.T, (NEIGHBOURS, count)).T if count < NEIGHBOURS else near
    kept = np.arange(-(-count // RATIO))
    nearest = cKDTree(position[kept]).query(position)[1]
    return PointLayer(position, near.astype(np.int64), kept, nearest.astype(np.int64))


@dataclass(frozen=True)
class Plan:
    """What a training is given, besides the cloud: classes of the rail points, and the device, AUTO, CPU or CUDA.

    Each block with rails is learned from in every epoch; `start` has weights to start from.
    """

    rail_classes: tuple[int, ...]
    epochs: int
    seed: int
    device: str
    start: Path | None = None


@dataclass(frozen=True)
class Examples:
    """Labelled blocks in a folder, and their index, an (n,) array of ENTRY."""

    folder: Path
    index: np.ndarray

    @classmethod
    def load(cls, folder: Path) -> Examples:
        """Read the index of blocks that `save_index` has completed; ValueError if a file is missing or damaged."""
        if (folder / CHECKS).read_bytes() != _checks(folder):
            raise ValueError(f"{folder} is damaged")
        return cls(folder, np.load(folder / INDEX))

    def block(self, number: int) -> np.ndarray:
        """Read a block, (n,) array of POINT."""
        entry = self.index[number]
        points = np.load(_square_file(self.folder, int(entry["file"])), mmap_mode="r")
        return np.array(points[entry["start"] : entry["start"] + entry["count"]])

    def validation(self, seed: int) -> np.ndarray:
        """Choose the blocks that are kept back, (n,) bool; raise ParameterError if no two areas have rails."""
        areas, area = np.unique(self.index["area"], axis=0, return_inverse=True)
        has_rail = np.bincount(area.ravel(), self.index["rail"]) > 0
        if has_rail.sum() < 2:
            raise ParameterError(
                "The labelled rails all lie in one place of 20 m: give a longer labelled cloud, so that a part can be "
                "kept back for validation."
            )
        kept_back = np.zeros(len(areas), dtype=bool)
        rng = np.random.RandomState(seed)
        for group in (np.flatnonzero(has_rail), np.flatnonzero(~has_rail)):
            count = max(round(VALIDATION_SHARE * len(group)), 1)
            kept_back[rng.permutation(group)[:count]] = True
        return kept_back[area.ravel()]


def write_square(
    folder: Path, file: int, key: tuple[int, int], side_m: float, xyz: np.ndarray, rail: np.ndarray, tile: np.ndarray
) -> np.ndarray:
    """Write the blocks of a square, given the number of its file, and its column and row; return (k,) of ENTRY.

    Points are (n, 3) as in `classify.square.classify_square`, with their label and the number of their tile of the
    cloud, (n,) each.
    """
    thinned = thin(xyz)
    labels, count = rail[thinned.band], len(thinned.number)
    rails = np.bincount(thinned.stands_for[labels], minlength=count)
    others = np.bincount(thinned.stands_for[~labels], minlength=count)
    rail, tile = rail[thinned.number], tile[thinned.number]
    blocks = cut(thinned, side_m)
    entries = np.zeros(len(blocks), ENTRY)
    parts = [np.empty(0, POINT)]
    start = 0
    for entry, block in zip(entries, blocks):
        points = np.empty(len(block.number), POINT)
        points["place"] = centred(thinned.place[block.number])
        points["rail"], points["core"] = rail[block.number], block.core
        points["rails"], points["others"] = rails[block.number], others[block.number]
        middle = (np.array(block.key) + 0.5) * core_side(side_m) / side_m
        entry["area"] = np.multiply(key, AREAS) + np.floor(AREAS * middle).astype(np.int64)
        entry["tile"] = np.bincount(tile[block.number]).argmax()
        entry["file"], entry["start"], entry["count"] = file, start, len(points)
        entry["rail"] = (points["rail"] & points["core"]).sum()
        parts.append(points)
        start += len(points)
    np.save(_square_file(folder, file), np.concatenate(parts))
    return entries


def save_index(folder: Path, index: np.ndarray) -> None:
    """Write the index of blocks, (n,) of ENTRY, and that all files are complete."""
    np.save(folder / INDEX, index)
    (folder / CHECKS).write_bytes(_checks(folder))


def _checks(folder: Path) -> bytes:
    """Return the checksums of the files of blocks and of their index."""
    files = sorted(folder.glob(f"*{Path(INDEX).suffix}"))
    return json.dumps({file.name: zlib.crc32(file.read_bytes()) for file in files}).encode()


def _square_file(folder: Path, file: int) -> Path:
    return folder / f"{file}.npy"
