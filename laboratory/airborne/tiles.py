"""Folders of tiles of 1 km², as national surveys publish them: every point of the ground, and a railway across them."""

from __future__ import annotations

import struct
from pathlib import Path

import numpy as np

from ..curves import Element, trace
from ..scenes.copc import write_copc
from ..scenes.tracks import Track
from .designs import SPACING_M
from .flight import AirborneCloud, Flight, fly
from .ground import STEP_M, World
from .write import ORIGIN, las_of, write_guides

TILE_M, COLUMNS = 1000.0, 8
"""Side of a tile, and the number of tiles in a row: a double track runs along each row."""

TRACKS_AT_M, NEAR_M = (498.0, 502.0), 20.0
"""Distances of the tracks from the lower edge of a tile, and that up to which the ground beside them is scanned; beyond
it, points are scattered evenly."""

GROUND_M, ROUGH_M = 99.1, 0.05
"""Height of the ground, and the standard deviation of its points."""

OFF_M, VERTEX_M = 0.7, 40.0
"""Standard deviation of the vertices of guides across, and their distance."""

LEVELS = 5
"""Of the octree: with 10 points per square metre, a node has about 30,000 points."""

OFFSETS_AT, BOUNDS_AT, INFO_AT = 155, 179, 375 + 54
"""Positions of the offsets and the bounds in the header of LAS 1.4, and of the centre of an octree."""


def lay_tiles(folder: Path, count: int, density: float, octree: bool = False) -> Path:
    """Write a folder of tiles, COPC files with `octree`, and return the guides beside it, two for each row.

    All tiles have the same points, `density` of them per square metre.
    """
    folder.mkdir()
    first = folder / ("tile_000.copc.laz" if octree else "tile_000.laz")
    points = las_of(_tile(density, 1))
    if octree:
        write_copc(points, first, ORIGIN, TILE_M, LEVELS)
    else:
        points.write(first)
    for number in range(1, count):
        shift = TILE_M * np.array(divmod(number, COLUMNS)[::-1])
        _copy(first, folder / first.name.replace("000", f"{number:03}"), shift, octree)
    guides = folder.with_suffix(".geojson")
    write_guides(_guides(count), guides)
    return guides


def _tile(density: float, seed: int) -> AirborneCloud:
    """Scan the ground along the tracks, and scatter points over the rest of the tile."""
    middle = trace([Element(TILE_M)], (0.0, TILE_M / 2), 0.0, STEP_M)
    tracks = [Track(middle, SPACING_M, 100.0, 0.0, left_m=at - TILE_M / 2) for at in TRACKS_AT_M]
    near = fly(World(tracks, seed=seed), middle.xy[::4], NEAR_M, Flight(density), seed)
    near_xyz = np.clip(near.xyz, [0.0, 0.0, -np.inf], [TILE_M - 0.001, TILE_M, np.inf])
    rng = np.random.RandomState(seed)
    far = rng.uniform(0.0, TILE_M, (int(density * TILE_M**2), 3))
    far = far[np.abs(far[:, 1] - TILE_M / 2) > NEAR_M]
    far[:, 2] = GROUND_M + rng.normal(0.0, ROUGH_M, len(far))
    strips = np.concatenate([near.strip, rng.randint(0, 2, len(far), dtype=near.strip.dtype)])
    order = np.argsort(np.floor(np.concatenate([near_xyz, far])[:, 1] / NEAR_M), kind="stable")  # as scan lines lie
    return AirborneCloud(np.concatenate([near_xyz, far])[order], strips[order])


def _copy(first: Path, path: Path, shift: np.ndarray, octree: bool) -> None:
    """Copy a tile to another place: its coordinates are those of the file and the offsets in its header."""
    data = bytearray(first.read_bytes())
    for at, moved in ((OFFSETS_AT, shift), (BOUNDS_AT, np.repeat(shift, 2)), *([(INFO_AT, shift)] if octree else [])):
        old = np.frombuffer(data, "<f8", len(moved), at)
        data[at : at + 8 * len(moved)] = struct.pack(f"<{len(moved)}d", *(old + moved))
    path.write_bytes(data)


def _guides(count: int) -> list[np.ndarray]:
    """Return lines along the tracks of all rows, relative to `ORIGIN`, whose vertices are off as in maps."""
    rng = np.random.RandomState(count)
    guides = []
    for row in range(-(-count // COLUMNS)):
        x = np.arange(0.0, TILE_M * min(COLUMNS, count - row * COLUMNS) + 1, VERTEX_M)
        for at in TRACKS_AT_M:
            y = np.full(len(x), row * TILE_M + at) + rng.normal(0.0, OFF_M, len(x))
            guides.append(np.column_stack([x, y]))
    return guides
