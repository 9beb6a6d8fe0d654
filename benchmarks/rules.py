"""The rules of the core that can be switched off, one at a time, and what each is replaced by."""

from __future__ import annotations

import importlib
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, is_dataclass, replace
from functools import wraps
from types import GeneratorType
from typing import Any
from unittest.mock import patch

import numpy as np
from rail_extract.core.classify.flush import NO_FLUSH
from rail_extract.core.polyline import Polyline


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
    _rule("vectorize.open_slips", lambda network, *_: (network, [])),
    _rule("vectorize.cut_bends", first),
    _rule("vectorize.follow_courses", first),
    _rule("vectorize.courses.CUTS_M", (0.0,)),
    _rule("vectorize.attach_branches", first),
    _rule("vectorize.part_branches", first),
    _rule("vectorize._settle_ends", first),
    _rule("vectorize.cells.AT_GAUGE_M", -1.0),
    _rule("heads.top._raised_stations", lambda top: np.zeros(len(top.points.stations), dtype=bool)),
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
    _rule("classify.bars._completed", lambda found, kept, *_: np.sort(kept.cell)),
    _rule("classify.bars.opposite_heads", lambda *_: np.empty(0, dtype=np.int64)),
    _rule("classify.cells.are_certain", all_paired, ("classify.bars", "are_certain", all_paired)),
    _rule("classify.labels._highest_around", lambda image, cells, reach: np.full(len(cells), -(10**6))),
    _rule("classify.labels.UNDER_MEAN_M", 10.0),
    _rule("classify.square.flush_rails", lambda *_: NO_FLUSH),
    _rule("classify.bars.SINGLE_HEIGHT_M", 0.0),
    _rule("classify.bars.SINGLE_RISE_M", -np.inf),
    _rule("classify.bars.STEEP", np.inf),
    _rule("classify.partner.CANT", np.inf),
    _rule("classify.partner._belongs_to_another", lambda lines, other, apart_m, *_: np.zeros(apart_m.shape, bool)),
    _rule("classify.partner._majority", first),
    _rule("classify.labels.MIN_AXES", 1),
    _rule("classify.blunt._on_heads", lambda kept, crests, *_: replace(kept, lines=crests)),
    _rule("classify.low._on_heads", lambda shown, lines, *_: lines),
    _rule("labelling.finding.any_sharp", lambda seen: False),
    _rule("classify.tops._around", first),
    _rule("classify.tops.SHADOWED_SHARE", 0.5),
    _rule("classify.pieces.SHOWN_SHARE", 0.0),
    _rule("classify.low.SHOWN_SHARE", 0.0, ("classify.bars", "SHOWN_SHARE", 0.0)),
    _rule("classify.blunt.SHOWN_SHARE", 0.0),
    _rule("classify.low.above_sides", lambda xy, height, lines, piece: np.full(int(piece.max()) + 1, np.inf)),
    _rule("classify.ways.MOSTLY_CLEAR", 0.0),
    _rule("classify.flush.CAVITY_SIGMAS", 0.0),
    _rule("classify.flush.OTHER_ROW_M", np.inf),
    _rule("classify.flush.STREET_M", 0.0),
    _rule("classify.gaps.MIN_KNOWN", np.inf),
    _rule("clouds.on_heads.BELOW_SHARE", 1.0),
    _rule("squares.steps.told_apart", first),
    _rule("heads.faces.COUNTED", 1000.0),
    _rule("heads.sections._are_aside", lambda stray, station, count: np.zeros(count, dtype=bool)),
    _rule("heads.refinement._points_of_arc", lambda *_: np.zeros(2)),
    _rule("heads.refinement.HEEL_SPREAD_M", np.inf),
    _rule("heads.head_points.CROSSED_M", np.inf),
    _rule("heads.own_level.DRIFT", 0.0),
    _rule("heads.roads.CLEARLY_M", 0.0),
    _rule("heads.axis._either_end", lambda points: np.zeros(len(points.stations))),
    _rule("heads.axis.hidden_edges", lambda points: np.zeros(points.free.shape, dtype=bool)),
    _rule("heads.edges._excess", np.zeros_like),
    _rule("heads.edges._are_wide", lambda points, _: np.zeros(len(points.stations), dtype=bool)),
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


def chosen_by(parts: Sequence[str]) -> list[Switch]:
    """Return the rules whose names contain one of some parts, or all rules if there is none."""
    return [switch for switch in SWITCHES if not parts or any(part in switch.name for part in parts)]


@contextmanager
def without(switch: Switch) -> Iterator[None]:
    """Switch a rule off."""
    with ExitStack() as stack:
        for module, attribute, value in switch.off:
            stack.enter_context(patch.object(module_of(module), attribute, value))
        yield


@contextmanager
def watched(switches: Sequence[Switch], effective: set[str]) -> Iterator[None]:
    """Note the switches whose replacements return anything else than the rules do, and all constants."""
    with ExitStack() as stack:
        for switch in switches:
            for module, attribute, value in switch.off:
                original = getattr(module_of(module), attribute)
                if not callable(original):
                    effective.add(switch.name)
                else:
                    watching = _watching(original, value, switch.name, effective)
                    stack.enter_context(patch.object(module_of(module), attribute, watching))
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


def remembering(function: Callable) -> Callable:
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


def module_of(name: str) -> Any:
    """Import a module of the core."""
    return importlib.import_module(f"rail_extract.core.{name}")
