"""What the commands share: options with several numbers, and progress on the console."""

from __future__ import annotations

import sys

from ..errors import ParameterError
from ..progress import Progress


def numbers_in(text: str, option: str, kind: type) -> tuple:
    """Return the distinct numbers in a text such as "10,11" or "1000;1067".

    Raises
    ------
    ParameterError
        The text holds something else.
    """
    try:
        return tuple(dict.fromkeys(kind(word) for word in text.replace(";", ",").split(",") if word.strip()))
    except ValueError:
        raise ParameterError(f'{option} "{text}" should be numbers such as 10 or 10,11.') from None


def extent_of(text: str | None) -> tuple[float, float, float, float] | None:
    """Return the numbers of `--extent`.

    Raises
    ------
    ParameterError
        The text does not hold four numbers.
    """
    if text is None:
        return None
    try:
        xmin, ymin, xmax, ymax = (float(word) for word in text.split(","))
    except ValueError:
        raise ParameterError(f'--extent "{text}" should be four numbers: xmin,ymin,xmax,ymax.') from None
    return xmin, ymin, xmax, ymax


class Console(Progress):
    """Prints the remaining time and the warnings to the error output."""

    def status(self, text: str) -> None:
        """Print the current activity."""
        print(text, file=sys.stderr, flush=True)

    def warning(self, text: str) -> None:
        """Print a warning."""
        print(f"Warning: {text}", file=sys.stderr, flush=True)
