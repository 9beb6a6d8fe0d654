"""Files that a run writes: complete in a temporary folder first, then moved to the names that the user chose.

Whenever a run is interrupted, the old file or the new one is there, never part of each. A shapefile consists of several
files: between the old set and the new one there is a moment without the file that opens the set, and the next run that
writes to the folder completes an interrupted move. Temporary folders that killed runs have left are removed.
"""

from __future__ import annotations

import errno
import json
import os
import platform
import re
import secrets
import shutil
import stat
import sys
import tempfile
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path

from .errors import DiskError

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

LOGS = ("-wal", "-journal")
"""Suffixes, added to a GeoPackage's name, of files with changes that are not yet in it."""

COMPANIONS = (*LOGS, "-shm", ".ovr", ".msk", ".aux.xml")
"""Suffixes, added to a file's name, of files that SQLite and GDAL keep next to it; they don't fit a new file."""

SHAPEFILE_COMPANIONS = (".qix", ".sbn", ".sbx", ".cpg", ".prj", ".qpj")
"""Suffixes that replace .shp: indexes, encoding, coordinate system."""

SHAPEFILE_PARTS = (".shx", ".dbf", ".cpg", ".prj", ".qpj")
"""Suffixes of the files that state what is in a .shp; the others are indexes."""

FULL = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG)
"""Errors of a disk without space for more. Libraries that report no number mostly mean these."""

NEW, OLD, MOVING = "new", "old", "moving"
"""In the temporary folder: the new files, the files they replace, and the names of all, the main one first."""

LOCK_S, LOCK_STEP_S = 5.0, 0.05
"""How long a run waits for another that moves files into the same folder, which takes milliseconds, and how often it
tries. Then it continues: anybody who can read a folder can lock it."""


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


@contextmanager
def writing(folder: Path) -> Iterator[None]:
    """Turn an `OSError` while writing into a folder into one sentence, that of a DiskError."""
    try:
        yield
    except OSError as error:
        remedy = "free space on the disk" if error.errno in FULL else "check the folder's permissions"
        raise DiskError(
            f"{folder} can't be written to ({error.strerror}): {remedy}, or choose another folder."
        ) from error


def check_closed(path: Path) -> None:
    """Refuse to replace a GeoPackage that another program is writing to: pending changes would damage the new file."""
    for log in (path.with_name(path.name + end) for end in LOGS):
        if log.exists() and log.stat().st_size:
            raise DiskError(
                f"{path} is open in another program ({log.name} exists): close it there, or choose another file."
            )


@dataclass
class Destination:
    """A file that a run will write, and the file that was there when the run began.

    Several outputs that go into one file share one destination. `path` is as the user named it, `file` the file itself
    if that is a symbolic link, and `before` the identity of the file that this run found, or has written.
    """

    path: Path
    file: Path
    before: tuple[int, int] | None

    @classmethod
    def at(cls, path: Path) -> Destination:
        """Check that a file can be written, as far as that can be known before, and remember the old one.

        Raises DiskError if its folder or the old file is not writable, something other than a file has this name, or
        the old file is open in another program.
        """
        try:
            file = Path(os.path.realpath(path))
            sweep(file.parent, _complete)
            _check_writable(path, file)
            check_closed(file)
        except (OSError, ValueError) as error:  # ValueError: a name that no system can have
            raise _unwritable(path, error) from error
        return cls(path, file, identity(file))

    @contextmanager
    def replacing(self, edit: bool = False) -> Iterator[Path]:
        """Move a file, and all files that are written next to it, to their names when the block ends without an error.

        Yields the name in a temporary folder under which to write the file; with `edit`, it begins with a copy of the
        old file, or of the files of a shapefile. An `OSError` in the block becomes a `DiskError`; one that states only
        a text may stand for the error of a library.

        Raises DiskError if the disk is full, the old file is open elsewhere, or another run has replaced it in the
        meantime. The old file is then kept, and the new files are left next to it with `_new` in their names.
        """
        try:
            with scratch_folder(self.file.parent) as folder:
                new = folder / NEW / self.file.name
                new.parent.mkdir()
                copied = _state(self.file) if edit else None
                for old in self._parts() if edit else ():
                    shutil.copyfile(old, new.with_name(old.name))
                yield new
                if any(new.parent.iterdir()):
                    self._move_in(folder, copied)
                    self.before = identity(self.file)
        except OSError as error:
            raise _unwritable(self.path, error) from error

    def write_text(self, text: str) -> None:
        """Write a text file, as in `replacing`."""
        with self.replacing() as new:
            new.write_text(text, encoding="utf-8")

    def _parts(self) -> list[Path]:
        """List the old file, and the other files of which a shapefile consists."""
        others = SHAPEFILE_PARTS if self.file.suffix.lower() == ".shp" else ()
        return [self.file, *filter(Path.is_file, (self.file.with_suffix(end) for end in others))]

    def _move_in(self, folder: Path, copied: tuple[int, int] | None) -> None:
        """Move the files of a temporary folder to their names, if the old file is still the one that was copied."""
        new = sorted((folder / NEW).iterdir())
        for file in filter(Path.is_file, new):
            with file.open("r+b") as opened:
                os.fsync(opened.fileno())  # otherwise it may be empty after a power cut, although it was renamed
            for model in filter(Path.exists, (self.file, self.file.with_name(file.name))):
                shutil.copymode(model, file)  # so that nobody else can read it
        with alone_in(self.file.parent):
            try:
                is_other = identity(self.file) not in (None, self.before)
                if is_other or (copied is not None and copied != _state(self.file)):
                    raise DiskError(f"{self.path} was changed by another program in the meantime.")
                check_closed(self.file)
                names = sorted(self.file.with_name(file.name) for file in new)
                journal = json.dumps([self.file.name, *(name.name for name in names)])
                (folder / MOVING).write_text(journal, encoding="utf-8")
                _swap(folder, self.file, names)
            except (DiskError, OSError) as error:
                kept = _keep_beside(new, self.file)
                reason = error if isinstance(error, DiskError) else f"{self.path} can't be replaced ({_reason(error)})."
                raise DiskError(f"{reason} The new file is {kept}.") from error


def replace_folder(scratch: Path, target: Path) -> None:
    """Move a new folder, in the folder `NEW` of a temporary one, to its name next to it, where an old one may be.

    If the run is killed in between, the next one that writes there completes it. After an OSError, the old folder is in
    its place again.
    """
    new, old = scratch / NEW / target.name, scratch / OLD / target.name
    old.parent.mkdir()
    (scratch / MOVING).write_text(json.dumps([target.name] * 2), encoding="utf-8")
    has_old = target.exists()
    if has_old:
        target.replace(old)
    try:
        new.replace(target)
    except OSError:
        if has_old:
            old.replace(target)
        raise


def _check_writable(path: Path, file: Path) -> None:
    """Open the old file, create one in its folder, and rename the old file to itself."""
    try:
        kind = file.stat().st_mode  # from Python 3.14, path.exists() would hide a name that is too long
    except FileNotFoundError:
        kind = stat.S_IFREG
    if stat.S_ISDIR(kind):
        raise DiskError(f"The output {path} is a folder: give the name of a file in it.")
    if not stat.S_ISREG(kind):
        raise DiskError(f"The output {path} is a pipe or a device, not a file: give the name of a file.")
    tempfile.TemporaryFile(dir=file.parent).close()
    if file.exists():
        file.open("r+b").close()
        file.replace(file)  # refused on Windows while another program has it open


def identity(file: Path) -> tuple[int, int] | None:
    """Return what changes if a file is replaced but not if its content is edited; None if there is no file."""
    try:
        state = file.stat()
    except OSError:
        return None
    return state.st_dev, state.st_ino


def _state(file: Path) -> tuple[int, int]:
    """Return what changes if the content of a file is edited."""
    state = file.stat()
    return state.st_mtime_ns, state.st_size


def _unwritable(path: Path, error: OSError | ValueError) -> DiskError:
    may_be_full = isinstance(error, OSError) and error.errno in (None, *FULL)
    remedy = "free space on the disk, or choose" if may_be_full else "choose"
    return DiskError(f"The output {path} can't be written ({_reason(error)}): {remedy} another place.")


def _reason(error: OSError | ValueError) -> str:
    """Return the operating system's words; errors of Python's own have none."""
    return getattr(error, "strerror", None) or str(error)


def _swap(folder: Path, main: Path, names: Sequence[Path]) -> None:
    """Replace files by the new ones from a temporary folder, and remove companions of the old main file.

    If there are several new files, the main one, which opens the set, is missing from the first move to the last: a set
    that is not complete cannot be opened. Files of `names` that are no longer in the temporary folder have been moved
    already. After an OSError, as of a file that is open elsewhere, all old files are in their places again.
    """
    new, old = folder / NEW, folder / OLD
    waiting = [name for name in names if (new / name.name).exists()]
    others = [name for name in waiting if name != main]
    replaced = [*([main] if others else []), *others, *sorted(_companions(main).difference(names))]
    if any(name.is_dir() for name in replaced):
        raise IsADirectoryError(errno.EISDIR, os.strerror(errno.EISDIR))
    moves = [(name, old / name.name) for name in replaced if os.path.lexists(name)]
    moves += [(new / name.name, name) for name in (*others, *([main] if main in waiting else []))]
    old.mkdir(exist_ok=True)
    done = []
    try:
        for source, target in moves:
            source.replace(target)
            done.append((source, target))
    except OSError:
        for source, target in reversed(done):
            target.replace(source)
        raise


def _complete(folder: Path) -> None:
    """Complete the move that a killed run had begun in its temporary folder, or take it back."""
    journal, parent = folder / MOVING, folder.parent
    with suppress(OSError, ValueError, TypeError, RecursionError), alone_in(parent):
        main, *names = (parent / Path(name).name for name in json.loads(journal.read_text(encoding="utf-8")))
        if not (folder / NEW / main.name).exists():
            return  # it was complete
        if not os.path.lexists(main):
            _swap(folder, main, names)
        elif main.stat().st_mtime <= journal.stat().st_mtime:  # nobody has replaced it since
            for old in (folder / OLD).iterdir():
                if not os.path.lexists(parent / old.name):
                    old.replace(parent / old.name)


def _keep_beside(files: Sequence[Path], main: Path) -> Path:
    """Move new files next to the old one, under a name that no file has; returns the name of the main one."""
    number = 1
    while True:
        stem = f"{main.stem}_new" if number == 1 else f"{main.stem}_new{number}"
        names = {file: main.with_name(stem + file.name[len(main.stem) :]) for file in files}
        if not any(map(os.path.lexists, names.values())):
            break
        number += 1
    with writing(main.parent):
        for file, name in names.items():
            file.replace(name)
    return main.with_name(stem + main.suffix)


@contextmanager
def alone_in(folder: Path) -> Iterator[None]:
    """Keep other runs from moving files into the same folder, where the operating system can lock folders."""
    try:
        opened = os.open(folder, os.O_RDONLY)
    except OSError:  # Windows opens no folders
        yield
        return
    try:
        end = time.monotonic() + LOCK_S
        while time.monotonic() < end:
            try:
                lock(opened)
                break
            except BlockingIOError:
                time.sleep(LOCK_STEP_S)
            except OSError:
                break
        yield
    finally:
        os.close(opened)


def _companions(path: Path) -> set[Path]:
    """Return the files that may accompany a file."""
    shapefile = SHAPEFILE_COMPANIONS if path.suffix.lower() == ".shp" else ()
    return {path.with_name(path.name + end) for end in COMPANIONS} | {path.with_suffix(end) for end in shapefile}
