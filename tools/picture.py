"""A picture of the lines that were extracted from a cloud."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from rail_extract.core.clouds.points import read_rail_points

RAIL_CLASS = 10
DETAIL_M = 12.0
"""Length of the section shown in detail, in which single points can be seen."""

POINTS, RAIL, TRACK = "#9e9e9e", "#1565c0", "#e64a19"


def draw_map(cloud: Path, rails: Sequence[np.ndarray], centerlines: Sequence[np.ndarray], picture: Path) -> None:
    """Draw the whole scene, a detail and the heights along the tracks.

    Parameters
    ----------
    cloud : Path
        File of the rail points.
    rails, centerlines : sequence of (n, 3) array
        In the coordinates of the cloud.
    picture : Path
        PNG to write.
    """
    (points,) = read_rail_points(cloud, (RAIL_CLASS,))
    frame = points.frame
    rails, centerlines = [[frame.to_local(line) for line in lines] for lines in (rails, centerlines)]
    figure = Figure(figsize=(13, 15))
    whole, detail, heights = figure.subplots(3, 1)
    for axes, size in ((whole, 0.2), (detail, 4)):
        axes.plot(*points.xyz[:, :2].T, ".", color=POINTS, markersize=size, label="rail points")
        _draw(axes, rails, RAIL, "rails")
        _draw(axes, centerlines, TRACK, "track centerlines", linestyle="--")
        axes.set_aspect("equal")
        axes.set(xlabel="x [m]", ylabel="y [m]")
    whole.set_title(f"{cloud.name}: {len(points.xyz)} rail points, {len(rails)} rails, {len(centerlines)} tracks")
    whole.legend(loc="lower right", markerscale=20)
    _zoom(detail, centerlines or rails)
    detail.set_title("Detail")
    direction = _direction(points.xyz)
    for color, lines in ((RAIL, rails), (TRACK, centerlines)):
        for line in lines:
            heights.plot(line[:, :2] @ direction, line[:, 2] + frame.origin[2], color=color, linewidth=1)
    heights.set(xlabel="distance along the scene [m]", ylabel="z [m]", title="Heights of rails and track centerlines")
    heights.grid(alpha=0.3)
    figure.tight_layout()
    figure.savefig(picture, dpi=110)


def _draw(axes: Axes, lines: Sequence[np.ndarray], color: str, label: str, linestyle: str = "-") -> None:
    for number, line in enumerate(lines):
        axes.plot(*line[:, :2].T, linestyle, color=color, linewidth=1, label=label if number == 0 else None)


def _direction(xyz: np.ndarray) -> np.ndarray:
    """Return the direction in plan, (2,), in which points, (n, 3), have the greatest extent."""
    _, axes = np.linalg.eigh(np.cov(xyz[:, :2].T))
    return axes[:, 1] * np.sign(axes[0, 1])


def _zoom(axes: Axes, lines: Sequence[np.ndarray]) -> None:
    """Show a section at the middle of the middle line."""
    if not lines:
        return
    line = lines[len(lines) // 2]
    x, y = line[len(line) // 2, :2]
    axes.set_xlim(x - DETAIL_M / 2, x + DETAIL_M / 2)
    axes.set_ylim(y - DETAIL_M / 4, y + DETAIL_M / 4)
