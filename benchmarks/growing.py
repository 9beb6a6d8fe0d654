"""Print how far rails are followed from one click each in raw clouds, and which points they get.

Run `python benchmarks/growing.py [--seed N] [SCENE ...]`. Each rail is clicked once, in the middle or where it is seen
next to it, up to 6 cm beside its axis. `python benchmarks/growing.py --axis 500 1000 2000` grows such lengths of track
from a seed per metre instead, as a digitized axis has them.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from rail_extract.core.grow.growth import APART, Growth, Growths, apart_first, grow
from rail_extract.core.grow.heads import GrowSettings, Rail
from rail_extract.core.polyline import Polyline, project
from rail_extract.laboratory.ruler.classification import truth
from rail_extract.laboratory.ruler.lines import cut
from rail_extract.laboratory.ruler.whole_clouds import GrowingCloud
from rail_extract.laboratory.scenes import raw_strips
from rail_extract.laboratory.scenes.raw import RawScene
from rail_extract.laboratory.scenes.raw_catalogue import AIR, RAW_SCENES
from scipy.spatial import cKDTree

SEED = 2026

CLICK_M = 0.06
"""Largest distance of a click from the axis, to the east and to the north."""

RIGHT_M = 0.05
"""Distance from a true rail within which a followed one is right."""

SEEN_M = 0.10
"""Distance from a place on a rail to the nearest point of its head within which it is seen."""

AXIS_RADIUS_M, AXIS_PER_M2 = 10_000.0, 500.0
"""Radius of the track along an axis, and points per square metre of a strip of 3 m."""

HEADER = (
    "Length followed, as a share of that of the rails that were clicked (more where a branch leads into its track);\n"
    "points on their heads that are labelled (recall), labelled points on heads or right beside (precision); metres\n"
    "more than 5 cm from a rail; errors of the axis in mm; rails found and clicked."
)


@dataclass
class Row:
    """What grew from the clicks in a scene."""

    rails: int = 0
    found: int = 0
    true_m: float = 0.0
    followed_m: float = 0.0
    false_m: float = 0.0
    head: int = 0
    labelled_head: int = 0
    labelled: int = 0
    right: int = 0
    across_m2: float = 0.0
    height_m2: float = 0.0
    windows: int = 0
    seconds: float = 0.0


def main() -> None:
    """Print a row for each scene named on the command line, or for all with rails."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("scenes", nargs="*", metavar="SCENE", help=f"of {', '.join(RAW_SCENES)}")
    parser.add_argument("--seed", type=int, default=SEED, help=f"of the scenes (default {SEED})")
    parser.add_argument("--axis", type=float, nargs="+", metavar="M", help="lengths of track with a seed per metre")
    arguments = parser.parse_args()
    if arguments.axis:
        print(f"{'track':>10}{'seeds':>10}{'growths':>10}{'followed':>10}{'s':>10}{'ms/m':>10}")
        for length_m in arguments.axis:
            print(along_axis(length_m), flush=True)
        return
    print(HEADER)
    names = ("scene", "rails", "followed", "recall", "prec.", "false m", "across", "height", "s/rail")
    print(f"{names[0]:<18}" + "".join(f"{name:>10}" for name in names[1:]))
    for name in arguments.scenes or RAW_SCENES:
        scene = RAW_SCENES[name](arguments.seed)
        if scene.rails:
            print(text(name, measured(scene, name in AIR)), flush=True)


def along_axis(length_m: float) -> str:
    """Grow a track from a seed per metre; returns a row with the length that was followed and the processor time."""
    settings = GrowSettings(raw_strips.GAUGE_M, raw_strips.WIDTH_M)
    track = raw_strips.strip(length_m, 1 / AXIS_RADIUS_M, per_m2=AXIS_PER_M2)
    heads = GrowingCloud(track.xyz, settings).heads
    seeds = np.array([track.at(along, raw_strips.SPACING_M / 2) for along in np.arange(1.0, length_m)])
    start, growths = time.process_time(), Growths(heads, settings)
    for at in apart_first(seeds, APART * settings.parameters.max_length_m):
        growths.add(seeds[at])
    growths.reach_on()
    seconds = time.process_time() - start
    followed_m = sum(growth.rails[0].length_m for growth in growths.grown)
    row = (f"{length_m:.0f} m", len(seeds), len(growths.grown), f"{followed_m:.0f} m")
    return "".join(f"{value:>10}" for value in (*row, f"{seconds:.1f}", f"{1000 * seconds / length_m:.1f}"))


def measured(scene: RawScene, wide: bool) -> Row:
    """Click each rail of a scene in its middle."""
    row, points = Row(), GrowingCloud(scene.xyz, settings_of(scene))
    for rail, growth, seconds in clicked(scene, points):
        row.rails += 1
        row.seconds += seconds
        row.true_m += Polyline(rail).length_m
        if growth is None:
            continue
        row.found += 1
        on = points.on(growth.rails)
        head, beside = truth(scene, on, wide)
        along = _beside(growth.rails, scene)
        along &= scene.head
        row.head += int(along.sum())
        row.labelled_head += int((along & on).sum())
        row.labelled += int(on.sum())
        row.right += int((on & (head | beside)).sum())
        for number, grown in enumerate(growth.rails):
            step = grown.xyz - cut(scene.shown).nearest(grown.xyz)[0]
            across = np.hypot(step[:, 0], step[:, 1])
            near = across <= RIGHT_M
            share_m = np.gradient(Polyline(grown.xyz).t)
            row.false_m += float(share_m[~near].sum())
            row.followed_m += float(share_m[near].sum()) if number == 0 else 0.0
            row.across_m2 += float((across[near] ** 2).sum())
            row.height_m2 += float((step[near, 2] ** 2).sum())
            row.windows += int(near.sum())
    return row


def settings_of(scene: RawScene) -> GrowSettings:
    """Make the settings that fit a scene."""
    return GrowSettings(scene.standard.gauge_m, scene.standard.head_width_m)


def clicked(scene: RawScene, points: GrowingCloud) -> Iterator[tuple[np.ndarray, Growth | None, float]]:
    """Yield each rail, what grows from a click on it, and the processor time."""
    rng = np.random.RandomState(0)
    for rail in scene.rails:
        middle = _seen_middle(rail, scene)
        start = time.process_time()
        growth = grow(points.heads, middle + rng.uniform(-CLICK_M, CLICK_M, 2), settings_of(scene))
        yield rail, growth, time.process_time() - start


def _seen_middle(rail: np.ndarray, scene: RawScene) -> np.ndarray:
    """Return the place on a rail, (2,), with points of its head that is nearest to its middle."""
    line = Polyline(rail)
    places = line.at(np.linspace(0.0, line.length_m, 101))
    distance, _ = cKDTree(scene.xyz[scene.head]).query(places)
    seen = places[distance <= SEEN_M, :2]
    return seen[np.argmin(np.hypot(*(seen - places[50, :2]).T))]


def _beside(rails: tuple[Rail, ...], scene: RawScene) -> np.ndarray:
    """Return the points above the side faces that lie along the rails that were followed, (n,) bool."""
    near = np.zeros(len(scene.xyz), dtype=bool)
    reach_m = scene.standard.head_width_m / 2 + RIGHT_M
    chosen = np.flatnonzero(scene.head)
    chosen = chosen[project([rail.xyz[:, :2] for rail in rails], scene.xyz[chosen, :2], reach_m).point]
    feet, _ = cut(scene.rails).nearest(scene.xyz[chosen])
    near[chosen[scene.xyz[chosen, 2] - feet[:, 2] > -0.035]] = True
    return near


def text(name: str, row: Row) -> str:
    """Format the row of a scene."""
    count = max(row.windows, 1)
    return (
        f"{name:<18}{f'{row.found}:{row.rails}':>10}{f'{100 * row.followed_m / row.true_m:.1f} %':>10}"
        f"{row.labelled_head / max(row.head, 1):>10.4f}{row.right / max(row.labelled, 1):>10.4f}{row.false_m:>10.1f}"
        f"{1000 * np.sqrt(row.across_m2 / count):>10.1f}{1000 * np.sqrt(row.height_m2 / count):>10.1f}"
        f"{row.seconds / row.rails:>10.1f}"
    )


if __name__ == "__main__":
    main()
