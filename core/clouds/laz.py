"""Checks of compressed clouds (LAZ, COPC) before they are decompressed.

lazrs allocates whatever a file states, and the program ends if that fails. These checks therefore compare every size in
a file with the size of the file first. The layout of chunks is that of LASzip's specification, version 1.4 R15.
"""

from __future__ import annotations

import struct
from collections.abc import Iterator
from os import SEEK_END
from pathlib import Path
from typing import TYPE_CHECKING, BinaryIO

from ..errors import CloudError
from ..progress import SILENT, Progress

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

ChunkTable = list[tuple[int, int]]
"""Number of points and of bytes of each chunk; in files with chunks of one size, the last may hold fewer points."""


def read_chunk_table(path: Path, header: laspy.LasHeader) -> ChunkTable:
    """Read the table of chunks, and refuse a file whose chunks do not fit it or do not hold the stated points.

    Raises
    ------
    CloudError
        The file is cut off or damaged, or the package that reads LAZ is missing.
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
    return table


def check_layers(path: Path, header: laspy.LasHeader, table: ChunkTable, progress: Progress = SILENT) -> None:
    """Refuse a file with a chunk that is smaller than its layers, or whose chunks hold another number of points.

    Parameters
    ----------
    path : Path
    header : laspy.LasHeader
    table : list of tuple
        From `read_chunk_table`.
    progress : Progress

    Raises
    ------
    CloudError
    """
    record = _record(path, header)
    if struct.unpack_from(COMPRESSOR, record)[0] != LAYERED:
        return
    layers, point_size = sum(_layers(record)), header.point_format.size
    start, total = header.offset_to_point_data + 8, 0
    with path.open("rb") as file:
        for points, held in filter(all, table):  # some writers end with an empty chunk
            progress.check()
            file.seek(start + point_size)
            stated, *sizes = struct.unpack(f"<{1 + layers}I", file.read(4 + 4 * layers))
            if stated > points or point_size + 4 + 4 * layers + sum(sizes) > held:
                raise _misfit(path)
            start, total = start + held, total + stated
    if total != header.point_count:
        raise _other_count(path, header.point_count, total)


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


def _layers(record: bytes) -> Iterator[int]:
    """Yield the number of layers of each compressed item."""
    (count,) = struct.unpack_from(ITEM_COUNT, record, ITEMS_AT - 2)
    for number in range(count):
        kind, size, _ = struct.unpack_from(ITEM, record, ITEMS_AT + number * struct.calcsize(ITEM))
        yield size if kind == EXTRA_BYTES else LAYERS[kind]


def _misfit(path: Path) -> CloudError:
    return CloudError(f"{path.name} is damaged: its compressed chunks don't fit the file; export it again.")


def _other_count(path: Path, stated: int, held: object) -> CloudError:
    return CloudError(
        f"{path.name} is damaged: the number of points is {stated} in its header but {held} in its compressed chunks; "
        "export it again."
    )
