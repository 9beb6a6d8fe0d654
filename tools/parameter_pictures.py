"""Draw the effects of the parameters on short synthetic scenes: `docs/pictures/parameters`.

``python tools/parameter_pictures.py [NAME ...]`` draws all pictures, or those named.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Sequence
from pathlib import Path

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt  # noqa: E402
import numpy as np  # noqa: E402
from matplotlib.axes import Axes  # noqa: E402
from matplotlib.figure import Figure  # noqa: E402
from parameter_bench import HEADING, STANDARD, Bench, bench, bend  # noqa: E402
from pictures import draw_pictures  # noqa: E402
from rail_extract.core.parameters import Parameters
from rail_extract.core.rails import Centerline, RailLine  # noqa: E402
from rail_extract.core.standards import STANDARDS  # noqa: E402
from rail_extract.core.tracks.centerlines import tracks_of  # noqa: E402
from rail_extract.laboratory.curves import Element, trace  # noqa: E402
from rail_extract.laboratory.ruler.lines import match  # noqa: E402
from rail_extract.laboratory.scenes.plain import spacing  # noqa: E402
from rail_extract.laboratory.scenes.scanner import Scanner  # noqa: E402
from rail_extract.laboratory.scenes.scene import Plan, build  # noqa: E402
from rail_extract.laboratory.scenes.tracks import Track  # noqa: E402

FOLDER = Path(__file__).resolve().parents[1] / "docs" / "pictures" / "parameters"
DPI = 80

POINTS, RAIL, TRACK, TRUTH = "#9e9e9e", "#1565c0", "#e64a19", "black"
SERIES, WIDTHS = ("#f28e2b", "#4fb3bf", "#1565c0"), (5.0, 3.0, 1.2)
"""Colours and widths of the lines of three values, the smallest value first; coinciding lines remain visible."""


def smoothing_xy() -> Figure:
    """Draw offsets of a rail from its true axis, by the smoothing in plan."""
    curve = trace([Element(12), Element(4, 0, 1 / 25), Element(12, 1 / 25, 1 / 25)], heading=HEADING)
    case = bench(curve, scanner=Scanner(profile_step_m=0.1, noise_m=0.008))
    figure, axes = _figure("along the rail [m]", "left of the true axis [mm]")
    for value, color in zip((0.2, 0.8, 3.0), SERIES):
        rail = _longest(case.rails(smoothing_xy_m=value, simplify_xy_m=0.0, simplify_z_m=0.0))
        found = match([rail.xyz], case.scene.rails)
        axes.plot(found.t, 1000 * found.back.lateral, color=color, label=f"SMOOTHING_XY = {value:g} m")
    axes.axvspan(12, 16, color="0.93", zorder=0)
    axes.set_title("Sparse, noisy points (8 mm); straight, transition (grey), arc of 25 m")
    return _closed(figure, axes)


def smoothing_z() -> Figure:
    """Draw heights of a rail on a short wave, by the smoothing in height."""
    curve = bend(40)
    case = bench(curve, 0.01 * np.sin(2 * np.pi * curve.chainage / 12), scanner=Scanner(noise_m=0.006))
    return _heights(case, "smoothing_z_m", "SMOOTHING_Z", (None, 3.0, 10.0), "Wave of 12 m and 10 mm")


def tolerance_z() -> Figure:
    """Draw heights of a rail by the depth below the top within which points count."""
    case = bench(bend(20), scanner=Scanner(noise_m=0.006, face_share=1.0), stones=60, weeds_near=25)
    return _heights(case, "tolerance_z_m", "TOLERANCE_Z", (0.005, 0.03, 0.15), "Level rail, side faces and weeds in it")


def tolerance_xy() -> Figure:
    """Draw heights of a rail by the distance within which points count."""
    case = bench(bend(20), scanner=Scanner(profile_step_m=0.1), weeds_near=400, gaps=((8.0, 10.0),))
    return _heights(
        case, "tolerance_xy_m", "TOLERANCE_XY", (0.005, 0.02, 0.10), "Level rail with a gap, weeds beside it"
    )


def crown_radius() -> Figure:
    """Draw heights at a dipped joint, by the radius of the disc that finds the top."""
    curve = bend(20)
    dip = -0.02 * np.exp(-0.5 * ((curve.chainage - 10) / 0.4) ** 2)
    case = bench(curve, dip)
    title = "A dip of 20 mm over 2 m; SMOOTHING_Z = 0.3 m, or it would hide the rest"
    return _heights(case, "crown_radius_m", "CROWN_RADIUS", (2.0, 20.0, 500.0), title, smoothing_z_m=0.3)


def max_gap() -> Figure:
    """Draw rails with gaps of 2, 4 and 7 m, by the longest gap that is closed."""
    case = bench(bend(45), gaps=((6.0, 8.0), (16.0, 20.0), (30.0, 37.0)))
    return _maps(case, "max_gap_m", "MAX_GAP", (0.0, 5.0, 8.0), " m")


def gap_angle() -> Figure:
    """Draw rails of a sharp arc with a gap, by the largest bend across it."""
    case = bench(bend(24, 1 / 25), gaps=((10.0, 14.5),))
    return _maps(case, "gap_angle_deg", "GAP_ANGLE", (5.0, 10.0, 20.0), "°")


def min_length() -> Figure:
    """Draw a rail with short pieces between gaps that are not closed, by the shortest line that is kept."""
    case = bench(bend(40), gaps=((10.0, 18.0), (20.0, 28.0)))
    return _maps(case, "min_length_m", "MIN_LENGTH", (1.0, 5.0), " m")


def simplify_xy() -> Figure:
    """Draw vertices of a rail in an arc, by the tolerance of the simplification."""
    case = bench(bend(20, 1 / 50))
    figure, axes = _figure("east [m]", "north [m]")
    for number, (value, color) in enumerate(zip((0.0, 0.002, 0.02), SERIES)):
        rail = _longest(case.rails(simplify_xy_m=value, simplify_z_m=value))
        label = f"SIMPLIFY_XY = SIMPLIFY_Z = {value:g} m: {len(rail.xyz)} vertices"
        axes.plot(rail.xyz[:, 0], rail.xyz[:, 1] + number, ".-", color=color, label=label, linewidth=1)
    axes.set_title("A rail in an arc of 50 m; the lines are drawn 1 m apart")
    axes.set_aspect("equal")
    return _closed(figure, axes)


def iterations() -> Figure:
    """Draw a section of raster before the network and after each number of passes."""
    case = bench(
        bend(14), gaps=((4.0, 6.2), (9.0, 9.6)), scanner=Scanner(profile_step_m=0.08, noise_m=0.01),
        weeds_near=8, weeds_between=25, stones=120,
    )  # fmt: skip
    rasters = [("points", case.raster)] + [(f"ITERATIONS = {n}", case.cleaned(n)) for n in (1, 2)]
    figure, panels = plt.subplots(3, 1, figsize=(9, 6.6), sharex=True, layout="constrained")
    for axes, (name, raster) in zip(panels, rasters):
        across, along = _turned(raster.to_local(raster.cells()))
        axes.plot(along, across, "s", color="black", markersize=1.6)
        axes.set(title=f"{name}: {raster.count()} cells", aspect="equal", ylabel="across [m]", ylim=(-1.6, 1.6))
    panels[-1].set(xlabel="along the track [m]", xlim=(-0.5, 14.5))
    return figure


def centerline_tolerance() -> Figure:
    """Draw centerlines on a track that widens, by the tolerance of the gauge."""
    t = np.linspace(0, 40, 81)
    sides = [np.column_stack([t, s * 0.5 * (spacing(STANDARD) + 0.1 * t / 40), 0 * t]) for s in (1, -1)]
    rails = [RailLine(xyz, number, 10, 0, 0.0, 0.0, 0.0) for number, xyz in enumerate(sides, start=1)]
    figure, axes = _figure("along the track [m]", "across [m], exaggerated")
    for number, xyz in enumerate(sides):
        axes.plot(xyz[:, 0], xyz[:, 1], color="0.4", label=None if number else "rails; the gauge grows by 100 mm")
    for number, (value, color) in enumerate(zip((0.02, 0.05, 0.08), SERIES)):
        for line in tracks_of(rails, Parameters(STANDARD.gauge_m, STANDARD.head_width_m, centerline_tolerance_m=value)):
            text = f"CENTERLINE_TOLERANCE = {value:g} m: {line.length_m:.1f} m"
            axes.plot(line.xyz[:, 0], line.xyz[:, 1] + 0.15 * (1 - number), color=color, label=text)
    axes.set_title("The centerline ends where the gauge is off by more; the lines are drawn 15 cm apart")
    axes.set_ylim(-1.9, 0.95)
    return _closed(figure, axes)


def other_gauges() -> Figure:
    """Draw centerlines of track with three rails, by the gauges that are given."""
    wide, narrow = STANDARDS["EN_49E1_1435"], STANDARDS["EN_49E1_1000"]
    curve = bend(20)
    left_m = -(spacing(wide) - spacing(narrow)) / 2
    tracks = [Track(curve, spacing(wide)), Track(curve, spacing(narrow), left_m=left_m, sides=(1,))]
    case = Bench(build("dual", Plan(tracks, wide), np.random.RandomState(3)))
    figure, panels = plt.subplots(2, 1, figsize=(9, 4.6), sharex=True, layout="constrained")
    for axes, (text, values) in zip(panels, (("empty", ()), ("1000", (narrow.gauge_m,)))):
        rails = case.rails()
        found = case.tracks(rails, other_gauges_m=values)
        _draw(axes, case, rails, found)
        axes.set_title(f"OTHER_GAUGES {text}: {_counted(len(found), 'centerline')}")
    panels[-1].set_xlabel("along the track [m]")
    return figure


def _heights(
    case: Bench, field: str, name: str, values: Sequence[float | None], title: str, **changes: float
) -> Figure:  # fmt: skip
    """Draw heights along one rail for some values of a parameter, or with none, above the points near it."""
    figure, axes = _figure("along the track [m]", "height [mm]")
    truth = case.scene.rails[0]
    xyz = case.points.xyz
    across, along = _turned(xyz)
    near = np.abs(across - _turned(truth)[0].mean()) < 0.35
    axes.plot(along[near], 1000 * xyz[near, 2], ".", color=POINTS, markersize=1.5, label="points within 0.35 m")
    axes.plot(_turned(truth)[1], 1000 * truth[:, 2], "--", color=TRUTH, label="true top", linewidth=1)
    for value, color, width in zip(values, SERIES, WIDTHS):
        found = case.rails(**{field: value, "simplify_xy_m": 0.0, "simplify_z_m": 0.0, **changes})
        for number, rail in enumerate(_on(truth, found)):
            label = None if number else f"{name} empty" if value is None else f"{name} = {value:g} m"
            axes.plot(_turned(rail.xyz)[1], 1000 * rail.xyz[:, 2], color=color, label=label, linewidth=width)
    span = 1000 * np.ptp(truth[:, 2])
    axes.set(title=title, ylim=(1000 * truth[:, 2].min() - 30 - 0.3 * span, 1000 * truth[:, 2].max() + 20))
    return _closed(figure, axes)


def _maps(case: Bench, field: str, name: str, values: Sequence[float], unit: str) -> Figure:
    """Draw rails and points in plan for some values of a parameter, one panel each."""
    figure, panels = plt.subplots(len(values), 1, figsize=(9, 2.0 * len(values)), sharex=True, layout="constrained")
    for axes, value in zip(panels, values):
        rails = case.rails(**{field: value})
        _draw(axes, case, rails, ())
        axes.set_title(f"{name} = {value:g}{unit}: {_counted(len(rails), 'rail')}")
    panels[-1].set_xlabel("along the track [m]")
    return figure


def _draw(axes: Axes, case: Bench, rails: Sequence[RailLine], tracks: Sequence[Centerline]) -> None:
    """Draw points and lines, neighbouring rails in different colours, with marks at the ends."""
    across, along = _turned(case.points.xyz)
    axes.plot(along, across, ".", color=POINTS, markersize=1)
    for lines, colors, style in ((rails, (RAIL, "#2e7d32", "#6a1b9a"), "-"), (tracks, (TRACK,), "--")):
        for number, line in enumerate(lines):
            across, along = _turned(line.xyz)
            axes.plot(along, across, style, color=colors[number % len(colors)], linewidth=1.6)
            axes.plot(along[[0, -1]], across[[0, -1]], "|", color=colors[number % len(colors)], markersize=11)
    axes.set_ylabel("across [m]")


def _on(truth: np.ndarray, rails: Sequence[RailLine]) -> list[RailLine]:
    """Return the rails that coincide with a true one."""
    return [rail for rail in rails if np.median(match([rail.xyz], [truth]).back.distance) < 0.1]


def _longest(rails: Sequence[RailLine]) -> RailLine:
    return max(rails, key=lambda rail: rail.length_m)


def _turned(xy: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return coordinates across and along the direction of the tracks."""
    return xy[:, 1] * np.cos(HEADING) - xy[:, 0] * np.sin(HEADING), xy[:, 0] * np.cos(HEADING) + xy[:, 1] * np.sin(
        HEADING
    )


def _counted(count: int, noun: str) -> str:
    return f"{count} {noun}{'' if count == 1 else 's'}"


def _figure(xlabel: str, ylabel: str) -> tuple[Figure, Axes]:
    figure, axes = plt.subplots(figsize=(9, 4), layout="constrained")
    axes.set(xlabel=xlabel, ylabel=ylabel)
    axes.grid(alpha=0.3)
    return figure, axes


def _closed(figure: Figure, axes: Axes) -> Figure:
    axes.legend(loc="best", fontsize=9)
    return figure


PICTURES: dict[str, Callable[[], Figure]] = {
    draw.__name__: draw
    for draw in (
        smoothing_xy,
        smoothing_z,
        tolerance_xy,
        tolerance_z,
        crown_radius,
        max_gap,
        gap_angle,
        simplify_xy,
        min_length,
        iterations,
        centerline_tolerance,
        other_gauges,
    )
}


if __name__ == "__main__":
    draw_pictures(PICTURES, FOLDER, DPI, sys.argv[1:])
