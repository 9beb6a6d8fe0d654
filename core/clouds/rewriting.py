"""Copies of LAS and LAZ files with other classes; everything else stays as it is."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np

from ..errors import ParameterError
from ..progress import SILENT, Progress
from .las import chunk_size, laspy
from .laz import lazrs
from .readers import explained

Change = Callable[[np.ndarray, np.ndarray], tuple[np.ndarray, np.ndarray]]
"""Called with the coordinates (n, 3) and classes (n,) of the next points of a file; returns their new classes (n,) and
which points to write (n,) bool."""

LAST_OLD_FORMAT, LAST_OLD_CLASS = 5, 31
"""Point formats 0 to 5 have five bits for the class."""

COPC = "copc"
"""User of the records that describe the octree of a COPC file; they do not fit a file without one."""

WRITE_ERRORS = () if lazrs is None else (lazrs.LazrsError,)
"""What lazrs raises where the disk is full."""


def check_class(path: Path, class_code: int) -> None:
    """Refuse a class that the points of a file cannot have.

    Raises
    ------
    ParameterError
    """
    with explained(path), laspy.open(path, read_evlrs=False) as reader:
        number = reader.header.point_format.id
    if number <= LAST_OLD_FORMAT and class_code > LAST_OLD_CLASS:
        raise ParameterError(
            f"{path.name} has point format {number}, whose classes end at {LAST_OLD_CLASS}: choose a class up to "
            f"{LAST_OLD_CLASS}, or export the cloud with point format 6."
        )


def rewrite(path: Path, new: Path, change: Change, progress: Progress = SILENT) -> int:
    """Write a copy of a file with other classes, and return how many points it has.

    The order of the points, their other dimensions, the scale and the records of the header stay. A COPC file becomes
    a LAZ or LAS file without the records of its octree.

    Parameters
    ----------
    path : Path
        A file that has been read and checked.
    new : Path
        Compressed if its suffix is .laz.
    change : callable
        See `Change`.
    progress : Progress

    Raises
    ------
    CloudError
        The file can't be read.
    OSError
        The new file can't be written.
    """
    with explained(path):
        reader = laspy.open(path, read_evlrs=False)
    with reader:
        header = reader.header
        for record in header.vlrs.get_by_id(COPC):
            header.vlrs.remove(record)
        try:
            with laspy.open(new, "w", header=header, do_compress=new.suffix.lower() == ".laz") as writer:
                for chunk in _chunks(path, reader, progress):
                    before = np.array(chunk.classification)
                    xyz = np.column_stack([chunk.X, chunk.Y, chunk.Z]) * header.scales + header.offsets
                    codes, keep = change(xyz, before)
                    other = codes != before
                    chunk.classification[other] = codes[other]
                    writer.write_points(chunk if keep.all() else chunk[keep])
                written = int(writer.header.point_count)
                if header.number_of_evlrs:
                    with explained(path):
                        reader.read_evlrs()
                    writer.write_evlrs(type(reader.evlrs)(one for one in reader.evlrs if one.user_id != COPC))
        except WRITE_ERRORS as error:
            raise OSError(str(error)) from error
    return written


def _chunks(path: Path, reader: laspy.LasReader, progress: Progress) -> Iterator[laspy.ScaleAwarePointRecord]:
    """Read a file chunk by chunk; what laspy raises because of the file becomes a `CloudError`."""
    done = 0
    with explained(path):
        for chunk in reader.chunk_iterator(chunk_size(reader.header)):
            progress.check()
            yield chunk
            done += len(chunk)
            progress.set_fraction(done / reader.header.point_count)
