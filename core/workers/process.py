"""A worker process: how it is started, what is sent to it, and how it ends."""

from __future__ import annotations

import os
import pickle  # nosec B403 - read from processes that this one has started only
import subprocess  # nosec B404 - starts this Python only
import sys
import threading
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass, field
from queue import SimpleQueue

from ..kernels import ENVIRONMENT

ENDED = -1
"""The message of a process that has ended; `serving` lists the others."""

PROGRAM = "import sys; sys.path[:] = sys.argv[1:]; from {} import serve; serve()"
"""Looks for modules where this process does: the current folder, which is the first place otherwise, may hold any."""

NO_WINDOW = getattr(subprocess, "CREATE_NO_WINDOW", 0)
"""On Windows, a console would open for each process."""


@dataclass(frozen=True)
class Interpreter:
    """A Python program, and the environment variables that it needs in addition to those of this process."""

    program: str
    changes: Mapping[str, str] = field(default_factory=dict)


Messages = SimpleQueue
"""Of (worker, kind, content)."""


class Worker:
    """A process that executes one task after another.

    It ends with this one, however that ends: its input ends then.

    Parameters
    ----------
    interpreter : Interpreter
    messages : SimpleQueue
        Receives (worker, kind, content) for each message, from a thread of its own.
    """

    def __init__(self, interpreter: Interpreter, messages: Messages) -> None:
        self._process = subprocess.Popen(  # nosec B603
            [interpreter.program, "-c", PROGRAM.format(f"{__package__}.serving"), *sys.path],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            env={**os.environ, **ENVIRONMENT, **interpreter.changes},
            creationflags=NO_WINDOW,
        )
        threading.Thread(target=self._listen, args=(messages,), daemon=True).start()

    @property
    def number(self) -> int:
        """The number of the process."""
        return self._process.pid

    def send(self, task: bytes) -> None:
        """Send a task; if the process has ended, a message says so."""
        try:
            pickle.dump(task, self._process.stdin, pickle.HIGHEST_PROTOCOL)  # type: ignore[arg-type]
            self._process.stdin.flush()  # type: ignore[union-attr]
        except OSError:
            self._process.kill()

    def end(self) -> None:
        """End the process, whatever it is doing, and wait until it has ended."""
        self._process.kill()
        self._process.wait()
        for pipe in (self._process.stdin, self._process.stdout):
            with suppress(OSError):  # what was not sent is still in its buffer
                pipe.close()  # type: ignore[union-attr]

    def _listen(self, messages: Messages) -> None:
        """Pass messages on until the process ends."""
        try:
            while True:
                messages.put((self, *pickle.load(self._process.stdout)))  # type: ignore[arg-type] # nosec B301
        except Exception:  # noqa: BLE001 - cut off in the middle, a message can raise anything
            messages.put((self, ENDED, None))
