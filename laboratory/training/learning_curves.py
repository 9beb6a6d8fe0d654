"""The course of a training, drawn from its log."""

from __future__ import annotations

import csv
from pathlib import Path

import numpy as np

MAX_BINS = 100
"""Points of a curve: single steps jump with the difficulty of their crops, means of some show the course."""


def draw_curves(log: Path, picture: Path) -> None:
    """Draw loss and F1 of each pass against the step, as means over equal numbers of steps.

    Parameters
    ----------
    log : Path
        Written by `train`: columns step, rate, loss_1, ..., f1_1, ..., seconds.
    picture : Path
        PNG to write.
    """
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
    """Read a log's columns; of a step that a resumed training repeated, the last row counts."""
    with path.open(newline="") as file:
        rows = list(csv.DictReader(file))
    last = {int(row["step"]): row for row in rows}
    return {name: np.array([float(last[step][name]) for step in sorted(last)]) for name in rows[0]}


def binned(steps: np.ndarray, values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Average runs of neighbouring steps, at most `MAX_BINS` of them."""
    groups = np.array_split(np.arange(len(steps)), min(MAX_BINS, len(steps)))
    return tuple(np.array([column[group].mean() for group in groups]) for column in (steps, values))
