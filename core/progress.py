"""How the core reports: a fraction done, messages, and whether the user cancelled."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from typing import TypeVar

from .errors import Cancelled

Item = TypeVar("Item")


class Progress:
    """A listener that hears nothing and never cancels; front ends override what they show.

    One method a front end overrides for each thing it can show: `set_fraction`, `info`, `warning`, `is_cancelled`.
    """

    def set_fraction(self, fraction: float) -> None:
        """Take note that `fraction` (0 to 1) of the work is done."""

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
        self.info: Callable[[str], None] = parent.info
        self.warning: Callable[[str], None] = parent.warning
        self.is_cancelled: Callable[[], bool] = parent.is_cancelled

    def set_fraction(self, fraction: float) -> None:
        self._parent.set_fraction(self._start + (self._end - self._start) * fraction)


SILENT = Progress()
