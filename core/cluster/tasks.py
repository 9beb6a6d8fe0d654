"""What workers do: each task is a pure function of files and parameters, and what it finds is a file again."""

from __future__ import annotations

import threading
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from ..clouds.points import Request
from ..clouds.readers import CloudHeader
from ..errors import DiskError, RailExtractError
from ..frpdf.engine import Engine
from ..frpdf.models import choose
from ..pipeline import Parameters, clean_square, engine_for, rails_of_square
from ..squares.grid import Key, Square, around
from ..squares.spool import SpooledFile, SpooledPoints, spool_file
from .store import CORE, fingerprint, load_raster, save_rails, save_raster, version


@dataclass(frozen=True)
class Failure:
    """Why a file or a stretch is missing from the result; one sentence."""

    reason: str


@dataclass(frozen=True)
class SquareTask:
    """One stretch of one class.

    Attributes
    ----------
    source : SpooledPoints
        Of the stretch and its neighbours.
    stretch : Square
    parameters : Parameters
    version : str
        Of the code and the network's weights; see `work.version`.
    folder : str
        Where results go.
    """

    source: SpooledPoints
    stretch: Square
    parameters: Parameters
    version: str
    folder: str

    @property
    def name(self) -> str:
        """Fingerprint of the points around, whose files name themselves by size and time, and of the parameters."""
        settings = replace(self.parameters, quality_step_m=None, keep_cleaned=False)
        files = sorted(Path(file).parts[-2:] for files in self.source.files.values() for file in files)
        place = (self.stretch.key, self.stretch.side_m, self.stretch.frame.origin.tolist())
        return fingerprint(place, files, settings, self.version)

    def differs_here(self) -> Failure | None:
        """Refuse to run where the code or the weights are not those of whoever asks."""
        weights = choose(self.parameters.gauge_m, self.parameters.head_width_m).path
        if version(weights) == self.version:
            return None
        return Failure(f"A worker has another version of Rail Extract ({CORE.parent}): install the same everywhere.")

    def neighbours(self) -> list[Key]:
        """Name the stretch and those around it, by their squares."""
        if not np.isfinite(self.stretch.side_m):
            return [self.stretch.key]
        return [key for key in around(self.stretch.key) if key in self.source.counts]

    def file(self, kind: str, name: str) -> Path:
        """Place of a result."""
        return Path(self.folder) / f"{kind}_{name}.npz"


def sort_points(request: Request, header: CloudHeader, side_m: float, folder: str) -> SpooledFile | Failure:
    """Sort the rail points of one file into squares."""
    try:
        return spool_file(request, header, side_m, Path(folder))
    except DiskError:
        raise
    except RailExtractError as error:
        return Failure(str(error))
    except OSError as error:
        return Failure(f"{header.path.name} can't be read ({error.strerror}): check the disk or the network drive.")


def clean(task: SquareTask) -> str | Failure:
    """Clean the raster of a stretch, unless that is done; gives the file."""
    path, refusal = task.file("raster", task.name), task.differs_here()
    if refusal:
        return refusal
    if not path.exists():
        try:
            save_raster(path, clean_square(task.source, task.stretch, task.parameters, _engine(task.parameters)))
        except DiskError:
            raise
        except Exception as error:  # noqa: BLE001 - whatever a stretch dies of, the others shall live
            return Failure(f"Square {task.stretch.key} could not be cleaned ({error}).")
    return str(path)


def draw(task: SquareTask, rasters: Sequence[str | Failure]) -> str | Failure:
    """Draw the rails of a stretch, unless that is done, from what was cleaned of its `neighbours`; gives the file."""
    files = {key: file for key, file in zip(task.neighbours(), rasters) if isinstance(file, str)}
    if task.stretch.key not in files:
        return rasters[task.neighbours().index(task.stretch.key)]
    refusal = task.differs_here()
    if refusal:
        return refusal
    path = task.file("rails", fingerprint(task.name, sorted(Path(file).name for file in files.values())))
    if not path.exists():
        try:
            cleaned = {key: load_raster(Path(file)) for key, file in files.items()}
            save_rails(path, rails_of_square(task.source, task.stretch, cleaned, task.parameters))
        except DiskError:
            raise
        except Exception as error:  # noqa: BLE001 - as above
            return Failure(f"The rails of stretch {task.stretch.key} could not be drawn ({error}).")
    return str(path)


_OF_THREAD = threading.local()
"""Engines of this worker's threads; OpenCV's can't be shared among them."""


def _engine(parameters: Parameters) -> Engine:
    """Set the engine up once for each thread of a worker."""
    wanted = (parameters.gauge_m, parameters.head_width_m, parameters.engine, parameters.device)
    if getattr(_OF_THREAD, "wanted", None) != wanted:
        _OF_THREAD.engine, _OF_THREAD.wanted = engine_for(parameters), wanted
    return _OF_THREAD.engine
