"""Draw the steps of the classification on one simulated turnout: `docs/pictures/classification`.

``python tools/classification_pictures.py [NAME ...]`` draws all pictures, or those named.
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt  # noqa: E402
import numpy as np  # noqa: E402
from matplotlib.axes import Axes  # noqa: E402
from matplotlib.figure import Figure  # noqa: E402
from pictures import draw_pictures  # noqa: E402
from rail_extract.core.classify.bed import Bed  # noqa: E402
from rail_extract.core.classify.cells import Candidates, Kept, Shown, free_standing  # noqa: E402
from rail_extract.core.classify.lines import Lines, Marks, find_lines  # noqa: E402
from rail_extract.core.classify.settings import DENSE, HEADS, Settings  # noqa: E402
from rail_extract.core.classify.tops import (  # noqa: E402
    HIGH_M,
    LOW_M,
    MILLIMETRES,
    TOP_M,
    Grid,
    Tops,
    tops_of,
)
from rail_extract.laboratory.rasters.turnouts import FORMS, branch  # noqa: E402
from rail_extract.laboratory.ruler.whole_clouds import classify_cloud  # noqa: E402
from rail_extract.laboratory.scenes.plain import spacing  # noqa: E402
from rail_extract.laboratory.scenes.raw import RawScene, scan_world  # noqa: E402
from rail_extract.laboratory.scenes.raw_catalogue import STANDARD, TRAIN, line, masts_at, thing, tram  # noqa: E402
from rail_extract.laboratory.scenes.raw_things import fence, guard_rail, plants, trough  # noqa: E402
from rail_extract.laboratory.scenes.raw_world import ground, running_rails  # noqa: E402
from rail_extract.laboratory.scenes.tracks import Track  # noqa: E402

FOLDER = Path(__file__).resolve().parents[1] / "docs" / "pictures" / "classification"
DPI = 80
SEED = 4

LENGTH_M, HEADING = 36.0, 0.3

REACH_M = 1.0
"""Reach of the lines through cells in a dense cloud."""

VIEW_M = (17.0, 31.0), (-3.4, 4.2)
"""Part of the scene that is drawn: along the main track, and to the left of it."""

GREY, RAIL, OTHER, DROPPED = "#9e9e9e", "#1565c0", "#f28e2b", "#e64a19"


@dataclass(frozen=True)
class Scene:
    """A raw cloud with what the first steps make of it.

    Heights are above the bed; marks are narrow cells, one of each block.
    """

    raw: RawScene
    settings: Settings
    height: np.ndarray
    tops: Tops
    marks: np.ndarray
    kept: Kept

    @property
    def lines(self) -> Lines:
        """The line through each mark."""
        marks = Marks(self.tops.grid.middles(self.marks), self.tops.top.ravel()[self.marks] / MILLIMETRES)
        return find_lines(marks, REACH_M, DENSE.along_m, DENSE.beside_line_m)


@lru_cache(maxsize=1)
def scene() -> Scene:
    """Scan a turnout with its check rail, a cable trough, a fence and plants."""
    shape = next(form for form in FORMS if form.name == "300-1:9")
    main_track = line(LENGTH_M, 0.0, HEADING)
    side_track = branch(main_track, 0.5, shape, 1, LENGTH_M - 4.0)
    tracks = [Track(curve, spacing(STANDARD)) for curve in (main_track, side_track)]
    things = [
        ground,
        running_rails,
        thing(guard_rail, 0, -1, 19.5, 24.0),
        thing(trough, 0, -2.3, 0.0, LENGTH_M),
        thing(fence, -3.2, -0.9, 0.0, LENGTH_M),
        thing(plants, 160, (-3.0, 4.2), (0.05, 0.35), (0.05, 0.2), -0.25),
        masts_at(3.9),
    ]
    raw = scan_world("turnout", tracks, STANDARD, [TRAIN], things, SEED, half_width_m=6.0)
    settings = Settings((STANDARD.gauge_m,), STANDARD.head_width_m)
    under, height, _, z = Bed.under(raw.xyz)
    near = np.flatnonzero(height <= HIGH_M)
    xy = raw.xyz[near, :2]
    grid, cell = Grid.around(*xy.T, settings.cell_m)
    tops = tops_of(grid, cell, height[near], z[near])
    found = Candidates.find(Shown(xy, cell, height[near], under, tops), HEADS)
    return Scene(raw, settings, height, tops, found.marks, free_standing(found, under, REACH_M, DENSE, settings))


def bed() -> Figure:
    """Draw a cross-section: heights of points above the bed, with the band of railheads."""
    figure, axes = plt.subplots(figsize=(9, 3.4), layout="constrained")
    at = scene()
    along, across = turned(at.raw.xyz)
    here = (np.abs(along - 21.8) < 0.12) & np.isfinite(at.height)
    axes.axhspan(LOW_M, TOP_M, color="#e3f2fd", zorder=0, label="band of railheads")
    axes.plot(across[here], at.height[here], ".", color="black", markersize=2)
    axes.axhline(0, color=OTHER, linewidth=1, label="bed")
    axes.set(xlim=(-3.4, 4.2), ylim=(-0.25, 1.0), xlabel="across [m]", ylabel="height above the bed [m]")
    axes.set_title("Step 1: heights above the bed; trough and check rail on the left, plants on the right")
    axes.legend(loc="upper right", fontsize=9)
    return figure


def tops() -> Figure:
    """Draw the tops in the band, and those of them that are narrow."""
    at, (figure, axes) = scene(), plan("Step 2: tops in the band (grey), and the narrow ones (blue)")
    top = at.tops.top.ravel()
    cells(axes, at.tops.grid.middles(np.flatnonzero(top >= LOW_M * MILLIMETRES)), GREY)
    cells(axes, at.tops.grid.middles(at.marks), RAIL, 2.2)
    return figure


def lines() -> Figure:
    """Draw the direction of each narrow cell that lies on a line, by its purity."""
    at, (figure, axes) = scene(), plan("Step 3: cells on a line, with its direction; the others in grey")
    found = at.lines
    good = np.isin(np.arange(len(found.cover)), found.good())
    cells(axes, found.axis[~good], GREY)
    (along, across), direction = turned(found.axis[good]), found.theta[good] - HEADING
    step = 0.12 * np.stack([np.cos(direction), np.sin(direction)])
    ends = np.stack([along - step[0], along + step[0], np.full(len(along), np.nan)], axis=1).ravel()
    sides = np.stack([across - step[1], across + step[1], np.full(len(along), np.nan)], axis=1).ravel()
    axes.plot(ends, sides, color=RAIL, linewidth=1.2)
    return figure


def partners() -> Figure:
    """Draw which cells are kept, with and without a partner, and what was dropped."""
    at, (figure, axes) = scene(), plan("Steps 4 to 6: rails (blue); cells on other lines, which are dropped (red)")
    found = at.lines
    good = np.isin(np.arange(len(found.cover)), found.good()) & ~np.isin(at.marks, at.kept.cell)
    cells(axes, found.axis[good], DROPPED, 2.2)
    cells(axes, at.kept.lines.axis[at.kept.paired], RAIL, 2.2)
    cells(axes, at.kept.lines.axis[~at.kept.paired], OTHER, 2.2)
    return figure


def labels() -> Figure:
    """Draw the points of a cross-section, and those that are labelled."""
    at = scene()
    rail = classify_cloud(at.raw.xyz, at.settings).rail
    figure, (wide, near) = plt.subplots(
        1, 2, figsize=(9, 3.4), layout="constrained", gridspec_kw={"width_ratios": (2, 1)}
    )
    along, across = turned(at.raw.xyz)
    here = np.abs(along - 21.8) < 0.3
    for axes in (wide, near):
        axes.plot(across[here & ~rail], at.raw.xyz[here & ~rail, 2], ".", color=GREY, markersize=2)
        axes.plot(across[here & rail], at.raw.xyz[here & rail, 2], ".", color=RAIL, markersize=2.5)
        axes.set(xlabel="across [m]")
    wide.set(xlim=(-1.3, 2.2), ylim=(-0.3, 0.2), ylabel="z [m]", title="Step 7: labelled points (blue)")
    near.set(xlim=(-0.95, -0.45), ylim=(-0.22, 0.05), title="rail with check rail")
    return figure


def flush() -> Figure:
    """Draw a cross-section of a tram rail in the street, and the points that are labelled."""
    raw = tram(SEED)
    settings = Settings((raw.standard.gauge_m,), raw.standard.head_width_m)
    rail = classify_cloud(raw.xyz, settings).rail
    figure, panels = plt.subplots(1, 2, figsize=(9, 3.0), sharey=True, layout="constrained")
    for axes, truth, title in zip(panels, raw.rails[2:], ("groove seen from the inside", "from the outside")):
        middle = len(truth) // 2
        ahead = truth[middle + 1] - truth[middle]
        ahead /= np.linalg.norm(ahead)
        step = raw.xyz - truth[middle]
        here = np.abs(step[:, :2] @ ahead[:2]) < 0.25
        across = step[:, 1] * ahead[0] - step[:, 0] * ahead[1]
        axes.plot(across[here & ~rail], 1000 * step[here & ~rail, 2], ".", color=GREY, markersize=2.5)
        axes.plot(across[here & rail], 1000 * step[here & rail, 2], ".", color=RAIL, markersize=2.5)
        axes.set(xlim=(-0.16, 0.16), ylim=(-60, 20), xlabel="across [m]", title=f"Step 8: {title}")
    panels[0].set_ylabel("height [mm]")
    return figure


def plan(title: str) -> tuple[Figure, Axes]:
    """Prepare a plan of the scene."""
    figure, axes = plt.subplots(figsize=(9, 5.2), layout="constrained")
    axes.set(title=title, xlabel="along [m]", ylabel="across [m]", aspect="equal", xlim=VIEW_M[0], ylim=VIEW_M[1])
    return figure, axes


def cells(axes: Axes, xy: np.ndarray, color: str, size: float = 1.6) -> None:
    """Draw the middles of cells."""
    axes.plot(*turned(xy), "s", color=color, markersize=size, markeredgewidth=0)


def turned(xy: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Coordinates along the main track and to the left of it."""
    start = line(LENGTH_M, 0.0, HEADING).xy[0]
    x, y = (xy[:, :2] - start).T
    return x * np.cos(HEADING) + y * np.sin(HEADING), y * np.cos(HEADING) - x * np.sin(HEADING)


PICTURES: dict[str, Callable[[], Figure]] = {
    draw.__name__: draw for draw in (bed, tops, lines, partners, labels, flush)
}


if __name__ == "__main__":
    draw_pictures(PICTURES, FOLDER, DPI, sys.argv[1:])
