"""The one store of points on disk: sorted into the squares of a tiling, so that memory holds those of one square.

Each file of a cloud is read once, by a task that appends its points to files in a folder of its own.
"""

from __future__ import annotations

import uuid
from collections import Counter
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ..disk import writing
from .grid import Key


@dataclass(frozen=True)
class SortedFile:
    """The points of one file of a cloud, sorted into a folder with one file per square, and their number by square.

    Squares with points in their margin only have a file, too.
    """

    folder: str
    counts: Mapping[Key, int]

    @classmethod
    def new_folder(cls, folder: Path) -> Path:
        """Make the folder of an execution of a task: one that ended half-way has left its own."""
        mine = folder / uuid.uuid4().hex
        with writing(folder):
            mine.mkdir(parents=True)
        return mine


def append(folder: Path, key: tuple[int, ...], points: np.ndarray) -> str:
    """Append points to the file of a square, or of a square and other whole numbers; returns its name."""
    name = "_".join(map(str, key))
    with writing(folder.parent), (folder / name).open("ab") as file:
        file.write(points.data)
    return name


def counts_of(found: Iterable[SortedFile]) -> Counter[Key]:
    """Return the number of points of all files by square."""
    return sum((Counter(one.counts) for one in found), Counter())


def files_of(key: Key, found: Iterable[SortedFile]) -> list[str]:
    """List the files that may hold points of a square."""
    return [str(Path(one.folder, "_".join(map(str, key)))) for one in found]


def read_stored(files: Iterable[str], dtype: np.dtype) -> np.ndarray:
    """Read the points of a square, (n,) array of their type."""
    parts = [np.empty(0, np.uint8), *(np.fromfile(file, np.uint8) for file in files if Path(file).exists())]
    return np.concatenate(parts).view(dtype)  # joining bytes takes a fifth of the time that joining fields does
