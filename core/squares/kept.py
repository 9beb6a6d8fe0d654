"""Results of squares in files whose names change with everything that the results depend on.

A file is complete or does not exist: after any interruption, the next run continues with the finished results.
"""

from __future__ import annotations

import hashlib
import json
import math
import os
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, fields, is_dataclass, replace
from functools import lru_cache
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np

from ..disk import discard, scratch_folder, sweep, writing
from ..errors import RailExtractError
from ..frame import LocalFrame
from ..rails import RailLine, Support
from ..raster import RailRaster
from ..run.tasks import Context, Task, version
from ..tiles.grid import Square
from ..tiles.store import SpooledPoints
from .seams import SquareRails

KEPT = {one.__name__: one for one in (RailRaster, SquareRails, Square, LocalFrame, RailLine, Support)}
"""Classes of which results consist, besides numbers, texts, arrays, tuples and mappings."""


@dataclass(frozen=True)
class Stored:
    """A result in a file."""

    path: str


class KeptResults:
    """Keeps results in a folder, which every process that executes tasks must reach under the same path."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder.resolve()
        with writing(self._folder):
            self._folder.mkdir(parents=True, exist_ok=True)  # not by workers: a failed run may have removed it

    def kept(self, task: Task) -> Task:
        """See `run.tasks.Keeping`."""
        return replace(task, function=_kept, arguments=(task, str(self._folder)))

    def opened(self, result: Any) -> Any:
        """See `run.tasks.Keeping`."""
        return load(result) if isinstance(result, Stored) else result


def _kept(task: Task, folder: str, context: Context) -> Any:
    """Return the file of a result that is there and intact; otherwise compute it, and keep it if `save` can."""
    _sweep_once(folder)
    name = task.function.__name__.strip("_")
    path = Path(folder) / f"{name}_{fingerprint(name, *task.arguments, context.results, version())}.npz"
    if os.path.lexists(path):
        try:
            load(Stored(str(path)))
            return Stored(str(path))
        except DamagedError:
            context.progress.warning(f"{task.label}: the stored result is damaged, so it is computed again.")
            with writing(path.parent):
                discard(path)
    results = {one: load(given) if isinstance(given, Stored) else given for one, given in context.results.items()}
    result = task.function(*task.arguments, replace(context, results=results))
    if not can_store(result):
        return result
    save(path, result)
    return Stored(str(path))


@lru_cache
def _sweep_once(folder: str) -> None:
    """Remove what killed processes of this computer have left in a folder."""
    sweep(Path(folder))


def fingerprint(*facts: Any) -> str:
    """Return a file name that depends on numbers, texts, arrays, dataclasses and collections of these."""
    digest = hashlib.sha256()
    for part in _parts(facts):
        digest.update(part)
        digest.update(b"\0")
    return digest.hexdigest()[:32]


def _parts(fact: Any) -> Iterable[bytes]:
    """Yield what identifies a fact."""
    if isinstance(fact, np.ndarray):
        yield f"{fact.shape} {fact.dtype}".encode()
        yield fact.tobytes()
    elif isinstance(fact, bytes):
        yield fact
    elif callable(fact):
        yield fact.__qualname__.encode()
    elif isinstance(fact, Stored):
        yield Path(fact.path).name.encode()
    elif isinstance(fact, SpooledPoints):
        # The folders of the points are named after size and time of the files that the points come from.
        yield from _parts(sorted(Path(file).parts[-2:] for files in fact.files.values() for file in files))
        yield from _parts((fact.passes, fact.blunt, fact.scanned))
    elif is_dataclass(fact):
        for field in fields(fact):
            yield from _parts(getattr(fact, field.name))
    elif isinstance(fact, Mapping):
        yield from _parts(sorted((fingerprint(name), fingerprint(value)) for name, value in fact.items()))
    elif isinstance(fact, (list, tuple)):
        yield f"{len(fact)}".encode()
        for one in fact:
            yield from _parts(one)
    else:
        yield repr(fact).encode()


def can_store(result: Any) -> bool:
    """Return whether `save` accepts a result: a raster, the rails of a square, or a tuple of rails."""
    of_rails = isinstance(result, tuple) and all(isinstance(one, RailLine) for one in result)
    return isinstance(result, (RailRaster, SquareRails)) or of_rails


def save(path: Path, result: RailRaster | SquareRails | tuple[RailLine, ...]) -> None:
    """Write a result, in a temporary folder first: a full disk or a killed worker leaves no incomplete file."""
    arrays: list[bytes] = []
    text = json.dumps(_described(result, arrays), default=np.generic.item)
    with writing(path.parent), scratch_folder(path.parent) as scratch:
        unfinished = scratch / path.name
        with unfinished.open("xb") as file:
            np.savez_compressed(file, text=_bytes(text.encode()), arrays=_bytes(b"".join(arrays)))
            file.flush()
            os.fsync(file.fileno())  # otherwise the file may be empty after a power cut
        unfinished.replace(path)


class DamagedError(RailExtractError):
    """A file does not hold what `save` wrote."""


def load(stored: Stored) -> Any:
    """Read what `save` wrote; raise DamagedError if it was changed."""
    try:
        with np.load(stored.path, allow_pickle=False) as file:
            return _restored(json.loads(file["text"].tobytes()), BytesIO(file["arrays"].tobytes()))
    except Exception as error:  # damage shows as an error of the file, of the compression or of the arrays
        raise DamagedError(f"{Path(stored.path).name} is damaged ({error}): start the run again") from error


def _bytes(content: bytes) -> np.ndarray:
    return np.frombuffer(content, np.uint8)


def _described(fact: Any, arrays: list[bytes]) -> Any:
    """Return a fact as JSON; the bytes of its arrays are appended, and it states their types and shapes in order."""
    if isinstance(fact, np.ndarray):
        arrays.append((np.packbits(fact) if fact.dtype == bool else fact).tobytes())
        return {"array": [str(fact.dtype), fact.shape]}
    if isinstance(fact, tuple):
        return {"tuple": [_described(one, arrays) for one in fact]}
    if isinstance(fact, Mapping):
        return {"mapping": [[_described(one, arrays) for one in item] for item in fact.items()]}
    if type(fact) in KEPT.values():
        return {type(fact).__name__: [_described(getattr(fact, one.name), arrays) for one in fields(fact)]}
    return fact


def _restored(fact: Any, arrays: BytesIO) -> Any:
    """Return what `_described` described."""
    if not isinstance(fact, dict):
        return fact
    ((kind, content),) = fact.items()
    if kind == "array":
        return _array(np.dtype(content[0]), content[1], arrays)
    if kind == "mapping":
        return {_restored(name, arrays): _restored(value, arrays) for name, value in content}
    parts = [_restored(one, arrays) for one in content]
    return tuple(parts) if kind == "tuple" else KEPT[kind](*parts)


def _array(dtype: np.dtype, shape: Sequence[int], arrays: BytesIO) -> np.ndarray:
    """Read the next array."""
    count = math.prod(shape)
    if dtype.kind == "b":
        return np.unpackbits(_bytes(arrays.read(-(-count // 8))), count=count).astype(bool).reshape(shape)
    return np.frombuffer(arrays.read(count * dtype.itemsize), dtype).reshape(shape).copy()
