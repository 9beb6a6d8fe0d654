"""What every step of a run along guides is given."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from ..clouds.points import Request
from ..parameters import AirborneParameters
from ..progress import SILENT, Progress
from ..run.loop import Runner


@dataclass(frozen=True)
class Run:
    """A run on an airborne cloud.

    Attributes
    ----------
    request : Request
        Files, classes and extent.
    folder : Path
        Folder for points, 28 bytes for each around the guides; the caller removes it.
    runner : Runner
        Executes one task per file and one per square.
    """

    request: Request
    parameters: AirborneParameters
    folder: Path
    runner: Runner
    progress: Progress = SILENT
