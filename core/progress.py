"""How the core reports: a fraction done, messages, and whether the user cancelled."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from typing import TypeVar

from .errors import Cancelled

Item = TypeVar("Item")

TELL_EVERY_S = 5.0
"""The remaining time is told so often, and not before so much is known."""


class Progress:
    """A listener that hears nothing and never cancels; front ends override what they show.

    One method a front end overrides for each thing it can show: `set_fraction`, `status`, `info`, `warning`,
    `is_cancelled`.
    """

    def set_fraction(self, fraction: float) -> None:
        """Take note that `fraction` (0 to 1) of the work is done."""

    def status(self, text: str) -> None:
        """Show what is going on until the next status comes."""

    def info(self, text: str) -> None:
        """Take note of a message."""

    def warning(self, text: str) -> None:
        """Take note of something the user should look at."""

    def is_cancelled(self) -> bool:
        """Tell whether the user wants the run to end."""
        return False

    def check(self) -> None:
        """Raise `Cancelled` once the user cancelled; call it at least every half second of work."""
        if self.is_cancelled():
            raise Cancelled

    def span(self, start: float, end: float) -> Progress:
        """Give a step its share of this progress, from fraction `start` to fraction `end`."""
        return _Span(self, start, end)

    def split(self, count: int) -> list[Progress]:
        """Give each of `count` equal steps its share of this progress."""
        return [self.span(number / count, (number + 1) / count) for number in range(count)]

    def follow(self, items: Sequence[Item] | Iterable[Item], total: int | None = None) -> Iterator[Item]:
        """Yield `items`, checking for a cancel before each and advancing the fraction after each."""
        count = len(items) if total is None else total  # type: ignore[arg-type]
        for number, item in enumerate(items, start=1):
            self.check()
            yield item
            self.set_fraction(number / max(count, 1))


class _Span(Progress):
    """A stretch of another progress; messages pass through."""

    def __init__(self, parent: Progress, start: float, end: float) -> None:
        self._parent, self._start, self._end = parent, start, end
        self.status: Callable[[str], None] = parent.status
        self.info: Callable[[str], None] = parent.info
        self.warning: Callable[[str], None] = parent.warning
        self.is_cancelled: Callable[[], bool] = parent.is_cancelled

    def set_fraction(self, fraction: float) -> None:
        self._parent.set_fraction(self._start + (self._end - self._start) * fraction)


class Estimating(Progress):
    """Says how long the work will still take, by the speed of its latest half.

    Parameters
    ----------
    listener : Progress
        Hears all else as it is.
    clock : callable
        Gives seconds.
    """

    def __init__(self, listener: Progress, clock: Callable[[], float] = time.monotonic) -> None:
        self._listener, self._clock = listener, clock
        self._marks = [(clock(), 0.0)]
        self._told = -math.inf
        self.status: Callable[[str], None] = listener.status
        self.info: Callable[[str], None] = listener.info
        self.warning: Callable[[str], None] = listener.warning
        self.is_cancelled: Callable[[], bool] = listener.is_cancelled

    def set_fraction(self, fraction: float) -> None:
        """Pass the fraction on, and every few seconds the time that is left."""
        self._listener.set_fraction(fraction)
        now, start = self._clock(), self._marks[0][0]
        if now - self._told < TELL_EVERY_S or now - start < TELL_EVERY_S:
            return
        self._told = now
        self._marks.append((now, fraction))
        half = next(mark for mark in self._marks if mark[0] >= start + (now - start) / 2)
        before = half if half[0] < now else self._marks[0]
        if before[1] < fraction < 1.0:
            left_s = (1.0 - fraction) * (now - before[0]) / (fraction - before[1])
            self.status(f"{100 * fraction:.0f} % done, about {_spoken(left_s)} left")


def _spoken(seconds: float) -> str:
    """Round a time to what an estimate is worth."""
    if seconds < 90:
        return f"{max(10 * round(seconds / 10), 10)} seconds"
    if seconds < 5400:
        return f"{round(seconds / 60)} minutes"
    return f"{seconds / 3600:.1f} hours"


SILENT = Progress()
