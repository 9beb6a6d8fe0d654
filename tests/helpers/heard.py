"""A listener that keeps what a run reports, and cancels it where it is told to."""

from __future__ import annotations

from rail_extract.core.progress import Progress


class Heard(Progress):
    """Cancels from a fraction of the run on, or after a number of looks at whether it is cancelled."""

    def __init__(self, cancel_at: float = 2.0, cancel_after: float = float("inf")) -> None:
        self.said: list[tuple[str, str]] = []
        """Kind and text of each message: status, info or warning."""
        self.fractions: list[float] = []
        self.proposed: list[str] = []
        self.looks, self._cancel_at, self._cancel_after = 0, cancel_at, cancel_after

    def set_fraction(self, fraction):
        self.fractions.append(fraction)

    def status(self, text):
        self.said.append(("status", text))

    def info(self, text):
        self.said.append(("info", text))

    def warning(self, text):
        self.said.append(("warning", text))

    def propose(self, standard):
        self.proposed.append(standard)

    def is_cancelled(self):
        self.looks += 1
        return self.looks > self._cancel_after or bool(self.fractions) and self.fractions[-1] >= self._cancel_at

    def texts(self, kind: str = "") -> list[str]:
        """Messages of a kind, or all."""
        return [text for one, text in self.said if kind in ("", one)]

    warnings = property(lambda self: self.texts("warning"))
    infos = property(lambda self: self.texts("info"))
