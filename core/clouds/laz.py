"""Reader of the chunks of compressed clouds (LAZ, COPC), which are checked before they are decompressed.

lazrs allocates whatever a file states, and the program ends if that fails or if a chunk makes lazrs call itself without
end. Every size in a file is therefore compared with the size of the file first, and every chunk is searched for bytes
that no encoder writes. The layout of chunks is that of LASzip's specification, version 1.4 R15.

The octree of COPC files, version 1.0, states where each chunk lies. laspy's reader of these files holds all
points that it reads in memory, and does not end where pages of a damaged octree refer to each other.
"""

from __future__ import annotations

import struct
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from os import SEEK_END
from pathlib import Path
from typing import TYPE_CHECKING, BinaryIO

import numpy as np

from ..errors import CloudError
from ..progress import SILENT, Progress
from .header import Extent

if TYPE_CHECKING:
    import laspy

try:
    import lazrs
except ImportError:
    lazrs = None

AT_THE_END = -1
"""Stands in for the position of the chunk table if the writer could not seek back: the last 8 bytes of the file then
hold the position."""

MAX_CHUNK = 2**28
"""Largest unpacked chunk in bytes; writers use 50,000 points, about 2 MB."""

LAYERED = 3
"""Compressor of point formats 6 to 10: each chunk consists of layers, whose sizes are stated at its start."""

LAYERS = {10: 9, 11: 1, 12: 2, 13: 1}
"""Layers by the type of a compressed item: point, colour, colour with infrared, waveform."""

EXTRA_BYTES = 14
"""Type of the item that has one layer for each byte."""

COMPRESSOR, ITEM_COUNT, ITEMS_AT, ITEM = "<H", "<H", 34, "<HHH"
"""Parts of the LASzip record: its first and last numbers, then type, size and version of each item."""

FIRST_CHUNK = 8
"""Bytes between the start of the point data and the first chunk: the position of the chunk table."""

TIMES_LAYER = 8
"""Number of the layer of GPS times."""

ERASED = b"\xff"
"""Byte of which storage consists where nothing was written. lazrs decodes a run of them as one change after another
between sequences of GPS times, calls itself for each, and ends the program after some 30,000; encoders write one change
in a row."""

MAX_ERASED, MAX_ERASED_TIMES = 15, 6
"""Longest run of erased bytes that is decompressed: in chunks without layers, where runs from 32 bytes have ended the
program, and in layers of GPS times, where runs from 8 have. By chance, 7 such bytes occur once in 70 million GB."""

ENTRY = np.dtype([("level", "<i4"), ("key", "<i4", 3), ("at", "<u8"), ("size", "<i4"), ("points", "<i4")])
"""Entry of the octree: depth and place of a node, and position, bytes and points of its chunk."""

PAGE = -1
"""Number of points that marks an entry for another page of the octree."""

MAX_LEVEL = 30
"""Deepest level of an octree: below it, a node of a cloud 1000 km long is a millimetre wide."""


@dataclass(frozen=True)
class Chunk:
    """A compressed chunk of points: its position in the file, bytes, and number of points."""

    at: int
    size: int
    points: int


def read_chunk_table(path: Path, header: laspy.LasHeader) -> tuple[Chunk, ...]:
    """Read the table of chunks, and refuse a file whose chunks do not fit it or do not hold the stated points.

    Raises CloudError if the file is cut off or damaged, or the package that reads LAZ is missing.
    """
    if lazrs is None:
        raise CloudError(
            f"{path.name} is compressed, and the Python package that reads LAZ is missing: run pip install lazrs, or "
            "export the cloud as LAS."
        )
    size, vlr = path.stat().st_size, lazrs.LazVlr(_record(path, header))
    with path.open("rb") as file:
        table_at = _find_table(file, header.offset_to_point_data)
        if not header.offset_to_point_data < table_at <= size - 8:
            raise CloudError(f"{path.name} is cut off: its table of chunks is missing; copy or export it again.")
        file.seek(table_at)
        _, count = struct.unpack("<II", file.read(8))
        # Every chunk begins with an uncompressed point.
        if vlr.item_size() != header.point_format.size or count * vlr.item_size() > size:
            raise _misfit(path)
        file.seek(header.offset_to_point_data)
        table = lazrs.read_chunk_table(file, vlr)
    if any(points * vlr.item_size() > MAX_CHUNK for points, _ in table) or sum(held for _, held in table) > size:
        raise _misfit(path)
    most = sum(points for points, _ in table)
    least = most if vlr.uses_variable_size_chunks() or not table else most - table[-1][0]
    if not least <= header.point_count <= most:
        raise _other_count(path, header.point_count, most if least == most else f"{least} to {most}")
    return tuple(_chunks(table, header))


def _chunks(table: Sequence[tuple[int, int]], header: laspy.LasHeader) -> Iterator[Chunk]:
    """Yield the chunks that hold points; where all are of one size, the last may hold fewer than the table states."""
    at, left = header.offset_to_point_data + FIRST_CHUNK, header.point_count
    for points, held in table:
        if points and held:  # some writers end with an empty chunk
            yield Chunk(at, held, min(points, left))
        at, left = at + held, left - points


def check_layers(path: Path, header: laspy.LasHeader, chunks: Sequence[Chunk], progress: Progress = SILENT) -> None:
    """Refuse a file with a chunk that is smaller than its layers, or whose chunks hold another number of points."""
    record = _record(path, header)
    if not _is_layered(record):
        return
    head, held = _head(record, header), []
    with path.open("rb") as file:
        for chunk in chunks:
            progress.check()
            file.seek(chunk.at)
            stated, *sizes = _layer_sizes(file.read(head), header)
            if head + sum(sizes) > chunk.size:
                raise _misfit(path)
            held.append(stated)
    if sum(held) != header.point_count:
        raise _other_count(path, header.point_count, sum(held))
    if held != [chunk.points for chunk in chunks]:
        raise _misfit(path)


def chunks_in(
    path: Path, header: laspy.LasHeader, chunks: Sequence[Chunk], extent: Extent | np.ndarray
) -> tuple[Chunk, ...] | None:
    """List the chunks that may hold points of an extent, or of one of several, (k, 4), in the order of the file.

    Returns None if the file has no octree, or one that does not account for every chunk of the file.
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


def read_chunks(
    path: Path, header: laspy.LasHeader, chunks: Sequence[Chunk], fields: laspy.DecompressionSelection, most: int
) -> Iterator[laspy.ScaleAwarePointRecord]:
    """Decompress fields of chunks, several chunks at once; yields blocks of no more than `most` points.

    Raises CloudError if a chunk contains erased bytes.
    """
    from laspy.point.record import PackedPointRecord, ScaleAwarePointRecord

    record = _record(path, header)
    with path.open("rb") as file:
        for group in _groups(chunks, most):
            held = [_read(file, chunk) for chunk in group]
            if any(_is_erased(one, record, header) for one in held):
                raise CloudError(f"{path.name} is damaged: parts of its points are erased; copy or export it again.")
            points = np.empty(sum(chunk.points for chunk in group) * header.point_format.size, dtype=np.uint8)
            table = [(chunk.points, chunk.size) for chunk in group]
            lazrs.decompress_points_with_chunk_table(b"".join(held), record, points, table, fields.to_lazrs())
            packed = PackedPointRecord.from_buffer(points, header.point_format)
            for start in range(0, len(packed), most):
                part = packed.array[start : start + most]
                yield ScaleAwarePointRecord(part, packed.point_format, header.scales, header.offsets)


def _groups(chunks: Sequence[Chunk], most: int) -> Iterator[list[Chunk]]:
    """Divide chunks into groups of no more than `most` points, or of one chunk."""
    group: list[Chunk] = []
    count = 0
    for chunk in chunks:
        if group and count + chunk.points > most:
            yield group
            group, count = [], 0
        group.append(chunk)
        count += chunk.points
    if group:
        yield group


def _read(file: BinaryIO, chunk: Chunk) -> bytes:
    file.seek(chunk.at)
    return file.read(chunk.size)


def _is_erased(chunk: bytes, record: bytes, header: laspy.LasHeader) -> bool:
    """Return whether the part of a chunk that holds the compressed GPS times contains a run of erased bytes."""
    if not _is_layered(record):
        return chunk.find(ERASED * (MAX_ERASED + 1), header.point_format.size) >= 0
    head = _head(record, header)
    _, *sizes = _layer_sizes(chunk[:head], header)
    start, end = (head + sum(sizes[:count]) for count in (TIMES_LAYER, TIMES_LAYER + 1))
    return chunk.find(ERASED * (MAX_ERASED_TIMES + 1), start, end) >= 0


def _record(path: Path, header: laspy.LasHeader) -> bytes:
    """Return the content of the record that describes the compression."""
    found = header.vlrs.get("LasZipVlr")
    if not found:
        raise CloudError(
            f"{path.name} is damaged: the record that describes its compression is missing; export it again."
        )
    return found[0].record_data


def _find_table(file: BinaryIO, points_at: int) -> int:
    """Return the position of the chunk table; 0 if the file ends before stating it."""
    file.seek(points_at)
    stated = file.read(8)
    if stated == struct.pack("<q", AT_THE_END):
        file.seek(-8, SEEK_END)
        stated = file.read(8)
    return struct.unpack("<q", stated)[0] if len(stated) == 8 else 0


def _is_layered(record: bytes) -> bool:
    return struct.unpack_from(COMPRESSOR, record)[0] == LAYERED


def _head(record: bytes, header: laspy.LasHeader) -> int:
    """Return the bytes at the start of a layered chunk: a point, the number of points, and the sizes of the layers."""
    layers = sum(size if kind == EXTRA_BYTES else LAYERS[kind] for kind, size in _items(record))
    return header.point_format.size + 4 * (1 + layers)


def _layer_sizes(head: bytes, header: laspy.LasHeader) -> tuple[int, ...]:
    """Return the number of points and the bytes of each layer, from the start of a layered chunk."""
    return tuple(np.frombuffer(head, "<u4", offset=header.point_format.size).tolist())


def _items(record: bytes) -> Iterator[tuple[int, int]]:
    """Yield the type and the size of each compressed item."""
    (count,) = struct.unpack_from(ITEM_COUNT, record, ITEMS_AT - 2)
    for number in range(count):
        kind, size, _ = struct.unpack_from(ITEM, record, ITEMS_AT + number * struct.calcsize(ITEM))
        yield kind, size


def _misfit(path: Path) -> CloudError:
    return CloudError(f"{path.name} is damaged: its compressed chunks don't fit the file; export it again.")


def _other_count(path: Path, stated: int, held: object) -> CloudError:
    return CloudError(
        f"{path.name} is damaged: the number of points is {stated} in its header but {held} in its compressed chunks; "
        "export it again."
    )
