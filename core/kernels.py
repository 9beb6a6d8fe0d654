"""Numerical libraries on one thread: none of their operations in a run is long enough to gain from more.

Threads of such libraries spin while they wait for each other, thousands of times in a run. On an idle computer two are
hardly faster than one; beside other programs they take several times the processor time (docs/scaling.md).

Each library has one setting for its whole process, which other programs in QGIS share. It is therefore changed only
while a run needs it, and restored by the last of the runs that overlap.
"""

from __future__ import annotations

import ctypes
import os
import threading
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, field
from functools import lru_cache
from importlib import import_module
from pathlib import Path

from .errors import ModelError

LINKED = ("numpy.linalg._umath_linalg", "scipy.linalg._fblas")
"""Modules that are linked to the BLAS of their package; each package may have its own."""

SYMBOLS = [f"{prefix}openblas_{{}}_num_threads{suffix}" for prefix in ("", "scipy_") for suffix in ("", "64_")]
"""Names of OpenBLAS's functions, by what they do: `get` or `set`. Packages rename them, so that theirs do not clash."""


ENVIRONMENT = {
    **{f"{name}_NUM_THREADS": "1" for name in ("OMP", "MKL", "OPENBLAS", "RAYON")},
    "OPENCV_FOR_THREADS_NUM": "1",
    "MALLOC_TRIM_THRESHOLD_": str(256 << 20),
    "MALLOC_MMAP_THRESHOLD_": str(32 << 20),
}
"""Variables of a worker process. The first keep it on one core: there are as many workers as cores. The last are the
bytes of freed memory that glibc keeps, and the largest array that it takes from them: otherwise each array returns to
the system, which clears the memory before it lends it again, at a tenth of the run time."""


MOST_THREADS = 4
"""Threads of a process that compute at a time: each keeps arrays of some 100 MB, and the network, which they share, is
half of the time that a short track takes."""


def cores() -> int:
    """Return the number of cores that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def threads() -> int:
    """Return the number of threads on which this process computes: OMP_NUM_THREADS limits it, as in workers."""
    limit = os.environ.get("OMP_NUM_THREADS", "")
    return min(cores(), MOST_THREADS, int(limit) if limit.isdecimal() and int(limit) else MOST_THREADS)


@dataclass(frozen=True)
class Library:
    """A library that is loaded, and its functions that tell and set the number of its threads."""

    name: str
    get: Callable[[], int] = field(compare=False)
    set: Callable[[int], object] = field(compare=False)


_LOCK = threading.Lock()
_HELD: dict[Library, tuple[int, int]] = {}
"""The libraries that runs keep on one thread: how many runs, and the number of threads before the first."""


def _take(library: Library) -> None:
    with _LOCK:
        runs, before = _HELD.get(library) or (0, library.get())
        if not runs:
            library.set(1)
        _HELD[library] = runs + 1, before


def _release(library: Library) -> None:
    with _LOCK:
        runs, before = _HELD.pop(library)
        if runs > 1:
            _HELD[library] = runs - 1, before
        else:
            library.set(before)


@contextmanager
def one_thread(*libraries: Library) -> Iterator[None]:
    """Keep libraries on one thread; afterwards they have as many as before, once no other run needs one."""
    with ExitStack() as ends:
        for library in libraries:
            _take(library)
            ends.callback(_release, library)
        yield


@lru_cache
def blas() -> tuple[Library, ...]:
    """Find the OpenBLAS of numpy and that of scipy; none where these are missing or are built with another BLAS."""
    found: set[Library] = set()
    for name in LINKED:
        try:
            module = import_module(name)
        except ImportError:
            continue
        for file in (Path(str(module.__file__)), *_beside(module.__name__.split(".")[0])):
            found.update(_openblas(file))
    return tuple(found)


def pytorch() -> Library:
    """Return PyTorch, which has to be installed."""
    import torch

    return Library("PyTorch", torch.get_num_threads, torch.set_num_threads)


def device_of(device: str) -> str:
    """Return PyTorch's name of a device: with AUTO, that of a graphics card if there is one; may raise ModelError."""
    import torch

    if device == "CUDA" and not torch.cuda.is_available():
        raise ModelError("There is no CUDA device that PyTorch can use: set DEVICE to AUTO or CPU.")
    return "cuda" if device != "CPU" and torch.cuda.is_available() else "cpu"


def opencv() -> Library:
    """Return OpenCV, which has to be installed."""
    import cv2

    return Library("OpenCV", cv2.getNumThreads, cv2.setNumThreads)


def _beside(package: str) -> Iterator[Path]:
    """Yield the libraries that a package brings along; on Windows, symbols are found in the library itself only."""
    folder = Path(str(import_module(package).__file__)).parent
    for libraries in (folder / ".libs", folder.with_name(f"{package}.libs")):
        yield from libraries.glob("*openblas*")


def _openblas(file: Path) -> Iterator[Library]:
    """Yield the OpenBLAS that a loaded file is or is linked to; the address of a function tells one from another."""
    try:
        linked = ctypes.CDLL(str(file))
    except OSError:
        return
    for symbol in SYMBOLS:
        if hasattr(linked, symbol.format("set")):
            get, change = (getattr(linked, symbol.format(which)) for which in ("get", "set"))
            change.restype = None
            yield Library(f"OpenBLAS at {ctypes.cast(change, ctypes.c_void_p).value}", get, change)
