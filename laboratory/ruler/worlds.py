"""What counts: whether an extraction fails in a world, where and why, and whether it fails without a word.

See docs/accuracy.md, "Worlds drawn at random".
"""

from __future__ import annotations

import tempfile
import time
import traceback
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from scipy.spatial import cKDTree

from ...core.checks.findings import Finding, examine, list_findings, verdict
from ...core.clouds.points import ask
from ...core.comparison import cut
from ...core.errors import RailExtractError
from ...core.parameters import Parameters
from ...core.pipeline import extract_files
from ...core.pipeline.sources import Classified, Raw
from ...core.polyline import Chords, Polyline
from ...core.rails import RailNetwork
from ...core.run.tasks import Runner
from ...core.standards import RAIL_CLASS, SEARCHED_CLASSES
from ..worlds.world import World
from .lines import Match, match

ENGINE = "OPENCV"
"""Every installation has this engine; others round differently."""

NEAR_M = 0.05
"""Distance in plan within which a line is on a rail."""

BIN_M, END_M = 1.0, 3.0
"""Length of rail over which points are counted, and length that is left out at both ends of a rail in the cloud."""

BREAK_M = 2 * Parameters.max_gap_m
"""Length of rail with hardly any points in which its line may end once: what is bridged, on either side."""

FALSE_M = 3.0
"""Greatest length of lines that are on no rail."""

FINDING_M = 10.0
"""Distance from a fault within which a finding counts as a word about it."""

WINDOW = 20
"""Places, 5 cm apart, over which an error is averaged to find where it is largest."""

MISSING, FALSE, ACROSS, HEIGHT, FEWER, MORE, REFUSED, BROKEN = (
    *("rail not found", "false line", "error across", "error in height", "too few lines", "too many lines"),
    *("refused", "unexpected error"),
)
"""Causes of failures."""


@dataclass(frozen=True)
class Limits:
    """What an extraction must reach.

    A rail is to be found from `points_per_m` points of its head on; `found` is the least share of this length, and
    `across_m` and `height_m` are the largest root mean squares of the errors.
    """

    points_per_m: float
    found: float
    across_m: float
    height_m: float


ON_GROUND = Limits(40.0, 0.99, 0.004, 0.003)
FROM_ABOVE = Limits(8.0, 0.98, 0.012, 0.008)


@dataclass(frozen=True)
class Fault:
    """One reason for which a world fails: a figure beyond its limit, or the message of an error.

    `xyz` is the place where it is worst, None without a result. It is silent if the verdict is good, no finding is
    near, and the standard error there is at most half the error.
    """

    cause: str
    figure: float
    xyz: np.ndarray | None = None
    silent: bool = False
    words: str = ""


@dataclass(frozen=True)
class Judged:
    """An extraction compared with its world: its faults, figures by name, and lines matched with the truth.

    `shown` says which places of the truth are to be found.
    """

    faults: tuple[Fault, ...]
    figures: dict[str, Any]
    network: RailNetwork | None = None
    found: Match | None = None
    shown: np.ndarray = field(default_factory=lambda: np.empty(0, dtype=bool))
    findings: tuple[Finding, ...] = ()


def extract_world(world: World) -> RailNetwork:
    """Write the cloud of a world to a file and extract its rails, as a user does with the true rail standard."""
    standard = world.scene.standard
    parameters = Parameters(
        standard.gauge_m,
        standard.head_width_m,
        other_gauges_m=world.scene.other_gauges_m,
        engine=ENGINE,
        quality_step_m=1.0,
    )
    raw = world.classified is None
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "world.laz"
        world.write(path)
        request = ask([path], SEARCHED_CLASSES if raw else [RAIL_CLASS], None, None)
        squares = Path(folder) / "squares"
        squares.mkdir()
        return extract_files(Raw(request) if raw else Classified(request), squares, parameters, Runner())


def run(world: World) -> Judged:
    """Extract the rails of a world and judge the result."""
    start = time.process_time()
    try:
        network = extract_world(world)
    except RailExtractError as error:
        return _without_result(world, REFUSED, str(error), time.process_time() - start)
    except Exception as error:  # noqa: BLE001 - whatever a user would see as a crash is a result here
        last = traceback.extract_tb(error.__traceback__)[-1]
        words = f"{type(error).__name__}: {error} ({Path(last.filename).name}, line {last.lineno})"
        return _without_result(world, BROKEN, words, time.process_time() - start)
    judged = judge(world, network)
    judged.figures["seconds"] = round(time.process_time() - start, 1)
    return judged


def _without_result(world: World, cause: str, words: str, seconds: float) -> Judged:
    """Judge an error; where nothing is to be found, refusing is right."""
    pieces = cut(world.scene.shown)
    shown = to_be_found(world, pieces)
    length_m = float(pieces.lengths[shown].sum())
    figures = {"to find m": round(length_m, 1), "words": words, "seconds": round(seconds, 1)}
    right = cause == REFUSED and length_m == 0
    return Judged(() if right else (Fault(cause, length_m, words=words),), figures, shown=shown)


def limits_of(world: World) -> Limits:
    """Return what must be reached in a world."""
    return FROM_ABOVE if world.survey.from_above else ON_GROUND


def to_be_found(world: World, pieces: Chords) -> np.ndarray:
    """Return the pieces of the true rails that the cloud shows, (n,) bool, without `END_M` at both ends."""
    shown = np.zeros(len(pieces.middle_t), dtype=bool)
    heads = world.scene.xyz[world.heads, :2]
    if not len(heads):
        return shown
    tree, half_m = cKDTree(heads), world.scene.standard.head_width_m / 2 + _blur_m(world)
    least = limits_of(world).points_per_m
    for number, rail in enumerate(world.scene.shown):
        mine = pieces.number == number
        bins = (pieces.middle_t[mine] / BIN_M).astype(int)
        dense = _per_m(rail, tree, half_m, bins.max() + 1) >= least
        seen = dense[bins]
        if seen.any():
            first, last = pieces.middle_t[mine][seen][[0, -1]]
            shown[mine] = seen & (pieces.middle_t[mine] > first + END_M) & (pieces.middle_t[mine] < last - END_M)
    return shown & ~_is_flat(world, pieces)


def _is_flat(world: World, pieces: Chords) -> np.ndarray:
    """Return where a raw cloud from above shows no rail, (n,) bool: its beams and its blur are as wide as a groove.

    Nothing else tells a head from the pavement around it.
    """
    paved_m = world.surroundings.paved_m
    if paved_m is None or world.classified is not None or not world.survey.from_above:
        return np.zeros(len(pieces.middle_t), dtype=bool)
    return (pieces.middle_t > paved_m[0] - END_M) & (pieces.middle_t < paved_m[1] + END_M)


def _blur_m(world: World) -> float:
    """Return how far points of a head are off it in plan, by noise and registration."""
    return 0.02 if world.survey.from_above else 0.01


def _per_m(rail: np.ndarray, tree: cKDTree, half_m: float, bins: int) -> np.ndarray:
    """Count the points of a head in each section of `BIN_M` along its rail, (bins,), per metre."""
    line = Polyline(rail).resampled(half_m / 2)
    places, at = line.xyz, line.t
    near = tree.query_ball_point(places[:, :2], half_m)
    number = np.concatenate([np.asarray(one, dtype=np.int64) for one in near]) if len(near) else np.empty(0, np.int64)
    place = np.repeat(np.arange(len(places)), [len(one) for one in near])
    section = np.minimum((at[place] / BIN_M).astype(np.int64), bins - 1)
    pairs = np.unique(section * len(tree.data) + number)
    count = np.bincount(pairs // len(tree.data), minlength=bins)
    length = np.minimum(BIN_M, at[-1] - BIN_M * np.arange(bins)).clip(0.2 * BIN_M)
    return count / length


def judge(world: World, network: RailNetwork) -> Judged:
    """Compare the lines of a world with its truth by `Limits`."""
    frame, lines = world.scene.frame, [rail.xyz for rail in network.rails]
    to_world = [frame.to_local(network.frame.to_crs(line)) for line in lines]
    pieces = cut(world.scene.shown)
    shown = to_be_found(world, pieces)
    found = match(to_world, world.scene.shown)
    gauges_m = (world.scene.standard.gauge_m, *world.scene.other_gauges_m)
    findings = list_findings(network, gauges_m) if network.centerlines else ()
    good = bool(network.centerlines) and verdict(examine(network, gauges_m))[0] == "good"
    at_findings = [
        Polyline(one.xyz).resampled(1.0).xyz if len(np.atleast_2d(one.xyz)) > 1 else np.atleast_2d(one.xyz)
        for one in findings
    ]
    words = [frame.to_local(network.frame.to_crs(place)) for place in at_findings]
    ruler = _Ruler(world, network, found, pieces, shown, to_world)
    faults = tuple(_with_silence(fault, good, words, sigma_m) for fault, sigma_m in ruler.faults())
    figures = ruler.figures()
    figures["verdict"] = "good" if good else "not good"
    figures["findings"] = len(findings)
    return Judged(faults, figures, network, found, shown, findings)


def _with_silence(fault: Fault, good: bool, words: Sequence[np.ndarray], sigma_m: float) -> Fault:
    """Note whether nothing warns of a fault."""
    if fault.xyz is None or not good:
        return fault
    distance_m = min((float(np.hypot(*(one - fault.xyz)[:, :2].T).min()) for one in words), default=np.inf)
    doubted = fault.cause in (ACROSS, HEIGHT) and sigma_m > fault.figure / 2
    return Fault(fault.cause, fault.figure, fault.xyz, bool(distance_m > FINDING_M and not doubted), fault.words)


class _Ruler:
    """The comparison of one world."""

    def __init__(
        self,
        world: World,
        network: RailNetwork,
        found: Match,
        pieces: Chords,
        shown: np.ndarray,
        lines: Sequence[np.ndarray],
    ) -> None:
        self.world, self.network, self.found, self.pieces, self.shown = world, network, found, pieces, shown
        self.lines = cut(lines)
        self.limits = limits_of(world)
        nothing = np.zeros(len(found.back.distance), dtype=bool)
        self.on_shown = shown[found.true] if len(found.true) else nothing
        self.near = found.back.distance <= NEAR_M
        self.judged = found.where(shown, self.on_shown).within(NEAR_M)

    def figures(self) -> dict[str, Any]:
        """Return the figures of the JSON line; lengths in metres, errors in millimetres."""
        judged, (least, most) = self.judged, self.expected()
        sigma_m, sigmaz_m = self.stated()
        back, near = self.found.back, self.near & self.on_shown
        share = {
            "n m": round(float(back.weight[near].sum()), 1),
            **{
                f"{name} {times}": round(float(back.weight[near & (np.abs(error) <= times * sigma)].sum()), 2)
                for name, error, sigma in (("across", back.lateral, sigma_m), ("height", back.height, sigmaz_m))
                for times in (1, 2)
            },
        }
        return {
            "to find m": round(float(self.pieces.lengths[self.shown].sum()), 1),
            "found %": _rounded(100 * judged.completeness, 2),
            "false m": _rounded(self.found.wrong_m(NEAR_M), 2),
            "across mm": _rounded(1000 * judged.lateral_rmse_m, 2),
            "across p95 mm": _rounded(1000 * judged.lateral_p95_m, 2),
            "height mm": _rounded(1000 * judged.height_rmse_m, 2),
            "height p95 mm": _rounded(1000 * judged.height_p95_m, 2),
            "height bias mm": _rounded(1000 * judged.height_bias_m, 2),
            "lines": len(self.network.rails),
            "expected": [least, most],
            "within": share,
        }

    def stated(self) -> tuple[np.ndarray, np.ndarray]:
        """Return the standard errors across and in height at each place of the lines, (n,) metres each."""
        across, height = np.full((2, len(self.found.line)), np.nan)
        for number, rail in enumerate(self.network.rails):
            mine = self.found.line == number
            if rail.support is not None:
                across[mine] = np.interp(self.found.t[mine], rail.support.t, rail.support.sigma_m)
                height[mine] = np.interp(self.found.t[mine], rail.support.t, rail.support.sigmaz_m)
        return across, height

    def faults(self) -> Iterator[tuple[Fault, float]]:
        """Yield the faults, each with the standard error that is stated where it is worst."""
        judged, limits = self.judged, self.limits
        if self.shown.any() and not judged.completeness >= limits.found:
            missing = self.shown & ~(self.found.there.distance <= NEAR_M)
            yield Fault(MISSING, 100 * judged.completeness, self.pieces.middle[_longest(missing)]), np.nan
        false_m = self.found.wrong_m(NEAR_M)
        if false_m > FALSE_M:
            yield Fault(FALSE, false_m, self.lines.middle[_longest(~self.near)]), np.nan
        for cause, rms_m, most_m, errors, stated in self._errors():
            if rms_m > most_m:
                place, error_m = _worst(np.where(self.near & self.on_shown, errors, 0.0), self.found.line)
                yield Fault(cause, error_m, self.lines.middle[place]), float(stated[place])
        least, most = self.expected()
        count = len(self.network.rails)
        if count < least:
            yield Fault(FEWER, count - least, self._least_found()), np.nan
        if count > most:
            yield Fault(MORE, count - most, self._extra()), np.nan

    def _errors(self) -> Iterator[tuple[str, float, float, np.ndarray, np.ndarray]]:
        sigma_m, sigmaz_m = self.stated()
        back, judged, limits = self.found.back, self.judged, self.limits
        yield ACROSS, judged.lateral_rmse_m, limits.across_m, back.lateral, sigma_m
        yield HEIGHT, judged.height_rmse_m, limits.height_m, back.height, sigmaz_m

    def expected(self) -> tuple[int, int]:
        """Return the least and the largest number of lines that are right.

        Each rail of which more than `END_M` is to be found is a line. What need not be found, apart from the ends, may
        break a line once in each `BREAK_M`.
        """
        least = most = 0
        for number in range(self.found.truth_count):
            mine = self.pieces.number == number
            seen_m, rail_m = (float(self.pieces.lengths[which].sum()) for which in (mine & self.shown, mine))
            least += seen_m > END_M
            most += 1 + int(max(rail_m - seen_m - 2 * END_M, 0.0) / BREAK_M + 0.5)
        return int(least), int(most)

    def _least_found(self) -> np.ndarray | None:
        """Return the middle of the true rail of which the smallest share is found."""
        near = self.found.there.distance <= NEAR_M
        shares = [
            (float(near[mine].mean()), number)
            for number in range(self.found.truth_count)
            for mine in [self.shown & (self.pieces.number == number)]
            if mine.any()
        ]
        if not shares:
            return None
        mine = np.flatnonzero(self.shown & (self.pieces.number == min(shares)[1]))
        return self.pieces.middle[mine[len(mine) // 2]]

    def _extra(self) -> np.ndarray:
        """Return the middle of the line that is least on a rail, or of the shortest one."""
        numbers = np.unique(self.found.line)
        key = [
            (float(self.near[self.found.line == one].mean()), int((self.found.line == one).sum())) for one in numbers
        ]
        mine = np.flatnonzero(self.found.line == numbers[min(range(len(key)), key=lambda one: key[one])])
        return self.lines.middle[mine[len(mine) // 2]]


def _longest(which: np.ndarray) -> int:
    """Return the middle of the longest run of marked places."""
    borders = np.flatnonzero(np.diff(np.concatenate([[0], which.astype(int), [0]])))
    start, end = max(zip(borders[::2], borders[1::2]), key=lambda one: one[1] - one[0])
    return int((start + end) // 2)


def _worst(errors: np.ndarray, line: np.ndarray) -> tuple[int, float]:
    """Return the place of the largest mean error over `WINDOW` places of a line, and that error."""
    best = (0, 0.0)
    for number in np.unique(line):
        mine = np.flatnonzero(line == number)
        width = min(WINDOW, len(mine))
        mean = np.convolve(errors[mine], np.ones(width) / width, mode="same")
        place = int(np.argmax(np.abs(mean)))
        if abs(mean[place]) > best[1]:
            best = int(mine[place]), float(abs(mean[place]))
    return best


def _rounded(value: float, digits: int) -> float | None:
    return round(float(value), digits) if np.isfinite(value) else None
