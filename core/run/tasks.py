"""Tasks, pieces of work that can run in any process, and the version by which computers see that they run the same."""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Hashable, Mapping
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any

from ..progress import Progress

READ_S = 1e-6
"""Run time per point that is read or written, compressed, in seconds; the weight of such tasks."""

CORE = Path(__file__).resolve().parent.parent


class Once:
    """The latest result that is worth keeping for further tasks in the same thread, such as an engine."""

    def __init__(self) -> None:
        self._kept: dict[tuple, Any] = {}

    def keeps(self, function: Callable[..., Any], *arguments: Hashable) -> bool:
        """Return whether ``function(*arguments)`` is there already."""
        return (function, arguments) in self._kept

    def __call__(self, function: Callable[..., Any], *arguments: Hashable) -> Any:
        """Return ``function(*arguments)``, computed only if the call before this one was different."""
        key = (function, arguments)
        if key not in self._kept:
            self._kept = {key: function(*arguments)}
        return self._kept[key]


@dataclass(frozen=True)
class Context:
    """What a task gets beside its arguments: results of all its needs, and of what it uses if that did not fail."""

    results: Mapping[Any, Any]
    once: Once
    progress: Progress

    def network(self, function: Callable[..., Any], *arguments: Hashable) -> Any:
        """Return ``once(function, *arguments)``; the progress names the start of a network as an activity of its own.

        The import of its library takes seconds in which nothing of the task is done.
        """
        if not self.once.keeps(function, *arguments):
            self.progress.status("Starting the network")
            self.once(function, *arguments)
            self.progress.status("The network has started")
        return self.once(function, *arguments)


@dataclass(frozen=True)
class Task:
    """A piece of work that can run in any process, and again if this process ends half-way.

    Attributes
    ----------
    label : str
        What the task does, for error messages.
    function : callable
        Called with the arguments followed by a `Context`. A function of a module, so that other processes find it.
    needs : tuple of Name
        Tasks without whose results this one cannot run.
    uses : tuple of Name
        Tasks that have to finish first, and whose results this one takes if they did not fail.
    weight : float
        Expected run time in seconds, roughly: for the progress, and to decide whether workers are worth their start.
    returned : bool
        Whether the runner returns the result; otherwise it only passes it to other tasks.
    """

    label: str
    function: Callable[..., Any]
    arguments: tuple
    needs: tuple[Hashable, ...] = ()
    uses: tuple[Hashable, ...] = ()
    weight: float = 1.0
    returned: bool = True

    @property
    def inputs(self) -> tuple[Hashable, ...]:
        """Every task whose result this one can take."""
        return (*self.needs, *self.uses)


@lru_cache
def version() -> str:
    """Return the fingerprint of the code and of all weights."""
    digest = hashlib.sha256()
    for file in (*sorted(CORE.rglob("*.py")), *sorted((CORE.parent / "models").glob("*.npz"))):
        digest.update(hashlib.sha256(file.read_bytes()).digest())
    return digest.hexdigest()
