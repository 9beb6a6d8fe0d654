"""Worker processes: how one is started and ended, and what it does with the tasks that come through its input.

Imports nothing that takes time: a process says that it is ready before a task makes it load numpy.
"""

from __future__ import annotations

import os
import pickle  # nosec B403 - read from processes that this one has started, or that started it
import signal
import subprocess  # nosec B404 - starts this Python only
import sys
import threading
import time
from collections.abc import Hashable, Mapping
from contextlib import suppress
from dataclasses import dataclass, field
from enum import IntEnum
from queue import SimpleQueue
from typing import Any, Callable

from ..kernels import ENVIRONMENT
from .tasks import CHECK_EVERY_S, Answer, Context, Heard, Once, Task

PROGRAM = "import sys; sys.path[:] = sys.argv[1:]; from {} import serve; serve()"
"""Looks for modules where this process does: the current folder, which is the first place otherwise, may hold any."""

NO_WINDOW = getattr(subprocess, "CREATE_NO_WINDOW", 0)
"""On Windows, a console would open for each process."""


class Kind(IntEnum):
    """What a message says."""

    READY = 0
    """The process has started."""
    FRACTION = 1
    """How much of the task is done."""
    STATUS = 2
    """What the task is doing."""
    ANSWER = 3
    """The `Answer`."""
    ENDED = 4
    """The process has ended."""


Send = Callable[[Kind, Any], None]
"""Sends a message: its kind, and what belongs to it."""


@dataclass(frozen=True)
class Interpreter:
    """A Python program, and the environment variables that it needs in addition to those of this process."""

    program: str
    changes: Mapping[str, str] = field(default_factory=dict)


Messages = SimpleQueue
"""Of (worker, kind, content)."""


class Worker:
    """A process that executes one task after another, and puts (worker, kind, content) for each message into a queue.

    It ends with this one, however that ends: its input ends then.
    """

    def __init__(self, interpreter: Interpreter, messages: Messages) -> None:
        self._process = subprocess.Popen(  # nosec B603
            [interpreter.program, "-c", PROGRAM.format(__name__), *sys.path],
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

    def send(self, task: Task, inputs: Mapping[Hashable, bytes]) -> None:
        """Send a task and the pickled results that it takes; if the process has ended, a message says so."""
        content = pickle.dumps((task, dict(inputs)), pickle.HIGHEST_PROTOCOL)
        try:
            pickle.dump(content, self._process.stdin, pickle.HIGHEST_PROTOCOL)  # type: ignore[arg-type]
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
            messages.put((self, Kind.ENDED, None))


def serve() -> None:
    """Execute tasks until the input ends, as it does when the process that started this one ends in any way."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # a terminal sends Ctrl-C to all; the parent process ends its workers
    output = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)  # what libraries print would be taken for messages

    def send(kind: Kind, content: Any) -> None:
        pickle.dump((kind, content), output, pickle.HIGHEST_PROTOCOL)
        output.flush()

    tasks: SimpleQueue[bytes] = SimpleQueue()
    threading.Thread(target=_receive, args=(tasks,), daemon=True).start()
    send(Kind.READY, None)
    once = Once()
    while True:
        send(Kind.ANSWER, answer(tasks.get(), once, send))


def _receive(tasks: SimpleQueue[bytes]) -> None:
    """Pass tasks on; end the process with its input, whatever it is computing."""
    while True:
        try:
            tasks.put(pickle.load(sys.stdin.buffer))  # nosec B301
        except (EOFError, OSError, pickle.UnpicklingError):
            os._exit(0)


def answer(content: bytes, once: Once, send: Send) -> Answer:
    """Execute what `Worker.send` has sent."""
    heard = _Reported(send)

    def compute() -> bytes:
        task, inputs = pickle.loads(content)  # nosec B301
        results = {name: pickle.loads(one) for name, one in inputs.items()}  # nosec B301
        return pickle.dumps(task.function(*task.arguments, Context(results, once, heard)), pickle.HIGHEST_PROTOCOL)

    return heard.answer(compute)


class _Reported(Heard):
    """Sends how far a task is, too."""

    def __init__(self, send: Send) -> None:
        super().__init__()
        self._send, self._sent = send, time.monotonic()

    def set_fraction(self, fraction: float) -> None:
        now = time.monotonic()
        if now - self._sent >= CHECK_EVERY_S:
            self._sent = now
            self._send(Kind.FRACTION, fraction)

    def status(self, text: str) -> None:
        self._send(Kind.STATUS, text)
