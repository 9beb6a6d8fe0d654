"""Switch rules off, one at a time, and print which figures of the golden table need each.

Run `python benchmarks/ablation.py [RULE ...] [--scenes SCENE ...] [--variant 'seed 1']`. A rule may be a part of a
name, as `tracks.`. In a scene in which a rule returns what its replacement returns, whenever it is called, it has no
effect and is not run again.

`--worlds 200 [--from 1]` asks instead in how many worlds drawn at random each rule decides over failure: each world is
extracted with all rules and without each of those that act in it, and McNemar's exact test says whether the difference
is more than chance.
"""

from __future__ import annotations

import argparse
import importlib
import os
import sys
from collections import defaultdict
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, is_dataclass
from functools import wraps
from types import GeneratorType
from typing import Any
from unittest.mock import patch

import numpy as np
from golden import TABLE
from processes import processes
from rail_extract.core.classify.flush import NO_LINES, Flush
from rail_extract.core.pipeline import drawing, sources
from rail_extract.core.polyline import Polyline
from rail_extract.laboratory.ruler.golden import (
    PLACES,
    PLAIN,
    VARIANTS,
    Difference,
    Golden,
    build_scene,
    differences,
    figures_of,
)
from rail_extract.laboratory.ruler.rates import mcnemar
from rail_extract.laboratory.ruler.worlds import run
from rail_extract.laboratory.worlds.world import CLOUDS, make

OF_SEARCH = ("classify.", "polyline.")
"""Rules that the search for rail points in a raw cloud follows; without any other one, it is not made again."""

OF_CLEANING = (*OF_SEARCH, "squares.steps.drawn")
"""Rules that decide what the network cleans; without any other one, no square is cleaned again."""

SHOWN = 3
"""Differences printed for each rule: the largest, by their tolerances."""


@dataclass(frozen=True)
class Switch:
    """A rule, and by module below `rail_extract.core` and name in it, the values that replace it when it is off."""

    name: str
    off: tuple[tuple[str, str, Any], ...]


def first(value: Any, *_: Any, **__: Any) -> Any:
    """Return the first argument as it is."""
    return value


def nothing(*_: Any) -> list:
    """Return no result."""
    return []


def none_of(values: Any, *_: Any) -> np.ndarray:
    """Choose none of the values."""
    return np.zeros(len(getattr(values, "axis", values)), dtype=bool)


def all_of(values: Any, *_: Any) -> np.ndarray:
    """Choose all of the values."""
    return np.ones(len(getattr(values, "axis", values)), dtype=bool)


def all_paired(lines: Any, paired: np.ndarray, pairs: Any) -> np.ndarray:
    """Choose all cells, with a partner or without."""
    return all_of(paired)


def _rule(name: str, value: Any, *also: tuple[str, str, Any]) -> Switch:
    module, attribute = name.rsplit(".", 1)
    return Switch(name, ((module, attribute, value), *also))


SWITCHES = (
    _rule("vectorize.open_slips", lambda network, seen: (network, [])),
    _rule("vectorize.cut_bends", first),
    _rule("vectorize.follow_courses", first),
    _rule("vectorize.courses.CUTS_M", (0.0,)),
    _rule("vectorize.attach_branches", first),
    _rule("vectorize.part_branches", first),
    _rule("vectorize.choose_routes", first),
    _rule("vectorize._settle_ends", first),
    _rule("vectorize.slips._paired", lambda found: list(found)),
    _rule("lines.ends._astray", lambda *_: 0),
    _rule("squares.steps.drawn", lambda *_: np.empty((0, 2))),
    _rule("vectorize.close", first),
    _rule("vectorize.junctions.drop_rungs", first),
    _rule("vectorize.junctions.drop_spurs", first),
    _rule("lines.finishing.parts_without_turns", lambda line, *_: [(0.0, Polyline(line).length_m)]),
    _rule("tracks.pairing._without_ghosts", list),
    _rule("tracks.pairing._without_rivals", lambda matches, misfits_m: list(matches)),
    _rule("tracks.pairing._on_one_level", lambda *_: True),
    _rule("tracks.chaining._facing", lambda *_: np.empty((0, 2), dtype=int)),
    _rule("tracks.chaining.MAX_HIDDEN_M", 0.0),
    _rule("tracks.centerlines.fork_centerlines", lambda lines, *_: list(lines)),
    _rule("tracks.centerlines.BENT_M", np.inf),
    _rule("tracks.centerlines.started_abreast", lambda rails: list(rails)),
    _rule("tracks.centerlines.at_gauge", lambda left, right, *_: (left, right)),
    _rule("tracks.centerlines._smoothed", first),
    _rule("polyline.CLOSED_M", -1.0),
    _rule("tracks.pairing.FINE_STEP_M", 0.5),
    _rule("tracks.pairing._is_nearest", lambda *_: True),
    _rule("tracks.pairing.WANDER_WEIGHT", 0.0),
    _rule("tracks.parallels._is_crowded", none_of),
    _rule("checks.warnings._off_level_m", lambda *_: 0.0),
    _rule("checks.doubts.find_jumps", nothing),
    _rule("classify.cells.stands_free", lambda tops, depth_m, marks, lines, *_: all_of(lines)),
    _rule("classify.cells.runs_inside", none_of, ("classify.bars", "runs_inside", none_of)),
    _rule("classify.cells.lower_than_beside", none_of),
    _rule("classify.cells.centred", first),
    _rule("classify.bars.fitted_again", first),
    _rule("classify.bars._completed", lambda found, kept, *_: np.sort(kept.cell)),
    _rule("classify.cells.are_certain", all_paired, ("classify.bars", "are_certain", all_paired)),
    _rule("classify.labels._highest_around", lambda image, cells, reach: np.full(len(cells), -(10**6))),
    _rule("classify.labels.UNDER_MEAN_M", 10.0),
    _rule("classify.square.flush_rails", lambda *_: Flush(np.empty(0, dtype=np.int64), NO_LINES, NO_LINES)),
    _rule("classify.bars.SINGLE_SLOPE", np.inf),
    _rule("classify.bars.SINGLE_FALL", np.inf),
    _rule("classify.bars.SINGLE_DEPTH", -np.inf),
    _rule("classify.bars.SINGLE_HEIGHT_M", 0.0),
    _rule("classify.partner._belongs_to_another", lambda lines, other, apart_m, *_: np.zeros(apart_m.shape, bool)),
    _rule("classify.partner._majority", first),
    _rule("classify.labels.MIN_AXES", 1),
    _rule("classify.tops._around", first),
    _rule("clouds.on_heads.BELOW_SHARE", 1.0),
    _rule("squares.steps.told_apart", first),
    _rule("heads.refinement._points_of_arc", lambda *_: np.zeros(2)),
    _rule("heads.refinement.HEEL_SPREAD_M", np.inf),
    _rule("heads.head_points.CROSSED_M", np.inf),
    _rule("heads.own_level.DRIFT", 0.0),
    _rule("heads.roads.CLEARLY_M", 0.0),
    _rule("heads.axis.SHOWN_SHARE", 0.0),
    _rule("heads.axis._either_end", lambda points: np.zeros(len(points.stations))),
    _rule("heads.axis.hidden_edges", lambda points: np.zeros(points.free.shape, dtype=bool)),
    _rule("heads.edges._excess", np.zeros_like),
    _rule("heads.sections._pull", lambda station, is_left, count: np.zeros(count)),
    _rule("heads.sections._half_apart", lambda *_: 0.0),
    _rule("heads.own_level.SHIFTED_M", 0.0),
    _rule("airborne.guide_line._without_bulges", first),
    _rule("airborne.guide_line._smoothed", first),
    _rule("airborne.guide_line._near_the_median", lambda corridor: np.ones(len(corridor.t), dtype=bool)),
    _rule("airborne.guide_line._levelled_strips", first),
    _rule("airborne.search._support", lambda number, axes, found: np.zeros_like(found[number].best)),
    _rule("airborne.fitting.certainty", lambda course, *_: np.ones(len(course.across))),
    _rule("airborne.rounds.measure", lambda corridor, shape, shows: (shape, np.nan)),
    _rule("airborne.rounds.REACHES_M", (0.25,)),
    _rule("airborne.ridges._other_spacing", lambda count, mean, u, shape: np.nan),
    _rule("airborne.rounds._distances", nothing),
    _rule("airborne.rounds._spread", lambda *_: 1.0),
    _rule("airborne.rounds.OUTLIER", np.inf),
    _rule("airborne.fitting.strip_error", lambda refined: np.zeros(len(refined.t))),
    _rule("airborne.fitting._off_level", lambda refined: np.zeros(len(refined.t), dtype=bool)),
    _rule("airborne.fitting._unclaimed", lambda *_: np.empty((0, 2))),
    _rule("airborne.fitting.SURE", 0.0),
    _rule("airborne.fitting.MARGIN", -np.inf),
    _rule("airborne.fitting.OWN_GAIN", -np.inf),
    _rule("airborne.fitting.LONG_GAIN", 0.0),
    _rule("airborne.fitting.RIVAL_SHARE", np.inf),
    _rule("airborne.fitting.REPEATED_SHARE", np.inf),
    _rule("airborne.fitting.ASIDE_M", np.inf),
    _rule("airborne.fitting.APART_M", 0.0),
    _rule("airborne.fitting.TOE_FACTOR", 1.0),
    _rule("airborne.fitting.SHARED", 1.0),
    _rule("airborne.fitting.FOOTPRINT_SHARE", 0.0),
    _rule("airborne.fitting.MAX_SIGMA_M", np.inf),
    _rule("airborne.files._shown_otherwise", lambda *_: np.nan),
    _rule("alignment.fit.with_round_radii", lambda chain, points, fit, elements, *_: tuple(elements)),
    _rule("alignment.fit._squeezed", lambda *_: None),
    _rule("alignment.fit.strays", none_of),
    _rule("alignment.measured.strays", none_of),
    _rule("alignment.structure._at_least", first),
    _rule("alignment.structure.LIKELY", np.inf),
    _rule("alignment.structure.LEAST_PRICE", 0.0),
    _rule("alignment.structure._hang_together", lambda *_: True),
    _rule("alignment.structure.SHOULDER_M", np.inf),
    _rule("alignment.structure._united", lambda chain, *_: chain),
    _rule("alignment.structure._between", lambda chain, *_: chain),
    _rule("alignment.structure._joined", nothing),
    _rule("alignment.layouts._snapped", lambda chain, *_: (chain, np.zeros(len(chain.p), dtype=bool))),
    _rule("alignment.noise._usual", first),
    _rule("alignment.layouts._spent", lambda *_: 0.0),
)


def main() -> None:
    """Print a row for each rule."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("rules", nargs="*", help="parts of the names of rules; default: all")
    parser.add_argument("--scenes", nargs="+", choices=PLACES, metavar="SCENE", default=PLACES)
    parser.add_argument("--variant", choices=[one.name for one in VARIANTS], default=PLAIN.name, help="model or seed")
    parser.add_argument("--workers", type=int, default=os.cpu_count() or 1, help="processes (default: one per core)")
    parser.add_argument("--worlds", type=int, metavar="N", help="worlds of each kind of cloud, in place of scenes")
    parser.add_argument("--from", type=int, default=1, dest="first", metavar="A", help="first seed of the worlds")
    arguments = parser.parse_args()
    chosen = [
        switch.name
        for switch in SWITCHES
        if any(part in switch.name for part in arguments.rules) or not arguments.rules
    ]
    if arguments.worlds:
        seeds = range(arguments.first, arguments.first + arguments.worlds)
        tasks_of_worlds = [(seed, cloud, chosen) for cloud in CLOUDS for seed in seeds]
        with processes(arguments.workers) as pool:
            print(*rows_of_worlds(chosen, pool.map(ablate_world, tasks_of_worlds)), sep="\n")
        return
    acts: dict[str, int] = defaultdict(int)
    needs: dict[str, list[Difference]] = defaultdict(list)
    with processes(arguments.workers) as pool:
        tasks = [(place, chosen, arguments.variant) for place in arguments.scenes]
        for (place, *_), found in zip(tasks, pool.map(ablate, tasks)):
            print(place, file=sys.stderr, flush=True)
            for name, moved in found.items():
                acts[name] += 1
                needs[name] += moved
                print(f"    {name}", *moved, sep="\n        ", file=sys.stderr, flush=True)
    print("| rule | acts in | figures that move without it |\n|---|---|---|")
    for name in chosen:
        print(f"| `{name}` | {acts[name]} of {len(tasks)} scenes | {_largest(needs[name])} |")


def _largest(moved: Sequence[Difference]) -> str:
    """Write the largest differences, and the number of scenes."""
    tolerances = Golden(TABLE).tolerances
    ordered = sorted(
        moved, key=lambda one: -abs(np.nan_to_num(one.now - one.before, nan=1e6)) / (tolerances[one.figure] or 0.01)
    )
    shown = "; ".join(f"{one.scene}: {one.figure} {one.before:.4g} → {one.now:.4g}" for one in ordered[:SHOWN])
    more = len({one.scene for one in moved}) - len({one.scene for one in ordered[:SHOWN]})
    return (shown or "none") + (f"; {more} more scenes" if more > 0 else "")


def ablate(task: tuple[str, Sequence[str], str]) -> dict[str, list[Difference]]:
    """Run a scene with all rules and without each; returns the figures that moved, by the rules that have an effect."""
    place, names, name = task
    variant = next(one for one in VARIANTS if one.name == name)
    scene = build_scene(place, variant.seed_shift)
    chosen = [switch for switch in SWITCHES if switch.name in names]
    effective: set[str] = set()
    tolerances = Golden(TABLE).tolerances
    with patch.object(drawing, "clean_square", _remembering(drawing.clean_square)):
        with _watched(chosen, effective):
            before = figures_of(place, scene, variant)
        found = {}
        for switch in (switch for switch in chosen if switch.name in effective):
            with _without(switch):
                try:
                    now = figures_of(place, scene, variant)
                except Exception as error:  # noqa: BLE001 - whatever happens without a rule is its effect
                    print(f"{place} without {switch.name}: {error}", file=sys.stderr)
                    now = {}
            found[switch.name] = differences(place, before, now, tolerances)
    return found


Outcome = tuple[bool, dict[str, bool]]
"""Whether a world fails with all rules, and without each of those that act in it."""


def ablate_world(task: tuple[int, str, Sequence[str]]) -> Outcome:
    """Extract a world with all rules, and without each of those that have an effect in it."""
    seed, cloud, names = task
    world = make(seed, cloud)
    chosen = [switch for switch in SWITCHES if switch.name in names]
    effective: set[str] = set()
    with ExitStack() as kept:
        searched = kept.enter_context(_kept(sources, "find_rail_points", _listing))
        cleaned = kept.enter_context(_kept(drawing, "clean_square", _remembering))
        with _watched(chosen, effective):
            before = bool(run(world).faults)
        without = {}
        for switch in (switch for switch in chosen if switch.name in effective):
            with ExitStack() as stack:
                if switch.name.startswith(OF_SEARCH):
                    stack.enter_context(patch.object(sources, "find_rail_points", searched))
                if switch.name.startswith(OF_CLEANING):
                    stack.enter_context(patch.object(drawing, "clean_square", cleaned))
                stack.enter_context(_without(switch))
                without[switch.name] = bool(run(world).faults)
    print(f"{cloud} world {seed}: {'fails' if before else 'right'}", file=sys.stderr, flush=True)
    return before, without


def rows_of_worlds(names: Sequence[str], outcomes: Iterable[Outcome]) -> Iterator[str]:
    """Yield the table of rules: worlds that fail without each alone, and with it alone, and McNemar's chance."""
    known = list(outcomes)
    yield f"{len(known)} worlds, {sum(before for before, _ in known)} fail with all rules."
    yield "| rule | acts in | fail without it alone | fail with it alone | chance |\n|---|---|---|---|---|"
    for name in names:
        after = [without.get(name, before) for before, without in known]
        acts = sum(name in without for _, without in known)
        worse, better, chance = mcnemar(after, [before for before, _ in known])
        yield f"| `{name}` | {acts} | {worse} | {better} | {chance:.3f} |"


@contextmanager
def _without(switch: Switch) -> Iterator[None]:
    """Switch a rule off."""
    with ExitStack() as stack:
        for module, attribute, value in switch.off:
            stack.enter_context(patch.object(_module(module), attribute, value))
        yield


@contextmanager
def _watched(switches: Sequence[Switch], effective: set[str]) -> Iterator[None]:
    """Note the switches whose replacements return anything else than the rules do, and all constants."""
    with ExitStack() as stack:
        for switch in switches:
            for module, attribute, value in switch.off:
                original = getattr(_module(module), attribute)
                if not callable(original):
                    effective.add(switch.name)
                else:
                    watching = _watching(original, value, switch.name, effective)
                    stack.enter_context(patch.object(_module(module), attribute, watching))
        yield


def _watching(rule: Callable, instead: Callable, name: str, effective: set[str]) -> Callable:
    """Wrap a rule, so that its name is noted when its replacement returns something else."""

    @wraps(rule)
    def wrapped(*arguments: Any, **named: Any) -> Any:
        result = rule(*arguments, **named)
        if isinstance(result, GeneratorType):
            result = list(result)
        if name not in effective and not same(result, instead(*arguments, **named)):
            effective.add(name)
        return result

    return wrapped


@contextmanager
def _kept(module: Any, name: str, keeping: Callable[[Callable], Callable]) -> Iterator[Callable]:
    """Keep the results of a function; yields the function that computes them each time."""
    function = getattr(module, name)
    with patch.object(module, name, keeping(function)):
        yield function


def _listing(search: Callable) -> Callable:
    """Wrap the search for rail points, so that it is made once."""
    results: list[list] = []

    @wraps(search)
    def wrapped(*arguments: Any) -> list:
        if not results:
            results.append(list(search(*arguments)))
        return results[0]

    return wrapped


def _remembering(function: Callable) -> Callable:
    """Wrap the cleaning of a square, so that each square is cleaned once."""
    results: dict[tuple, Any] = {}

    @wraps(function)
    def wrapped(source: Any, square: Any, *others: Any) -> Any:
        key = (source.class_code, square.key, source.counts.get(square.key))
        if key not in results:
            results[key] = function(source, square, *others)
        return results[key]

    return wrapped


def same(one: Any, other: Any) -> bool:
    """Return whether two results are equal, part by part."""
    if one is other:
        return True
    if isinstance(one, np.ndarray):
        return np.shape(one) == np.shape(other) and bool(np.array_equal(one, other, equal_nan=one.dtype.kind == "f"))
    if is_dataclass(one):
        return type(one) is type(other) and same(vars(one), vars(other))
    if isinstance(one, (list, tuple)):
        return len(one) == len(other) and all(map(same, one, other))
    if isinstance(one, dict):
        return set(one) == set(other) and all(same(value, other[key]) for key, value in one.items())
    return type(one) is type(other) and bool(one == other)


def _module(name: str) -> Any:
    return importlib.import_module(f"rail_extract.core.{name}")


if __name__ == "__main__":
    main()
