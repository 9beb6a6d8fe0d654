"""What the commands share: the packages that they need, and progress on the console."""

from __future__ import annotations

import signal
import sys
from collections.abc import Callable
from importlib import import_module
from typing import Any

from ..errors import ParameterError
from ..progress import Progress


def vector_module(option: str, name: str = "vectors") -> Any:
    """Return the module that reads vector files, or another one of this package that needs the same packages.

    Raises ParameterError if the packages are not installed; `option` is what needs them.
    """
    try:
        return import_module(f".{name}", __package__)
    except ImportError as error:
        raise ParameterError(
            f"{option} needs the packages pyogrio and shapely: in a clone, run pip install .[cluster]."
        ) from error


class Console(Progress):
    """Prints steps, remaining time and warnings to the error output; Ctrl-C cancels it.

    Python drops the exception of a Ctrl-C that comes during a finalizer or some callbacks. The run then ends at its
    next check for cancellation. `word` returns a message with the names of options for those of parameters.
    """

    def __init__(self, word: Callable[[str], str] = str) -> None:
        self._interrupted, self._word = False, word
        signal.signal(signal.SIGINT, self._interrupt)

    def _interrupt(self, *_: object) -> None:
        self._interrupted = True
        raise KeyboardInterrupt

    def is_cancelled(self) -> bool:
        """Return whether there was a Ctrl-C."""
        return self._interrupted

    def status(self, text: str) -> None:
        """Print the current activity."""
        print(text, file=sys.stderr, flush=True)

    def info(self, text: str) -> None:
        """Print what was done."""
        print(self._word(text), file=sys.stderr, flush=True)

    def warning(self, text: str) -> None:
        """Print a warning."""
        print(f"Warning: {self._word(text)}", file=sys.stderr, flush=True)
