"""Labelled blocks on disk, from which the network learns, and those that are kept back for validation."""

from __future__ import annotations

import json
import zlib
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ..errors import ParameterError
from .blocks import centred, core_side, cut, thin

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
