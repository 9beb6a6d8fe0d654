"""Loss and F1 during training, drawn from the log."""

from __future__ import annotations

import csv
from pathlib import Path

import numpy as np

MAX_BINS = 100
"""Largest number of points of a curve: single steps vary with the difficulty of their crops, means do not."""


def draw_curves(log: Path, picture: Path) -> None:
    """Draw loss and F1 of each pass by step, as means over equal numbers of steps, from a log of `train` as PNG."""
    from matplotlib.figure import Figure

    columns = read_log(log)
    figure = Figure(figsize=(10, 4), layout="constrained")
    axes = dict(zip(("loss", "f1"), figure.subplots(1, 2)))
    for name, values in columns.items():
        quantity, _, number = name.partition("_")
        if quantity in axes:
            axes[quantity].plot(*binned(columns["step"], values), label=f"pass {number}")
    for axis, title in zip(axes.values(), ("loss", "F1 of the training crops")):
        axis.set(xlabel="step", ylabel=title)
        axis.grid(alpha=0.3)
        axis.legend()
    figure.savefig(picture, dpi=100)


def read_log(path: Path) -> dict[str, np.ndarray]:
    """Read the columns of a log; where a resumed training repeated a step, its last row counts."""
    with path.open(newline="") as file:
        rows = list(csv.DictReader(file))
    last = {int(row["step"]): row for row in rows}
    return {name: np.array([float(last[step][name]) for step in sorted(last)]) for name in rows[0]}


def binned(steps: np.ndarray, values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the means of steps and values over at most `MAX_BINS` groups of consecutive steps."""
    groups = np.array_split(np.arange(len(steps)), min(MAX_BINS, len(steps)))
    middles, means = (np.array([column[group].mean() for group in groups]) for column in (steps, values))
    return middles, means
