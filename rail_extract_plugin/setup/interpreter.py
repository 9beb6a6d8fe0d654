"""Finds the Python program that belongs to this QGIS."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from functools import lru_cache
from pathlib import Path

from ...core.errors import RailExtractError
from ...core.run.worker import Interpreter
from . import processes
from .dependencies import version_of

QUESTION = """
import sys
try:
    from numpy import __version__
except ImportError:
    __version__ = None
print(*sys.version_info[:2], __version__)
"""
# A Python other than that of QGIS prints something else, or has no numpy.


def find_interpreter() -> Interpreter:
    """Find the Python program that has the same packages as QGIS; raises RailExtractError without one."""
    expected = " ".join(map(str, (*sys.version_info[:2], version_of("numpy"))))
    # A relative path would be looked up in the current folder, or along PATH.
    found = filter(Path.is_absolute, candidates(Path(sys.executable), Path(sys.prefix), sys.platform))
    tried = list(dict.fromkeys(found))
    # In an app bundle, the program does not find its library by itself.
    for changes in ({}, {"PYTHONHOME": sys.prefix}):
        for program in filter(Path.is_file, tried):
            if processes.run(str(program), ["-c", QUESTION], changes).output.strip() == expected:
                return Interpreter(str(program), changes)
    raise RailExtractError(
        f"The Python program of this QGIS was not found in {', '.join(sorted({str(path.parent) for path in tried}))}: "
        "install the packages into a folder with another tool, and set the environment variable RAIL_EXTRACT_PACKAGES "
        "to that folder."
    )


@lru_cache
def known_interpreter() -> Interpreter:
    """Return the Python program that has been found; it stays the same for as long as QGIS runs."""
    return find_interpreter()


def candidates(executable: Path, prefix: Path, platform: str) -> Iterator[Path]:
    """List possible paths of the program, the likeliest first, from `sys.executable`, `sys.prefix` and `sys.platform`.

    On Windows and macOS, `executable` is QGIS itself, and starting it would open another QGIS.
    """
    names = ["python3", "python", "python{}.{}".format(*sys.version_info)]
    if platform == "win32":
        folders = [prefix, executable.parent]
        names = [f"{name}.exe" for name in names]
    else:
        folders = [prefix / "bin", executable.parent / "bin", executable.parent, prefix / "tools" / "python3"]
    for folder in folders:
        for name in names:
            yield folder / name
