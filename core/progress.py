"""Progress of a run: the fraction done, messages to the user, and cancellation."""

from __future__ import annotations

import time
from collections.abc import Callable, Collection, Iterable, Iterator, Sequence
from itertools import accumulate
from typing import TypeVar, overload

from .errors import Cancelled

Item = TypeVar("Item")

REPORT_EVERY_S = 5.0
"""Interval between reports of the remaining time, and run time before the first."""

LEAST_DONE = 0.05
"""Fraction that must be done by an activity before its speed says anything: what comes first, such as the start of
processes or a dense square, took a thousandth of a run and a tenth of its time."""

SURE_FACTOR = 2.0
"""Factor by which the speed may differ between the third and the last quarter of an activity; where it differs more,
the remaining time is not known."""

READING = 0.3
"""Share of the progress of a job that reading its inputs takes, at most."""

LEAST_LEFT_S = 10.0
"""Remaining time below which none is reported: the estimate would be gone before it is read."""


class Progress:
    """Receives the progress of a run; this base class shows nothing and never cancels.

    A front end overrides the methods for what it can show: `set_fraction`, `status`, `info`, `warning`, `propose`
    and `is_cancelled`.
    """

    def set_fraction(self, fraction: float) -> None:
        """Report that `fraction` (0 to 1) of the work is done."""

    def status(self, text: str) -> None:
        """Report the current activity, to be shown until the next status."""

    def reading(self) -> None:
        """Report that files are read until the next status: the speed of this says nothing about that of the rest."""

    def info(self, text: str) -> None:
        """Report a message for the log."""

    def warning(self, text: str) -> None:
        """Report something that the user should look at."""

    def propose(self, standard: str) -> None:
        """Report the name of a rail standard that fits the points better than the one stated."""

    def is_cancelled(self) -> bool:
        """Return whether the user has cancelled the run."""
        return False

    def check(self) -> None:
        """Raise `Cancelled` if the user has cancelled; call it at least every half second."""
        if self.is_cancelled():
            raise Cancelled

    def span(self, start: float, end: float) -> Progress:
        """Return the progress of a step that takes this one from fraction `start` to fraction `end`."""
        return _Span(self, start, end)

    def split(self, count: int) -> list[Progress]:
        """Return the progresses of `count` equal steps of this one."""
        return [self.span(number / count, (number + 1) / count) for number in range(count)]

    def divide(self, weights: Sequence[float]) -> list[Progress]:
        """Return the progresses of steps of this one, in proportion to their weights."""
        ends = list(accumulate(weights))
        return [self.span((end - weight) / ends[-1], end / ends[-1]) for weight, end in zip(weights, ends)]

    def after_reading(self) -> tuple[Progress, Progress]:
        """Return the progress of reading the inputs of a job, and that of what follows."""
        return self.span(0, READING), self.span(READING, 1)

    @overload
    def follow(self, items: Collection[Item]) -> Iterator[Item]: ...

    @overload
    def follow(self, items: Iterable[Item], total: int) -> Iterator[Item]: ...

    def follow(self, items, total=None):
        """Yield items, `total` in number; before each, check for cancellation; after each, advance the fraction."""
        count = len(items) if total is None else total
        for number, item in enumerate(items, start=1):
            self.check()
            yield item
            self.set_fraction(number / max(count, 1))


class _Relay(Progress):
    """Passes everything on to another progress."""

    def __init__(self, listener: Progress) -> None:
        self._listener = listener

    def set_fraction(self, fraction: float) -> None:
        self._listener.set_fraction(fraction)

    def status(self, text: str) -> None:
        self._listener.status(text)

    def reading(self) -> None:
        self._listener.reading()

    def info(self, text: str) -> None:
        self._listener.info(text)

    def warning(self, text: str) -> None:
        self._listener.warning(text)

    def propose(self, standard: str) -> None:
        self._listener.propose(standard)

    def is_cancelled(self) -> bool:
        return self._listener.is_cancelled()


class _Span(_Relay):
    """Part of another progress, from fraction `start` to fraction `end`."""

    def __init__(self, parent: Progress, start: float, end: float) -> None:
        super().__init__(parent)
        self._start, self._end = start, end

    def set_fraction(self, fraction: float) -> None:
        super().set_fraction(self._start + (self._end - self._start) * fraction)

    def span(self, start: float, end: float) -> Progress:
        """Return the progress of a step of this one as a part of its parent, so that steps of steps do not pile up."""
        length = self._end - self._start
        return _Span(self._listener, self._start + length * start, self._start + length * end)


class Share(_Relay):
    """Passes everything on; fractions go to a function that adds up those of all shares."""

    def __init__(self, listener: Progress, advance: Callable[[float], None]) -> None:
        super().__init__(listener)
        self._advance = advance

    def set_fraction(self, fraction: float) -> None:
        """Report the fraction of this share."""
        self._advance(fraction)


class Recording(_Relay):
    """Passes everything on, and keeps the warnings, each once."""

    def __init__(self, listener: Progress) -> None:
        super().__init__(listener)
        self._warnings: dict[str, None] = {}

    @property
    def warnings(self) -> tuple[str, ...]:
        """The warnings, in order."""
        return tuple(self._warnings)

    def warning(self, text: str) -> None:
        """Pass a warning on and keep it."""
        super().warning(text)
        self._warnings[text] = None


class Estimating(_Relay):
    """Passes everything on to a listener, and reports the remaining time, estimated from the second half of the time.

    A status begins an activity with a speed of its own: the time before it, such as that of an import, does not count.
    Nothing is reported while files are read, and until the time is known to a factor of two. `clock` returns seconds.
    """

    def __init__(self, listener: Progress, clock: Callable[[], float] = time.monotonic) -> None:
        super().__init__(listener)
        self._clock = clock
        self._marks = [(clock(), 0.0)]
        self._is_reading = False
        self._fraction = 0.0

    def status(self, text: str) -> None:
        """Pass the activity on, and measure its speed from here."""
        super().status(text)
        self._marks, self._is_reading = [(self._clock(), self._fraction)], False

    def reading(self) -> None:
        """Estimate nothing until the next status."""
        super().reading()
        self._is_reading = True

    def set_fraction(self, fraction: float) -> None:
        """Pass the fraction on, and every few seconds report the remaining time as status."""
        super().set_fraction(fraction)
        self._fraction = fraction
        now = self._clock()
        if self._is_reading or now - self._marks[-1][0] < REPORT_EVERY_S:
            return
        self._marks.append((now, fraction))
        left_s = self._left_s()
        if left_s is not None and left_s >= LEAST_LEFT_S:
            super().status(f"{100 * fraction:.0f} % done, about {_rounded(left_s)} left")

    def _left_s(self) -> float | None:
        """Estimate the remaining time from what is done since the activity began; None where it is not known."""
        (start, before), (now, fraction) = self._marks[0], self._marks[-1]
        if fraction - before < LEAST_DONE or fraction >= 1.0:
            return None
        quarter_s = (now - start) / 4
        half, last = (self._fraction_at(start + number * quarter_s) for number in (2, 3))
        slower, faster = sorted((last - half, fraction - last))
        if slower <= 0 or faster > SURE_FACTOR * slower:
            return None
        return (1.0 - fraction) * 2 * quarter_s / (fraction - half)

    def _fraction_at(self, moment: float) -> float:
        """Return what was done at a moment of the activity, by the marks around it."""
        number = next(number for number, (at, _) in enumerate(self._marks) if at >= moment)
        (before, done), (after, more) = self._marks[number - 1], self._marks[number]
        return done + (more - done) * (moment - before) / (after - before)


def _rounded(seconds: float) -> str:
    """Write a time, rounded to the precision of an estimate."""
    if seconds < 90:
        return f"{10 * round(seconds / 10)} seconds"
    if seconds < 5400:
        return f"{round(seconds / 60)} minutes"
    return f"{seconds / 3600:.1f} hours"


def counted(count: int, one: str, many: str = "") -> str:
    """Write a number of things, for messages.

    >>> counted(1, "file"), counted(2000, "file"), counted(0, "pass", "passes")
    ('1 file', '2,000 files', '0 passes')
    """
    return f"{count:,} {one if count == 1 else many or one + 's'}"


def metres(length_m: float) -> str:
    """Format a length for reading: 0.4 m, 39 m, 1,234 m, 12.3 km."""
    if length_m >= 10_000:
        return f"{length_m / 1000:,.1f} km"
    return f"{length_m:.1f} m" if length_m < 10 else f"{length_m:,.0f} m"


def written(value: float, form: str = ".1f") -> str:
    """Write a number, for messages; what rounds to 0 is 0, without a minus.

    >>> written(-1.26), written(-0.04), written(-0.04, "+.1f")
    ('-1.3', '0.0', '+0.0')
    """
    rounded = f"{value:{form}}"
    return rounded if rounded.strip("+-0.") else f"{0.0:{form}}"


SILENT = Progress()


class Until(_Relay):
    """Cancels after a time."""

    def __init__(self, listener: Progress, limit_s: float) -> None:
        super().__init__(listener)
        self._end = time.monotonic() + limit_s

    def is_cancelled(self) -> bool:
        """Return whether the time is over, or the user has cancelled the run."""
        return super().is_cancelled() or time.monotonic() > self._end
