"""What a worker process does: it executes the tasks that come through its input, and answers through its output.

Imports nothing that takes time: the process says that it is ready before a task makes it load numpy.
"""

from __future__ import annotations

import os
import pickle  # nosec B403 - read from the process that started this one only
import signal
import sys
import threading
import time
from collections.abc import Hashable, Mapping
from dataclasses import dataclass
from queue import SimpleQueue
from typing import Any, Callable

from ..progress import Progress
from ..tasks import Context, Once, Task

REPORT_EVERY_S = 0.1
"""Least time between two reports of the fraction that is done."""

READY, FRACTION, STATUS, ANSWER = range(4)
"""What a message says: the process has started; how much of the task is done; what it is doing; its `Answer`."""

Send = Callable[[int, Any], None]
"""Sends a message: one of the above, and what belongs to it."""


@dataclass(frozen=True)
class Answer:
    """What comes of a task.

    Attributes
    ----------
    result : bytes
        The result, pickled; not to be read if there is an error.
    error : BaseException or None
        What the task raised.
    said : tuple of (str, str)
        Name of a method of `Progress`, and the text with which the task called it.
    """

    result: bytes
    error: BaseException | None
    said: tuple[tuple[str, str], ...]


def serve() -> None:
    """Execute tasks until the input ends, as it does when the process that started this one ends in any way."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # a terminal sends Ctrl-C to all; the parent process ends its workers
    output = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)  # what libraries print would be taken for messages

    def send(kind: int, content: Any) -> None:
        pickle.dump((kind, content), output, pickle.HIGHEST_PROTOCOL)
        output.flush()

    tasks: SimpleQueue[bytes] = SimpleQueue()
    threading.Thread(target=_receive, args=(tasks,), daemon=True).start()
    send(READY, None)
    once = Once()
    while True:
        send(ANSWER, answer(tasks.get(), once, send))


def _receive(tasks: SimpleQueue[bytes]) -> None:
    """Pass tasks on; end the process with its input, whatever it is computing."""
    while True:
        try:
            tasks.put(pickle.load(sys.stdin.buffer))  # nosec B301
        except (EOFError, OSError, pickle.UnpicklingError):
            os._exit(0)


def packed(task: Task, inputs: Mapping[Hashable, bytes]) -> bytes:
    """Return a task and the pickled results that it takes, as `answer` reads them."""
    return pickle.dumps((task, dict(inputs)), pickle.HIGHEST_PROTOCOL)


def answer(content: bytes, once: Once, send: Send) -> Answer:
    """Execute a task; errors of every kind are for the parent process to raise."""
    heard = _Heard(send)
    try:
        task, inputs = pickle.loads(content)  # nosec B301
        results = {name: pickle.loads(one) for name, one in inputs.items()}  # nosec B301
        result = task.function(*task.arguments, Context(results, once, heard))
        return Answer(pickle.dumps(result, pickle.HIGHEST_PROTOCOL), None, tuple(heard.said))
    except BaseException as error:  # lazrs raises one on damaged files that is not an `Exception`
        return Answer(b"", _sendable(error), tuple(heard.said))


def _sendable(error: BaseException) -> BaseException:
    """Return an error, or one that says the same if it can't be pickled or made again."""
    try:
        pickle.loads(pickle.dumps(error))  # nosec B301
        return error
    except Exception:
        return RuntimeError(f"{type(error).__name__}: {error}")


class _Heard(Progress):
    """Sends how far a task is, and keeps what it says for the log."""

    def __init__(self, send: Send) -> None:
        self.said: list[tuple[str, str]] = []
        self._send, self._sent = send, time.monotonic()

    def set_fraction(self, fraction: float) -> None:
        now = time.monotonic()
        if now - self._sent >= REPORT_EVERY_S:
            self._sent = now
            self._send(FRACTION, fraction)

    def status(self, text: str) -> None:
        self._send(STATUS, text)

    def info(self, text: str) -> None:
        self.said.append(("info", text))

    def warning(self, text: str) -> None:
        self.said.append(("warning", text))

    def propose(self, standard: str) -> None:
        self.said.append(("propose", standard))
