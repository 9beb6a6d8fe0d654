"""Random track layouts in plan: the running rails to be found, and the lines beside them to be dropped.

Layouts are drawn at the scale of the base model: rail centres 1511.2 mm apart. Any other standard is the same picture
at another scale (ALGORITHMS.md section 5.7), but for the ratio of gauge to railhead.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from .clothoids import connect
from .curves import Curve, Element, trace
from .turnouts import FORMS, TurnoutForm, branch, separation

STEP_M = 0.02
"""Distance between samples of a rail: half a cell."""

SHARPEST_RADIUS_M = 25.0
"""Tramways' smallest."""

WORLD_M = 60.0
"""Tracks are laid this far on both sides of the spot a raster shows."""

TRACK_SPACING_M = (3.5, 6.0)
FLANGEWAY_M = (0.038, 0.050)
GUARD_LENGTH_M = (2.5, 5.0)
BLADE_START = (0.2, 0.4)
"""Where a switch blade becomes a rail of its own, as a share of its length: before it is thinner than the noise."""
BLADE_LENGTH_M = (5.0, 12.0)
NO_TRACK = -1
"""Track number of lines that belong to none."""


@dataclass(frozen=True)
class RailPath:
    """A rail in plan, sampled about every `STEP_M`.

    Attributes
    ----------
    xy : (n, 2) array
        Metres.
    normal : (n, 2) array
        Unit vectors to the left.
    track : int
        Number of the track it belongs to; the two rails of a track share what happens to the track.
    """

    xy: np.ndarray
    normal: np.ndarray
    track: int


@dataclass(frozen=True)
class Layout:
    """Rails to be found, lines to be dropped, and where to look.

    Attributes
    ----------
    rails, distractors : tuple of RailPath
        Running rails; guard rails and other lines that are no rail.
    spots : (k, 2) array
        Places worth showing, metres.
    """

    rails: tuple[RailPath, ...]
    distractors: tuple[RailPath, ...]
    spots: np.ndarray


def random_layout(rng: np.random.Generator, spacing_m: float, head_width_m: float) -> Layout:
    """Draw a layout by one of the paper's two strategies, splits or connections.

    Parameters
    ----------
    rng : numpy Generator
    spacing_m : float
        Distance between the two railhead centres of a track.
    head_width_m : float
        For the place of guard rails.
    """
    strategy = _splits if rng.random() < 0.75 else _connections
    return strategy(rng, spacing_m, head_width_m)


def random_alignment(rng: np.random.Generator, length_m: float, sharpest_m: float = SHARPEST_RADIUS_M) -> Curve:
    """Draw a track of straights, arcs and clothoids; radii are spread evenly over their logarithm."""
    elements: list[Element] = []
    curvature = 0.0
    while sum(element.length_m for element in elements) < length_m:
        target = 0.0
        if rng.random() < 0.7:
            target = rng.choice([-1, 1]) / math.exp(rng.uniform(math.log(sharpest_m), math.log(4000.0)))
        if target != curvature and rng.random() < 0.8:
            elements.append(Element(rng.uniform(4.0, 40.0), curvature, target))
        elements.append(Element(rng.uniform(5.0, 60.0), target, target))
        curvature = target
    return trace(elements, heading=rng.uniform(-math.pi, math.pi), step_m=STEP_M)


def _splits(rng: np.random.Generator, spacing_m: float, head_width_m: float) -> Layout:
    """Parallel tracks along one random alignment, with turnouts that split off (the paper's first strategy)."""
    count = int(rng.choice([1, 2, 3, 4], p=[0.5, 0.3, 0.15, 0.05]))
    offsets = np.cumsum(rng.uniform(*TRACK_SPACING_M, size=count)) - TRACK_SPACING_M[0]
    alignment = random_alignment(rng, 2 * WORLD_M, SHARPEST_RADIUS_M + (offsets[-1] if count > 1 else 0.0))
    tracks = [_shifted(alignment, offset) for offset in offsets]
    rails: list[RailPath] = []
    distractors: list[RailPath] = []
    spots = [track.xy[len(track.xy) // 2] for track in tracks]
    for track in tracks:
        rails += _pair(track, spacing_m, len(rails))
    for _ in range(int(rng.choice([0, 1, 2], p=[0.45, 0.4, 0.15]))):
        main = tracks[rng.integers(count)]
        if rng.random() < 0.5:
            main = main.reversed()
        branch_rails, guards, spot = _turnout(rng, main, spacing_m, head_width_m, len(rails))
        rails += branch_rails
        distractors += guards
        spots.append(spot)
    return Layout(tuple(rails), tuple(distractors), np.array(spots))


def _connections(rng: np.random.Generator, spacing_m: float, head_width_m: float) -> Layout:
    """Clothoids between random oriented points; tracks may cross (the paper's second strategy)."""
    rails: list[RailPath] = []
    spots = []
    wanted = int(rng.choice([1, 2, 3], p=[0.4, 0.4, 0.2]))
    while len(spots) < wanted:
        middle = rng.uniform(-4.0, 4.0, size=2)
        heading = rng.uniform(-math.pi, math.pi)
        half = rng.uniform(8.0, WORLD_M) * np.array([math.cos(heading), math.sin(heading)])
        bends = rng.normal(0.0, 0.35, size=2)
        ends = tuple(middle - half), heading + bends[0], tuple(middle + half), heading + bends[1]
        element = connect(*ends)
        if element is None or max(abs(element.start), abs(element.end)) > 1 / SHARPEST_RADIUS_M:
            continue
        track = trace([element], ends[0], ends[1], STEP_M)
        rails += _pair(track, spacing_m, len(rails))
        spots.append(track.xy[len(track.xy) // 2])
    return Layout(tuple(rails), (), np.array(spots))


def _pair(track: Curve, spacing_m: float, number: int) -> list[RailPath]:
    """Lay the two rails of a track along the exact normal."""
    return [RailPath(track.offset(side * spacing_m / 2), track.left_normal, number) for side in (1, -1)]


def _shifted(track: Curve, left_m: float) -> Curve:
    """Make the parallel track; curvature is that of the parallel curve, samples keep their spacing nearly."""
    curvature = track.curvature / (1 - left_m * track.curvature)
    return Curve(track.offset(left_m), track.heading, curvature, track.step_m)


def _turnout(
    rng: np.random.Generator, main: Curve, spacing_m: float, head_width_m: float, number: int
) -> tuple[list[RailPath], list[RailPath], np.ndarray]:
    """Lay a branch into a track: its rails, the guard rails opposite the frog, and a spot between toe and frog."""
    form: TurnoutForm = FORMS[rng.integers(len(FORMS))]
    hand = int(rng.choice([-1, 1]))
    toe_m = rng.uniform(0.3, 0.6) * main.length_m
    side = branch(main, toe_m, form, hand, rng.uniform(10.0, 40.0))
    blade_m = rng.uniform(*BLADE_START) * rng.uniform(*BLADE_LENGTH_M)
    rails = _pair(side.piece(blade_m, side.length_m), spacing_m, number)
    apart = separation(main, side, toe_m)
    toe = int(round(toe_m / main.step_m))
    frog = int(np.argmax(apart > spacing_m)) if (apart > spacing_m).any() else len(apart) - 1
    guards = []
    if rng.random() < 0.7:
        guards.append(_guard(rng, main, toe + frog, -hand, spacing_m, head_width_m))
        guards.append(_guard(rng, side, frog, hand, spacing_m, head_width_m))
    return rails, guards, main.xy[toe + int(rng.uniform(0.0, 1.2) * frog * (toe + 1.2 * frog < len(main.xy)))]


def _guard(
    rng: np.random.Generator, track: Curve, at: int, side: int, spacing_m: float, head_width_m: float
) -> RailPath:
    """Lay a guard rail inside the rail opposite the frog, flared at its ends; a third of it behind the frog."""
    half = int(0.5 * rng.uniform(*GUARD_LENGTH_M) / track.step_m)
    centre = at - half // 3
    piece = slice(max(centre - half, 0), max(min(centre + half, len(track.xy)), 2))
    along = np.linspace(-1, 1, len(track.xy[piece]))
    flare = 0.05 * np.clip((np.abs(along) - 0.8) / 0.2, 0, 1)
    left = side * (spacing_m / 2 - head_width_m - rng.uniform(*FLANGEWAY_M) - flare)
    return RailPath(track.xy[piece] + left[:, None] * track.left_normal[piece], track.left_normal[piece], NO_TRACK)
