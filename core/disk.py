"""Replacement of files by new ones, and errors of a full or write-protected disk."""

from __future__ import annotations

import errno
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path

from .errors import DiskError

LOGS = ("-wal", "-journal")
"""Suffixes, added to a GeoPackage's name, of files with changes that are not yet in it."""

COMPANIONS = (*LOGS, "-shm", ".ovr", ".msk", ".aux.xml")
"""Suffixes, added to a file's name, of files that SQLite and GDAL keep next to it; they don't fit a new file."""

SHAPEFILE_COMPANIONS = (".qix", ".sbn", ".sbx", ".cpg", ".prj", ".qpj")
"""Suffixes that replace .shp: indexes, encoding, coordinate system."""


@contextmanager
def writing(folder: Path) -> Iterator[None]:
    """Turn an `OSError` while writing into a folder into one sentence.

    Raises
    ------
    DiskError
    """
    try:
        yield
    except OSError as error:
        full = error.errno in (errno.ENOSPC, errno.EDQUOT, errno.EFBIG)
        remedy = "free space on the disk" if full else "check the folder's permissions"
        raise DiskError(
            f"{folder} can't be written to ({error.strerror}): {remedy}, or choose another folder."
        ) from error


def check_closed(path: Path) -> None:
    """Refuse to replace a GeoPackage that another program is writing to: its pending changes would damage the new file.

    Raises
    ------
    DiskError
    """
    for log in (path.with_name(path.name + end) for end in LOGS):
        if log.exists() and log.stat().st_size:
            raise DiskError(
                f"{path} is open in another program ({log.name} exists): close it there, or choose another file."
            )


def take_names(path: Path, names: Mapping[Path, Path]) -> None:
    """Rename finished files to their final names, and remove the companions of the file they replace.

    Parameters
    ----------
    path : Path
        Final name of the main file, the one the user chose.
    names : mapping of Path to Path
        Final name by finished file, `path` among them.

    Raises
    ------
    DiskError
        The old file can't be replaced because it is open elsewhere. It is kept, and the new files are left next to it
        with `_new` in their names.
    """
    try:
        check_closed(path)
        for file in sorted(names, key=lambda file: names[file] != path):  # the main file first: it is the one locked
            file.replace(names[file])
        for stale in _companions(path) - set(names.values()):
            stale.unlink(missing_ok=True)
    except (DiskError, OSError) as error:
        kept = {file: name.with_name(f"{path.stem}_new{name.name[len(path.stem) :]}") for file, name in names.items()}
        with writing(path.parent):
            for file in filter(Path.exists, kept):
                file.replace(kept[file])
        reason = error if isinstance(error, DiskError) else f"{path} can't be replaced ({error.strerror})."
        raise DiskError(f"{reason} The new file is {path.with_name(f'{path.stem}_new{path.suffix}')}.") from error


def write_text(path: Path, text: str) -> None:
    """Write a text file; an older one stays until the new one is complete.

    Raises
    ------
    DiskError
    """
    part = path.with_name(f"{path.name}.part")
    try:
        try:
            part.write_text(text, encoding="utf-8")
            part.replace(path)
        finally:
            part.unlink(missing_ok=True)
    except OSError as error:
        raise DiskError(f"{path} can't be written ({error.strerror}): choose another place.") from error


def _companions(path: Path) -> set[Path]:
    """Return the files that may accompany a file."""
    shapefile = SHAPEFILE_COMPANIONS if path.suffix.lower() == ".shp" else ()
    return {path.with_name(path.name + end) for end in COMPANIONS} | {path.with_suffix(end) for end in shapefile}
