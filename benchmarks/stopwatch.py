"""Processor time by stage: functions are wrapped, and a stage does not count the stages within it."""

from __future__ import annotations

import time
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import wraps
from inspect import isgeneratorfunction
from typing import Any


class Stopwatch:
    """Sums up processor time, seconds, by stage."""

    def __init__(self, clock: Callable[[], float] = time.process_time) -> None:
        self.spent_s: Counter[str] = Counter()
        self._clock, self._open, self._since = clock, [""], clock()

    @contextmanager
    def stage(self, name: str) -> Iterator[None]:
        """Count the time of a block to a stage; the one around it stands still meanwhile."""
        self._count()
        self._open.append(name)
        try:
            yield
        finally:
            self._count()
            self._open.pop()

    def time(self, owner: Any, function: str, name: str) -> None:
        """Count all calls of a function of a module or class to a stage; a generator's, while it is asked for more."""
        own = vars(owner)[function]
        inner = own.__func__ if isinstance(own, classmethod) else own

        @wraps(inner)
        def timed(*arguments: Any, **options: Any) -> Any:
            with self.stage(name):
                return inner(*arguments, **options)

        @wraps(inner)
        def stepwise(*arguments: Any, **options: Any) -> Iterator[Any]:
            steps = inner(*arguments, **options)
            while True:
                with self.stage(name):
                    item = next(steps, steps)
                if item is steps:
                    return
                yield item

        wrapper = stepwise if isgeneratorfunction(inner) else timed
        setattr(owner, function, classmethod(wrapper) if isinstance(own, classmethod) else wrapper)

    def _count(self) -> None:
        now = self._clock()
        self.spent_s[self._open[-1]] += now - self._since
        self._since = now
