"""One world as files and as a picture: its cloud, its truth, the lines and findings, and what went wrong."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import matplotlib as mpl
import numpy as np

mpl.use("Agg")
from matplotlib import pyplot as plt
from rail_extract.core.comparison import cut
from rail_extract.core.disk import Destination
from rail_extract.laboratory.ruler.worlds import NEAR_M, Fault, Judged
from rail_extract.laboratory.scenes.raw_world import (
    FASTENING,
    FOOT,
    GUARD,
    HEAD,
    PAVEMENT,
    PLANT,
    SLEEPER,
    THIRD,
    TRAIN,
    along_and_left,
)
from rail_extract.laboratory.scenes.scene import RAIL
from rail_extract.laboratory.scenes.write import write_truth
from rail_extract.laboratory.worlds.world import World

COLOURS = {
    HEAD: "tab:orange",
    FOOT: "tab:brown",
    GUARD: "tab:purple",
    THIRD: "tab:pink",
    SLEEPER: "tab:gray",
    FASTENING: "black",
    PLANT: "tab:green",
    TRAIN: "tab:cyan",
    PAVEMENT: "silver",
}
"""Colours of the kinds of points in pictures; others are light gray."""

AROUND_M, SLICE_M, MOST_POINTS = 4.0, 0.5, 60_000
"""Half the length of the plan of a place, the length of its cross-section, and the most points that are drawn."""


def draw(world: World, judged: Judged, stem: Path) -> Iterator[Path]:
    """Write all there is of a world, and yield the paths."""
    cloud, truth = stem.with_suffix(".laz"), stem.with_name(stem.name + "_truth.geojson")
    world.write(cloud)
    write_truth(world.scene, truth)
    yield cloud
    yield truth
    if judged.network is not None:
        yield _write_lines(world, judged, stem.with_suffix(".gpkg"))
    picture = stem.with_suffix(".png")
    _picture(world, judged).savefig(picture, dpi=110)
    plt.close("all")
    yield picture


def _write_lines(world: World, judged: Judged, path: Path) -> Path:
    """Write rails, centerlines and findings into a GeoPackage."""
    from rail_extract.core.files.layers import network_makers
    from rail_extract.core.files.writing import write_layers

    network, scene = judged.network, world.scene
    path.unlink(missing_ok=True)
    gauges_m = (scene.standard.gauge_m, *scene.other_gauges_m)
    layers = [network_makers(network, gauges_m)[name]() for name in ("rails", "centerlines", "findings")]
    write_layers(layers, Destination.at(path), network.frame)
    return path


def _picture(world: World, judged: Judged) -> plt.Figure:
    """Draw the whole world, the errors along it, and plan and cross-section of the first faults."""
    places = [fault for fault in judged.faults if fault.xyz is not None][:3] or [_middle(world)]
    figure = plt.figure(figsize=(7 * max(len(places), 2), 20), layout="constrained")
    grid = figure.add_gridspec(4, len(places), height_ratios=(1.4, 0.8, 1.4, 1.0))
    _overview(figure.add_subplot(grid[0, :]), world, judged)
    _errors(figure.add_subplot(grid[1, :]), world, judged)
    for number, fault in enumerate(places):
        _plan(figure.add_subplot(grid[2, number]), world, judged, fault)
        _section(figure.add_subplot(grid[3, number]), world, judged, fault)
    what = world.describe()
    figure.suptitle(
        f"world {world.seed}: " + ", ".join(f"{key} {value}" for key, value in what.items()), fontsize=9, wrap=True
    )
    return figure


def _middle(world: World) -> Fault:
    """Return the middle of the first rail, of a world without faults that have a place."""
    rail = world.scene.shown[0]
    return Fault("middle", 0.0, rail[len(rail) // 2])


def _unrolled(world: World, xy: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Places along and to the left of the reference line, (n,) each."""
    _, at, left = along_and_left(world.railway.reference, xy)
    return at, left


def _lines(world: World, judged: Judged) -> list[np.ndarray]:
    """Return the extracted rails in the world's metres."""
    network = judged.network
    if network is None:
        return []
    return [world.scene.frame.to_local(network.frame.to_crs(rail.xyz)) for rail in network.rails]


def _overview(axes: plt.Axes, world: World, judged: Judged) -> None:
    """Draw truth and lines unrolled along the first track, and what is missing and false."""
    _dots(axes, *_unrolled(world, world.scene.xyz[_some(np.flatnonzero(world.heads)), :2]), "gold", "head points")
    true = cut(world.scene.shown)
    _dots(axes, *_unrolled(world, true.middle[:, :2]), "lightgray", "true rails")
    if len(judged.shown):
        _dots(axes, *_unrolled(world, true.middle[judged.shown][:, :2]), "tab:green", "to be found")
    lines = cut(_lines(world, judged))
    if judged.found is not None and len(lines.number):
        off = judged.found.back.distance > NEAR_M
        _dots(axes, *_unrolled(world, lines.middle[~off][:, :2]), "tab:blue", "lines")
        _dots(axes, *_unrolled(world, lines.middle[off][:, :2]), "magenta", "false")
        missing = judged.shown & (judged.found.there.distance > NEAR_M)
        _dots(axes, *_unrolled(world, true.middle[missing][:, :2]), "red", "missing")
    for finding in judged.findings:
        xyz = np.atleast_2d(finding.xyz)
        place = world.scene.frame.to_local(judged.network.frame.to_crs(xyz))
        axes.plot(*_unrolled(world, place[:, :2]), "k-", linewidth=4, alpha=0.25)
    for fault in judged.faults:
        if fault.xyz is not None:
            at, left = _unrolled(world, fault.xyz[None, :2])
            axes.plot(at, left, "o", markersize=18, markerfacecolor="none", color="red")
    words = "; ".join(
        f"{fault.cause} {fault.figure:.4g}{' SILENT' if fault.silent else ''} {fault.words}" for fault in judged.faults
    )
    axes.set(title=words or "right", xlabel="along the first track, m", ylabel="to the left, m")
    axes.legend(loc="upper right", fontsize=7, markerscale=8)


def _errors(axes: plt.Axes, world: World, judged: Judged) -> None:
    """Draw the errors along the lines, with their standard errors."""
    if judged.found is None or not len(judged.found.line):
        return
    at, _ = _unrolled(world, cut(_lines(world, judged)).middle[:, :2])
    back = judged.found.back
    for number, rail in enumerate(judged.network.rails):
        mine = (judged.found.line == number) & (back.distance <= NEAR_M)
        (drawn,) = axes.plot(at[mine], 1000 * back.lateral[mine], linewidth=1, label=f"rail {rail.rail_id}")
        axes.plot(at[mine], 1000 * back.height[mine], ":", linewidth=1, color=drawn.get_color())
        if rail.support is not None:
            sigma = np.interp(judged.found.t[mine], rail.support.t, 1000 * rail.support.sigma_m)
            axes.plot(at[mine], 2 * sigma, "--", linewidth=0.5, color=drawn.get_color())
    axes.set(ylabel="mm: across, height (dotted), twice sigma (dashed)", xlabel="along the first track, m")
    axes.grid(alpha=0.3)
    axes.legend(fontsize=6, ncols=4)


def _plan(axes: plt.Axes, world: World, judged: Judged, fault: Fault) -> None:
    """Draw the points around a fault from above, with truth and lines."""
    at, left = _unrolled(world, fault.xyz[None, :2])
    _place(axes, world, judged, float(at[0]), float(left[0]), AROUND_M, from_above=True)
    axes.set(title=f"{fault.cause} {fault.figure:.4g}", xlabel="along, m", ylabel="to the left, m")
    axes.set(xlim=(at[0] - AROUND_M, at[0] + AROUND_M), ylim=(left[0] - 1.2, left[0] + 1.2))


def _section(axes: plt.Axes, world: World, judged: Judged, fault: Fault) -> None:
    """Draw the cross-section of the points at a fault."""
    at, left = _unrolled(world, fault.xyz[None, :2])
    _place(axes, world, judged, float(at[0]), float(left[0]), SLICE_M / 2, from_above=False)
    z = float(fault.xyz[2])
    axes.set(xlabel=f"to the left, m; {SLICE_M:g} m along the line", ylabel="height, m", aspect="equal")
    axes.set(xlim=(left[0] - 0.4, left[0] + 0.4), ylim=(z - 0.3, z + 0.2))


def _place(
    axes: plt.Axes, world: World, judged: Judged, at: float, left: float, half_m: float, from_above: bool
) -> None:
    scene = world.scene
    middle = scene.xyz[:, :2] - _xy(world, at, left)
    near = np.flatnonzero(np.hypot(*middle.T) < half_m + 1.7)
    along, beside = _unrolled(world, scene.xyz[near, :2])
    inside = np.abs(along - at) < half_m
    near, along, beside = near[inside], along[inside], beside[inside]
    columns = (along, beside) if from_above else (beside, scene.xyz[near, 2])
    colours = np.array([COLOURS.get(kind, "lightgray") for kind in range(256)])[scene.kind[near]]
    some = _some(np.arange(len(near)))
    axes.scatter(columns[0][some], columns[1][some], s=1.5, c=colours[some], linewidths=0)
    if world.classified is not None:
        rail = world.classified.classification[near] == RAIL
        axes.scatter(columns[0][rail], columns[1][rail], s=5, facecolors="none", edgecolors="black", linewidths=0.2)
    for lines, style in ((scene.shown, "g-"), (_lines(world, judged), "b--")):
        for line in lines:
            pieces = cut([line]).middle
            t, across = _unrolled(world, pieces[:, :2])
            mine = np.abs(t - at) < half_m
            if from_above:
                axes.plot(t[mine], across[mine], style, linewidth=1)
            elif mine.any():
                axes.plot(across[mine], pieces[mine, 2], style[0] + ("x" if style == "g-" else "+"), markersize=7)


def _xy(world: World, at: float, left: float) -> np.ndarray:
    curve = world.railway.reference
    place = [np.interp(at, curve.chainage, column) for column in (*curve.xy.T, *curve.left_normal.T)]
    return np.array(place[:2]) + left * np.array(place[2:])


def _some(numbers: np.ndarray) -> np.ndarray:
    """Return at most `MOST_POINTS` of some numbers."""
    return numbers[:: max(len(numbers) // MOST_POINTS, 1)]


def _dots(axes: plt.Axes, x: np.ndarray, y: np.ndarray, colour: str, label: str) -> None:
    axes.plot(x, y, ".", markersize=1.5, color=colour, label=label)
