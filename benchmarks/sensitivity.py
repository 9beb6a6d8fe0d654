"""Print and draw how errors depend on density, noise, gaps, curvature and angle to the grid, next to a plain script.

Run `python benchmarks/sensitivity.py [SWEEP ...] [--plots FOLDER]`. Each value of a sweep is one scene with a fixed
seed: plain 60E1 track of 40 m, scanned as in the other scenes, with all but one property at the usual value.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from rail_extract.core.pipeline import Parameters, extract_rails
from rail_extract.core.polyline import length_along
from rail_extract.core.standards import STANDARDS
from rail_extract.laboratory.curves import Element, trace
from rail_extract.laboratory.ruler.lines import Comparison, compare_lines
from rail_extract.laboratory.ruler.plain_script import script_lines
from rail_extract.laboratory.scenes.plain import rolling, spacing
from rail_extract.laboratory.scenes.scanner import Scanner
from rail_extract.laboratory.scenes.scene import Clutter, Gaps, Plan, Scene, build
from rail_extract.laboratory.scenes.tracks import Track

SEED = 100
LENGTH_M = 40.0
STANDARD = STANDARDS["EN_60E1_1435"]
SCANNER = Scanner(noise_m=0.004)
HEADING = 0.35
"""Angle to the axes of the grid, radians; far from the angles at which rasters have the largest errors."""
COLUMNS = 3
"""Panels per row, so that they can be read on a page."""
TICKS_MM, TICKS_DENSITY = (0.3, 1, 3, 10, 30), (30, 100, 300)
GAPS_AT_M = (8.0, 20.0, 32.0)
"""Middles of the gaps in the left rail; those in the right rail are 4 m further along."""

RAY_STEPS_RAD = (0.0158, 0.0079, 0.004, 0.002, 0.001, 0.0005)
NOISES_M = (0.002, 0.004, 0.006, 0.008, 0.010)
GAPS_M = (0.0, 0.5, 1.0, 2.0, 3.0, 4.0)
RADII_M = (np.inf, 1200.0, 300.0, 100.0, 50.0, 25.0)
SLOPES = (0.0, 1 / 200, 1 / 50, 1 / 9, 0.36, 1.0)
"""Angles to the grid as rise over run: from docs/method.md section 4.12, and the diagonal."""


@dataclass(frozen=True)
class Sweep:
    """A property, its values, and the scene for each value."""

    title: str
    unit: str
    values: Sequence[float]
    scene: Callable[[float], Scene]
    logarithmic: bool = False


@dataclass(frozen=True)
class Outcome:
    """The figures of one scene: the value that is drawn, and both comparisons with the truth."""

    value: float
    ours: Comparison
    script: Comparison


def track_scene(
    scanner: Scanner = SCANNER, curvature: float = 0.0, heading: float = HEADING, gap_m: float = 0.0
) -> Scene:
    """Build a scene of one plain track, with gaps of this length or none.

    The curvature is in 1/m, the heading at the start in radians.
    """
    curve = trace([Element(LENGTH_M, curvature, curvature)], heading=heading)
    gaps: dict[tuple[int, int], Gaps] = {}
    if gap_m > 0:
        for side, shift_m in ((1, 0.0), (-1, 4.0)):
            middles = [middle + shift_m for middle in GAPS_AT_M if middle + shift_m < LENGTH_M - 5]
            gaps[0, side] = tuple((middle - gap_m / 2, middle + gap_m / 2) for middle in middles)
    track = Track(curve, spacing(STANDARD), rolling(curve))
    plan = Plan([track], STANDARD, scanner, gaps=gaps, clutter=Clutter(weeds_near=5, weeds_between=8, stones=60))
    return build("sweep", plan, np.random.RandomState(SEED))


def density(scene: Scene) -> float:
    """Return the number of rail points per metre of rail."""
    return len(scene.rail_points().xyz) / sum(length_along(rail)[-1] for rail in scene.rails)


SWEEPS = {
    "density": Sweep(
        "density",
        "points per metre",
        RAY_STEPS_RAD,
        lambda step: track_scene(replace(SCANNER, ray_step_rad=step)),
        True,
    ),
    "noise": Sweep(
        "noise", "mm", [1000 * noise for noise in NOISES_M], lambda mm: track_scene(replace(SCANNER, noise_m=mm / 1000))
    ),
    "gap": Sweep("gaps, three per rail", "m", GAPS_M, lambda gap_m: track_scene(gap_m=gap_m)),
    "curvature": Sweep(
        "curvature", "1/km", [1000 / radius for radius in RADII_M], lambda k: track_scene(curvature=k / 1000)
    ),
    "angle": Sweep(
        "angle to the grid",
        "degrees",
        [float(np.degrees(np.arctan(slope))) for slope in SLOPES],
        lambda degrees: track_scene(heading=np.radians(degrees)),
    ),
}


def main() -> None:
    """Print a table for each sweep named on the command line, or for all, and draw them on request."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("sweeps", nargs="*", choices=[*SWEEPS, []], metavar="SWEEP", help=f"of {', '.join(SWEEPS)}")
    parser.add_argument("--plots", type=Path, help="folder for accuracy_across.png and accuracy_height.png")
    arguments = parser.parse_args()
    outcomes = {}
    for name in arguments.sweeps or SWEEPS:
        print(_heading(SWEEPS[name]), flush=True)
        outcomes[name] = []
        for value in SWEEPS[name].values:
            outcomes[name].append(measure(SWEEPS[name], value))
            print(_row(outcomes[name][-1]), flush=True)
    if arguments.plots:
        draw(outcomes, "lateral_rmse_m", "rms across, mm", arguments.plots / "accuracy_across.png")
        draw(outcomes, "height_rmse_m", "rms of height, mm", arguments.plots / "accuracy_height.png")


def measure(sweep: Sweep, value: float) -> Outcome:
    """Extract one scene by this project and by the plain script."""
    scene = sweep.scene(value)
    points = scene.rail_points()
    network = extract_rails((points,), Parameters(STANDARD.gauge_m, STANDARD.head_width_m))
    ours = compare_lines([network.frame.to_crs(rail.xyz) for rail in network.rails], scene.rails)
    script = compare_lines(script_lines(points, STANDARD.gauge_m, STANDARD.head_width_m), scene.rails)
    return Outcome(density(scene) if sweep.title == "density" else value, ours, script)


def _heading(sweep: Sweep) -> str:
    columns = "".join(f"{name:>10}" for name in ("across", "p95", "height", "found %"))
    title = f"{sweep.title}, {sweep.unit}"
    return f"\n{title:<28}{'ours: rms':>40}{'plain script: rms':>40}\n{'':<28}{columns}{columns}"


def _row(outcome: Outcome) -> str:
    figures = (
        f"{1000 * one.lateral_rmse_m:10.1f}{1000 * one.lateral_p95_m:10.1f}{1000 * one.height_rmse_m:10.1f}"
        f"{100 * one.completeness:10.2f}"
        for one in (outcome.ours, outcome.script)
    )
    return f"{outcome.value:<28.3g}" + "".join(figures)


def draw(outcomes: dict[str, list[Outcome]], figure: str, label: str, path: Path) -> None:
    """Draw one kind of error, an attribute of `Comparison`, over all sweeps as PNG."""
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot

    columns = min(len(outcomes), COLUMNS)
    rows = -(-len(outcomes) // columns)
    drawing, panels = pyplot.subplots(rows, columns, figsize=(3 * columns, 2.6 * rows), sharey=True, squeeze=False)
    for panel, (name, found) in zip(panels.flat, outcomes.items()):
        values = [outcome.value for outcome in found]
        for who, title, colour in (("ours", "Rail Extract", "tab:blue"), ("script", "plain script", "tab:orange")):
            errors = [1000 * getattr(getattr(outcome, who), figure) for outcome in found]
            panel.plot(values, errors, "o-", label=title, color=colour, markersize=3)
        panel.set(title=SWEEPS[name].title, xlabel=SWEEPS[name].unit, yscale="log", yticks=TICKS_MM)
        scales = [panel.yaxis]
        if SWEEPS[name].logarithmic:
            panel.set(xscale="log", xticks=TICKS_DENSITY)
            scales.append(panel.xaxis)
        for scale in scales:
            scale.set_major_formatter("{x:g}")
            scale.set_minor_formatter("")
        panel.grid(True, which="both", linewidth=0.3)
    for unused in panels.flat[len(outcomes) :]:
        unused.remove()
    for row in panels:
        row[0].set_ylabel(label)
    panels[0, 0].legend(fontsize=8)
    drawing.tight_layout()
    drawing.savefig(path, dpi=100)
    pyplot.close(drawing)


if __name__ == "__main__":
    main()
