"""COPC files: LAZ files with an octree, as the readers meet them; laspy reads them only."""

from __future__ import annotations

import struct
from pathlib import Path
from unittest import mock

import laspy
import lazrs
import numpy as np
from laspy._compression import lazrsbackend

from ...core.clouds import laz

INFO_BYTES, ENTRY_BYTES, RECORD_HEADER_BYTES, LATE_HEADER_BYTES = 160, 32, 54, 60
"""Bytes of the record that describes the octree, of an entry in it, and of the headers of records."""


def write_copc(cloud: laspy.LasData, path: Path, low: np.ndarray, side_m: float, levels: int) -> tuple[int, int]:
    """Write a LAS 1.4 cloud, whose records change, as a COPC file, its points sorted into an octree.

    The octree has its least corner at `low` and this side, in units of the cloud. The level of a point is chosen at
    random, four times as many on each as on the one above, so that the nodes of a flat cloud hold about the same number
    of points. Returns the position of the only page of the octree in the file, and the number of its entries.
    """
    nodes, index = np.unique(_nodes_of(cloud.xyz - low, side_m, levels), axis=0, return_inverse=True)
    cloud.points = cloud.points[np.argsort(index.ravel(), kind="stable")]
    counts = np.bincount(index.ravel())
    cloud.header.vlrs.insert(0, laspy.VLR("copc", 1, "copc info", bytes(INFO_BYTES)))
    pages = laspy.VLR("copc", 1000, "hierarchy", bytes(ENTRY_BYTES * len(nodes)))
    cloud.evlrs = laspy.vlrs.vlrlist.VLRList([pages])
    with mock.patch.object(lazrsbackend, "LazrsPointWriter", _writer(counts)):
        cloud.write(path)
    with laspy.open(path) as reader:
        root_at = reader.header.start_of_first_evlr + LATE_HEADER_BYTES
        chunks = laz.read_chunk_table(path, reader.header)
    entries = b"".join(
        struct.pack("<4iQ2i", *node, one.at, one.size, one.points) for node, one in zip(nodes.tolist(), chunks)
    )
    half_m = side_m / 2
    info = struct.pack("<5d2Q2d", *(low + half_m), half_m, 1.0, root_at, len(entries), 0.0, 1.0)
    with path.open("r+b") as file:
        file.seek(path.read_bytes().index(b"copc\0") - 2 + RECORD_HEADER_BYTES)
        file.write(info)
        file.seek(root_at)
        file.write(entries)
    return root_at, len(nodes)


def _nodes_of(xyz: np.ndarray, side_m: float, levels: int) -> np.ndarray:
    """Return the node of each point, (n, 4): its level, and its place there."""
    share = 4.0 ** np.arange(levels)
    level = np.random.RandomState(2).choice(levels, len(xyz), p=share / share.sum())
    return np.column_stack([level, np.floor(xyz / (side_m / 2.0**level)[:, None])]).astype(np.int64)


def _writer(counts: np.ndarray) -> type:
    """Return a writer that ends a compressed chunk after each of these numbers of points."""

    class Writer(lazrsbackend.LazrsPointWriter):
        def __init__(self, dest, point_format, parallel):
            super().__init__(dest, point_format, parallel=False)
            self.vlr = lazrs.LazVlr.new_for_compression(point_format.id, point_format.num_extra_bytes, True)

        def write_points(self, points):
            for end, size in zip(np.cumsum(counts), counts):
                super().write_points(points[end - size : end])
                self.compressor.finish_current_chunk()

    return Writer
