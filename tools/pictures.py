"""Draw pictures for the documentation, all or those that are named on the command line."""

from __future__ import annotations

import sys
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

import matplotlib.pyplot as plt
from matplotlib.figure import Figure


def draw_pictures(pictures: Mapping[str, Callable[[], Figure]], folder: Path, dpi: int, names: Sequence[str]) -> None:
    """Draw the pictures that are named, or all, as PNG files of their names."""
    unknown = sorted({*names} - {*pictures})
    if unknown:
        sys.exit(f"There is no picture {unknown[0]}: choose from {', '.join(pictures)}.")
    folder.mkdir(parents=True, exist_ok=True)
    for name in names or pictures:
        path = folder / f"{name}.png"
        pictures[name]().savefig(path, dpi=dpi, pil_kwargs={"optimize": True})
        plt.close("all")
        print(f"{path.name}: {path.stat().st_size / 1000:.0f} kB", flush=True)
