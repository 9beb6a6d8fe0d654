"""Files that take the place of older ones, and what a full or locked disk has to say."""

from __future__ import annotations

import errno
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path

from .errors import DiskError

LOGS = ("-wal", "-journal")
"""Ends, after a GeoPackage's name, of the files with what its writers have not put into it yet."""

COMPANIONS = (*LOGS, "-shm", ".ovr", ".msk", ".aux.xml")
"""Ends, after a file's name, of what SQLite and GDAL keep beside it: of an older file they are wrong."""

SHAPEFILE_COMPANIONS = (".qix", ".sbn", ".sbx", ".cpg", ".prj", ".qpj")
"""Ends in place of a shapefile's: indexes, encoding, coordinate system."""


@contextmanager
def writing(folder: Path) -> Iterator[None]:
    """Say in one sentence that what is written into a folder does not fit, or must not be written."""
    try:
        yield
    except OSError as error:
        full = error.errno in (errno.ENOSPC, errno.EDQUOT, errno.EFBIG)
        remedy = "make room on this disk" if full else "check the folder's permissions"
        raise DiskError(f"{folder} can't be written to ({error.strerror}): {remedy} or choose another.") from error


def check_closed(path: Path) -> None:
    """Refuse a GeoPackage that another program is writing to: what it has not put in yet would damage a new file.

    Raises
    ------
    DiskError
    """
    for log in (path.with_name(path.name + end) for end in LOGS):
        if log.exists() and log.stat().st_size:
            raise DiskError(
                f"{path} is open in another program ({log.name} is there): close it there, or choose another."
            )


def take_names(path: Path, whole: Mapping[Path, Path]) -> None:
    """Let whole files take their names, and remove what belonged to the file that was there.

    Parameters
    ----------
    path : Path
        The file by which users know what is written.
    whole : mapping of Path to Path
        By each new file its name; `path` among the names.

    Raises
    ------
    DiskError
        What was there before is left, for it is open elsewhere; the new files lie beside, with `_new` in their names.
    """
    try:
        check_closed(path)
        for file in sorted(whole, key=lambda file: whole[file] != path):  # where one is locked, it is this one
            file.replace(whole[file])
        for stale in _companions(path) - set(whole.values()):
            stale.unlink(missing_ok=True)
    except (DiskError, OSError) as error:
        kept = {file: name.with_name(f"{path.stem}_new{name.name[len(path.stem) :]}") for file, name in whole.items()}
        with writing(path.parent):
            for file in filter(Path.exists, kept):
                file.replace(kept[file])
        reason = error if isinstance(error, DiskError) else f"{path} can't be replaced ({error.strerror})."
        raise DiskError(f"{reason} The new one is {path.with_name(f'{path.stem}_new{path.suffix}')}.") from error


def _companions(path: Path) -> set[Path]:
    """Name the files that may belong to one."""
    shapefile = SHAPEFILE_COMPANIONS if path.suffix.lower() == ".shp" else ()
    return {path.with_name(path.name + end) for end in COMPANIONS} | {path.with_suffix(end) for end in shapefile}
