"""Copies of LAS and LAZ files with other classes; everything else stays as it is."""

from __future__ import annotations

import os
import struct
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path

import numpy as np

from ..errors import ParameterError
from ..progress import SILENT, Progress
from .las import coordinates, laspy, late_records, read_blocks
from .laz import lazrs
from .readers import explained

Places = Callable[[np.ndarray], np.ndarray]
"""Called with the numbers of some points, (k,) int; returns their coordinates (k, 3)."""

Change = Callable[[np.ndarray, Places], tuple[np.ndarray, np.ndarray]]
"""Called with the classes (n,) of the next points of a file, and what returns their coordinates; returns their new
classes (n,) and which points to write (n,) bool."""

LAST_OLD_FORMAT, LAST_OLD_CLASS = 5, 31
"""Point formats 0 to 5 have five bits for the class."""

RECORD_BLOCK = 1 << 20
"""Bytes of a record behind the points that are copied at once."""

RECORDS_AT = 235
"""Place in the header of LAS 1.4 of the start of the first of these records, followed by their number."""

COPC = "copc"
"""User of the records that describe the octree of a COPC file; they do not fit a file without one."""

AS_IT_IS = "surrogateescape"
"""Has laspy write text as it read it: the standard allows ASCII only, and some programs write other characters."""

WRITE_ERRORS = () if lazrs is None else (lazrs.LazrsError,)
"""What lazrs raises where the disk is full."""


def check_class(path: Path, class_code: int) -> None:
    """Refuse a class that the points of a file cannot have."""
    with explained(path), laspy.open(path, read_evlrs=False) as reader:
        number = reader.header.point_format.id
    if number <= LAST_OLD_FORMAT and class_code > LAST_OLD_CLASS:
        raise ParameterError(
            f"{path.name} has point format {number}, whose classes end at {LAST_OLD_CLASS}: choose a class up to "
            f"{LAST_OLD_CLASS}, or export the cloud with point format 6."
        )


def rewrite(path: Path, new: Path, change: Change, progress: Progress = SILENT) -> int:
    """Write a copy of a file that has been read and checked with other classes, and return how many points it has.

    The order of the points, their other dimensions, the scale and the records of the header stay. A COPC file becomes a
    LAZ or LAS file without the records of its octree, and LAS 1.0, which laspy does not write, becomes 1.2. The copy is
    compressed if its suffix is .laz. Raises CloudError or OSError if a file can't be read or written.
    """
    with explained(path):
        reader = laspy.open(path, read_evlrs=False)
    with reader:
        header = reader.header
        for record in header.vlrs.get_by_id(COPC):
            header.vlrs.remove(record)
        header.version = _version(header)
        with explained(path):
            for record in header.vlrs:
                record.user_id.encode("ascii")  # otherwise laspy can't write it
        compress = new.suffix.lower() == ".laz"
        try:
            with laspy.open(new, "w", header=header, do_compress=compress, encoding_errors=AS_IT_IS) as writer:
                for chunk in _chunks(path, reader, progress):
                    before = np.array(chunk.classification)
                    codes, keep = change(before, partial(coordinates, chunk))
                    other = codes != before
                    chunk.classification[other] = codes[other]
                    writer.write_points(chunk if keep.all() else chunk[keep])
                written = int(writer.header.point_count)
        except WRITE_ERRORS as error:
            raise OSError(str(error)) from error
        if header.number_of_evlrs:
            _append_records(path, header, new)
    return written


def _version(header: laspy.LasHeader) -> laspy.header.Version:
    """Return the version of a header, or another one if laspy does not write its point format in this version."""
    number, dims = header.point_format.id, laspy.point.dims
    if number in dims.VERSION_TO_POINT_FMT.get(str(header.version), ()):
        return header.version
    return laspy.header.Version.from_str(dims.preferred_file_version_for_point_format(number))


def _append_records(path: Path, header: laspy.LasHeader, new: Path) -> None:
    """Copy the records behind the points of a file, which may be larger than memory, without those of an octree."""
    with explained(path):
        records = [(start, end) for start, end, user in late_records(path, header) if user != COPC.encode()]
    with new.open("r+b") as target, path.open("rb") as source:
        first = target.seek(0, os.SEEK_END)
        for start, end in records:
            for at in range(start, end, RECORD_BLOCK):
                with explained(path):
                    source.seek(at)
                    block = source.read(min(RECORD_BLOCK, end - at))
                target.write(block)
        target.seek(RECORDS_AT)
        target.write(struct.pack("<QI", first if records else 0, len(records)))


def _chunks(path: Path, reader: laspy.LasReader, progress: Progress) -> Iterator[laspy.ScaleAwarePointRecord]:
    """Read a file chunk by chunk; what laspy raises because of the file becomes a `CloudError`."""
    done = 0
    with explained(path):
        for chunk in read_blocks(path, reader, laspy.DecompressionSelection.all()):
            progress.check()
            yield chunk
            done += len(chunk)
            progress.set_fraction(done / reader.header.point_count)
