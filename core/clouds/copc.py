"""The octree of COPC files: with it, only the chunks that an extent touches are read.

The layout is that of the COPC specification, version 1.0. laspy's reader of these files holds all points that it reads
in memory, and does not end where pages of a damaged octree refer to each other.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from .laz import Chunk
from .readers import Extent

if TYPE_CHECKING:
    import laspy

ENTRY = np.dtype([("level", "<i4"), ("key", "<i4", 3), ("at", "<u8"), ("size", "<i4"), ("points", "<i4")])
"""Entry of the octree: depth and place of a node, and position, bytes and points of its chunk."""

PAGE = -1
"""Number of points that marks an entry for another page of the octree."""

MAX_LEVEL = 30
"""Deepest level of an octree: below it, a node of a cloud 1000 km long is a millimetre wide."""


def chunks_in(
    path: Path, header: laspy.LasHeader, chunks: Sequence[Chunk], extent: Extent | np.ndarray
) -> tuple[Chunk, ...] | None:
    """List the chunks that may hold points of an extent, or of one of several, in the order of the file.

    Parameters
    ----------
    path : Path
    header : laspy.LasHeader
    chunks : sequence of Chunk
        From `laz.read_chunk_table`.
    extent : tuple of float, or (k, 4) array

    Returns
    -------
    tuple of Chunk or None
        None if the file has no octree, or one that does not account for every chunk of the file.
    """
    info = next(iter(header.vlrs.get("CopcInfoVlr")), None)
    if info is None:
        return None
    nodes = _nodes(path, info.hierarchy_root_offset, info.hierarchy_root_size)
    nodes = nodes[np.argsort(nodes["at"], kind="stable")]
    stated = np.array([(chunk.at, chunk.size, chunk.points) for chunk in chunks], dtype=np.int64).reshape(-1, 3).T
    found = np.stack([nodes["at"].astype(np.int64), nodes["size"], nodes["points"]])
    levels_fit = ((nodes["level"] >= 0) & (nodes["level"] <= MAX_LEVEL)).all()
    if not np.array_equal(found, stated) or not levels_fit or not np.isfinite([*info.center, info.halfsize]).all():
        return None
    side = 2 * info.halfsize / 2.0 ** nodes["level"]
    low = info.center[:2] - info.halfsize + nodes["key"][:, :2] * side[:, None]
    beyond = header.scales[:2]  # coordinates are rounded
    touched = np.zeros(len(low), dtype=bool)
    for area in np.reshape(extent, (-1, 4)):
        touched |= ((low - beyond <= area[2:]) & (low + side[:, None] + beyond >= area[:2])).all(axis=1)
    return tuple(Chunk(*one) for one in found.T[touched].tolist())


def _nodes(path: Path, root_at: int, root_size: int) -> np.ndarray:
    """Read the entries of all nodes with points, page by page; pages that are missing or repeated give none."""
    nodes, seen, pages = [np.empty(0, ENTRY)], set(), [(root_at, root_size)]
    length = path.stat().st_size
    with path.open("rb") as file:
        while pages:
            at, size = pages.pop()
            if at in seen or size <= 0 or at + size > length:
                continue
            seen.add(at)
            file.seek(at)
            entries = np.frombuffer(file.read(size - size % ENTRY.itemsize), ENTRY)
            nodes.append(entries[entries["points"] > 0])
            pages += [(int(one["at"]), int(one["size"])) for one in entries[entries["points"] == PAGE]]
    return np.concatenate(nodes)
