"""Temporary folders of a run, and the removal of those that killed runs have left."""

from __future__ import annotations

import os
import platform
import re
import secrets
import shutil
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

PREFIX = ".rail_extract_"
NAME = re.compile(re.escape(PREFIX) + "[0-9a-f]{12}")

MARK = "in_use"
"""File in a temporary folder that its process keeps locked; it holds the name of the computer."""

MIN_AGE_S = 60.0
"""Younger folders are not removed: their process may not have locked them yet."""

MIN_UNMARKED_AGE_S = 86_400.0
"""The same for folders whose process was killed before it had marked them."""

OWNER_ONLY = 0o777 if sys.platform == "win32" else 0o700
"""Rights of a temporary folder. On Windows, files that are moved keep the rights of the folder they come from."""


@contextmanager
def scratch_folder(parent: Path) -> Iterator[Path]:
    """Create a folder in another one that no other process knows or uses, and delete it in any case.

    Its name is unpredictable, and creating it fails if anything has this name, so that nobody can direct the files
    elsewhere with a symbolic link.
    """
    folder = parent / f"{PREFIX}{secrets.token_hex(6)}"
    folder.mkdir(OWNER_ONLY)
    try:
        computer = platform.node()
        with (folder / MARK).open("x", encoding="utf-8") as mark:
            mark.write(computer)
            mark.flush()
            with suppress(OSError):  # on a drive without locks, no folder is ever taken for abandoned
                lock(mark.fileno())
            yield folder
    finally:
        shutil.rmtree(folder, ignore_errors=True)


def sweep(parent: Path, rescue: Callable[[Path], None] | None = None) -> None:
    """Remove the temporary folders that killed processes of this user have left; `rescue` gets each of them before."""
    with suppress(OSError):
        for entry in os.scandir(parent):
            if NAME.fullmatch(entry.name) and entry.is_dir(follow_symlinks=False) and _is_abandoned(Path(entry)):
                if rescue is not None:
                    rescue(Path(entry))
                shutil.rmtree(entry, ignore_errors=True)


def discard(path: Path) -> None:
    """Delete whatever has a name, a folder with all its content."""
    if path.is_dir() and not path.is_symlink():
        shutil.rmtree(path)
    else:
        path.unlink(missing_ok=True)


def _is_abandoned(folder: Path) -> bool:
    """Return whether a folder belongs to this user and the process that created it on this computer is gone."""
    mark, now = folder / MARK, time.time()
    try:
        state = folder.stat()
        if hasattr(os, "getuid") and state.st_uid != os.getuid():
            return False
        if not mark.exists() or not mark.stat().st_size:
            return now - state.st_mtime > MIN_UNMARKED_AGE_S
        with mark.open("r+", encoding="utf-8") as opened:
            if opened.read() != platform.node() or now - mark.stat().st_mtime < MIN_AGE_S:
                return False
            lock(opened.fileno())
            return True
    except (OSError, UnicodeDecodeError):
        return False


if sys.platform == "win32":
    import msvcrt

    def lock(number: int) -> None:
        """Lock an open file, given by its number, until it is closed; `OSError` if another process has locked it."""
        os.lseek(number, 0, os.SEEK_SET)
        msvcrt.locking(number, msvcrt.LK_NBLCK, 1)

else:
    import fcntl

    def lock(number: int) -> None:
        """Lock an open file, given by its number, until it is closed; `OSError` if another process has locked it."""
        fcntl.flock(number, fcntl.LOCK_EX | fcntl.LOCK_NB)
