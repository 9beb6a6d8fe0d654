"""Runs programs through Qt: their output goes to the log line by line, and cancelling ends them."""

from __future__ import annotations

import tempfile
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from qgis.PyQt.QtCore import QProcess, QProcessEnvironment

from ...core.disk import scratch_folder
from ...core.progress import SILENT, Progress

POLL_MS = 200
"""Interval at which output is shown and cancellation is checked, milliseconds."""


@dataclass(frozen=True)
class Completed:
    """The output of a program, with errors, and its exit code: None if it could not be started or crashed."""

    code: int | None
    output: str


def run(
    program: str, arguments: Sequence[str], changes: Mapping[str, str] | None = None, progress: Progress = SILENT
) -> Completed:
    """Run a program to its end, in a folder of its own: Python would import modules from the current folder.

    The path is absolute; `changes` are environment variables that differ from those of QGIS; the progress receives the
    lines of the output. If the user cancels, the program is ended and Cancelled raised.
    """
    environment = QProcessEnvironment.systemEnvironment()
    for name, value in (changes or {}).items():
        environment.insert(name, value)
    process = QProcess()
    process.setProcessEnvironment(environment)
    process.setProcessChannelMode(QProcess.ProcessChannelMode.MergedChannels)
    log = _Log(progress)
    with scratch_folder(Path(tempfile.gettempdir())) as folder:
        process.setWorkingDirectory(str(folder))
        process.start(program, list(arguments))
        try:
            not_running = QProcess.ProcessState.NotRunning
            while process.state() != not_running and not process.waitForFinished(POLL_MS):
                log.add(bytes(process.readAll()))
                progress.check()
        finally:
            process.kill()
            process.waitForFinished()
    log.add(bytes(process.readAll()), last=True)
    failed = process.error() in (QProcess.ProcessError.FailedToStart, QProcess.ProcessError.Crashed)
    return Completed(None if failed else process.exitCode(), log.text)


class _Log:
    """Splits a stream of bytes into lines for the progress log."""

    def __init__(self, progress: Progress) -> None:
        self.text = ""
        self._progress = progress
        self._rest = b""

    def add(self, data: bytes, last: bool = False) -> None:
        *lines, self._rest = (self._rest + data).split(b"\n")
        if last and self._rest:
            lines.append(self._rest)
        for line in lines:
            text = line.decode("utf-8", "replace").rstrip()
            self.text += f"{text}\n"
            if text:
                self._progress.info(text)
