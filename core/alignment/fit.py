"""Fit of an alignment to a measured track: elements in plan, height and cant, and how far the track lies off them."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Optional

import numpy as np

from ..errors import ParameterError
from ..frame import LocalFrame
from ..parameters import JUMPS, FitParameters
from ..polyline import Polyline, runs
from ..progress import SILENT, Progress
from .chain import Chain
from .elements import Alignment, Element, PlanElement
from .layouts import (
    Given,
    cants,
    chain_errors,
    given_along,
    given_of,
    heights,
    moved,
    noted,
    off_element,
    on_clothoids,
    plan_errors,
    remaining,
    with_round_radii,
    without,
)
from .measured import LEAST_POINTS, Deviations, Measured, Track, deviations_of, lateral_signal, measured_of
from .noise import Noise, strays
from .plane_fit import FitError, MeasuredLine, PlanFit, fit_plan
from .structure import CANT, HEIGHT, PLAN, Signal, SignalKind, find_structure, noise_of, refitted

HOLDS = 3.0
"""A fit does not hold where the line is off by more than this many tolerances, as a root mean square."""

SQUEEZED = 0.5
"""Share of the least length below which an element that the fit shortens at an end of the line is left out."""

UNSURE, MANY = 1.0 / 3.0, 0.25
"""An arc is near the noise if its standard error exceeds this share of its radius; more than this share of all arcs is
reported."""

AT_END_M = 0.01
"""The foot of a point at an end of the design may lie this far beyond it, metres: the fit moves the end by micrometres,
and the point counts in any case."""

LEAST_CANT_POINTS = 20
"""With fewer places of known cant, it has no elements."""


@dataclass(frozen=True)
class Fit:
    """The alignment of a track, the root mean square of the slews, and the noise of the points' distances from it."""

    alignment: Alignment
    deviations: Deviations
    rms_mm: float
    noise: Noise


def fit_track(
    track: Track,
    frame: LocalFrame,
    settings: FitParameters,
    fixed: Optional[Alignment] = None,
    progress: Progress = SILENT,
) -> Fit:
    """Fit the design elements of a track; warn where the fit does not hold.

    The types of `fixed` elements are held, and the radii and ends that were edited.
    """
    measured = measured_of(track, HOLDS * settings.tolerance_m, progress)
    in_plan, in_height, of_cant = progress.divide([4.0, 1.0, 1.0])
    measured, plan = _followed(track.track_id, measured, settings, fixed, in_plan)
    elements = _stated(plan)
    _warn_of_noise(track.track_id, elements, progress)
    if settings.rounded and fixed is None:
        elements = with_round_radii(plan.chain, plan.points, plan.fit, elements, in_plan)
    elements = tuple(moved(one, float(measured.along[0])) for one in elements)
    feet = plan.fit.s + measured.along[0]
    first, last = _holding(track.track_id, elements, feet[measured.in_plan > 0], settings.tolerance_m, progress)
    alignment = Alignment(track.track_id, frame, elements[first : last + 1])
    alignment = _with_heights(alignment, feet, measured, settings, fixed, in_height)
    alignment = _with_cants(alignment, feet, measured, track, settings, fixed, of_cant)
    deviations = deviations_of(alignment, track.track_id, measured.xyz, measured.along, track.cant)
    return Fit(alignment, deviations, float(np.sqrt(np.mean(deviations.slew_mm**2))), plan.noise)


def fit_tracks(
    tracks: Sequence[Track],
    frame: LocalFrame,
    settings: FitParameters,
    fixed: Mapping[Optional[int], Alignment],
    progress: Progress = SILENT,
) -> list[Fit]:
    """Fit the design elements of tracks; those that cannot have any are named and left out.

    Raises ParameterError if no track can have an alignment, or `fixed`, elements by track, has none of the tracks.
    """
    if fixed and not any(track.track_id in fixed for track in tracks):
        raise ParameterError("FIXED has no elements of the tracks in INPUT: give the table of these tracks.")
    shares = progress.divide([Polyline(track.xyz).length_m + 1.0 for track in tracks])
    fits: list[Fit] = []
    lines = Counter(track.track_id for track in tracks)
    refusals = [_in_pieces(number, count) for number, count in lines.items() if count > 1]
    for track, share in zip(tracks, shares):
        if lines[track.track_id] > 1:
            continue
        progress.status(f"Fitting track {track.track_id}")
        try:
            fits.append(fit_track(track, frame, settings, fixed.get(track.track_id), share))
        except ParameterError as error:
            refusals.append(error)
    if not fits:
        raise refusals[0]
    for refusal in refusals:
        progress.warning(str(refusal))
    return fits


def _in_pieces(track_id: int, count: int) -> ParameterError:
    """Return the refusal of a track of several lines: `s` in its table would begin in each of them."""
    return ParameterError(
        f"Track {track_id} has {count} lines, but its elements follow one: join them, or give each its own track_id."
    )


@dataclass(frozen=True)
class _Plan:
    """The fit in plan, with the noise that was assumed and the noise that is left."""

    chain: Chain
    fit: PlanFit
    points: MeasuredLine
    used_m: float
    noise: Noise


class _LostError(ParameterError):
    """No chain of elements follows a line."""

    def __init__(self, track_id: int) -> None:
        super().__init__(
            f"No chain of elements follows the line of track {track_id}: raise MIN_LENGTH, or smooth the line first."
        )


def _followed(
    track_id: int, measured: Measured, settings: FitParameters, fixed: Optional[Alignment], progress: Progress
) -> tuple[Measured, _Plan]:
    """Return the fit in plan, of the line or of the longest part between strays that elements follow, and that part."""
    if fixed:
        parts = [measured.between(fixed.s_from, fixed.s_to)]
    else:
        parts = [measured.without_stray_ends(), *measured.between_strays()]
    lost: Optional[_LostError] = None
    for part in parts:
        try:
            plan = _fit_in_plan(track_id, part, settings, fixed, progress)
        except _LostError as error:
            lost = lost or error
            continue
        if len(part.along) < len(measured.along):
            why = "No chain of elements follows the whole line" if lost else "Points do not count at an end of the line"
            progress.warning(
                f"{why} of track {track_id}: only the elements from {part.along[0]:.0f} to {part.along[-1]:.0f} m are "
                "given."
            )
        return part, plan
    raise lost or _LostError(track_id)


def _fit_in_plan(
    track_id: int, measured: Measured, settings: FitParameters, fixed: Optional[Alignment], progress: Progress
) -> _Plan:
    """Return the fitted elements in plan."""
    s, y = lateral_signal(measured.xyz[:, :2])
    signal = Signal(s, y, measured.in_plan, PLAN)
    if fixed is None:
        jumps = settings.transitions == JUMPS
        chain, used = find_structure(signal, settings.tolerance_m, settings.min_length_m, jumps, progress)
        given = Given(chain)
    else:
        given = given_of(fixed, float(measured.along[0]), float(s[-1]))
        used = noise_of(signal, settings.tolerance_m, progress)[0]
    used_m = used.effective_m(signal.step_m)
    points = MeasuredLine(measured.xyz[:, :2], s, measured.in_plan / used_m**2)
    try:
        fit = fit_plan(given.chain, points, given.held, progress, given.poses)
        while fixed is None:
            number = _squeezed(fit.elements, settings)
            if number is None:
                break
            given = without(fit.elements, number, float(s[-1]))
            fit = fit_plan(given.chain, points, given.held, progress, given.poses)
    except (FitError, RuntimeError, np.linalg.LinAlgError) as error:
        raise _LostError(track_id) from error
    if not np.isfinite(fit.across).all():
        raise _LostError(track_id)
    return _Plan(given.chain, fit, points, used_m, remaining(fit, points, settings.tolerance_m))


def _squeezed(elements: Sequence[PlanElement], settings: FitParameters) -> Optional[int]:
    """Return the number of an element at an end of the line that the points squeeze out; None if there is none."""
    least_m = SQUEEZED * settings.min_length_m
    ends = {0, len(elements) - 1} if len(elements) > 1 else set()
    return next((number for number in ends if elements[number].length_m < least_m), None)


def _stated(plan: _Plan) -> tuple[PlanElement, ...]:
    """Return the elements with their figures."""
    errors = plan_errors(plan.fit, plan.points, plan.used_m, plan.noise)
    made = []
    for number, one in enumerate(plan.fit.elements):
        rms, largest = off_element(plan.fit, plan.points, number)
        before = plan.fit.elements[number - 1] if number else None
        made.append(
            noted(
                one,
                joint=None if before is None else "G2" if before.k_to == one.k_from else "G1",
                dev_rms_mm=rms,
                dev_max_mm=largest,
                sigma_r_m=float(errors.bend[number] / one.k_from**2) if one.type == "arc" else None,
                sigma_len_m=float(errors.length[number]),
                sigma_s_m=float(errors.s[number]),
            )
        )
    return tuple(made)


def _warn_of_noise(track_id: int, elements: Sequence[PlanElement], progress: Progress) -> None:
    """Say if many arcs can hardly be told from straights."""
    arcs = [one for one in elements if one.type == "arc" and one.figures.sigma_r_m is not None]
    unsure = [one for one in arcs if (one.figures.sigma_r_m or 0.0) * abs(one.k_from) > UNSURE]
    if len(unsure) > max(1.0, MANY * len(arcs)):
        progress.warning(
            f"{len(unsure)} of {len(arcs)} arcs of track {track_id} are near the noise (sigma_r_m is more than a third "
            "of the radius): misalignment may have been taken for design. Raise TOLERANCE, or fit a longer line."
        )


def _holding(
    track_id: int, elements: Sequence[PlanElement], feet: np.ndarray, tolerance_m: float, progress: Progress
) -> tuple[int, int]:
    """Return the first and the last element of the longest part of the fit that holds; warn if it is not the whole."""
    limit_mm = 1000.0 * HOLDS * tolerance_m
    holds = np.array([(one.figures.dev_rms_mm or 0.0) <= limit_mm for one in elements])
    if holds.all():
        return 0, len(elements) - 1
    parts = []
    for first, last in runs(holds):
        start, end = elements[first].s_from, elements[last].s_to
        if np.count_nonzero((feet >= start) & (feet <= end)) >= LEAST_POINTS:
            parts.append((end - start, first, last))
    if not parts:
        raise ParameterError(
            f"The fit of track {track_id} does not hold: every part is off by more than {limit_mm:.0f} mm, three "
            "times TOLERANCE; raise TOLERANCE, or smooth the line first."
        )
    _, first, last = max(parts)
    worst = max(elements, key=lambda one: one.figures.dev_rms_mm or 0.0)
    progress.warning(
        f"The fit of track {track_id} does not hold from {worst.s_from:.0f} to {worst.s_to:.0f} m: the line is off by "
        f"{worst.figures.dev_rms_mm:.0f} mm (root mean square), more than three times TOLERANCE. Only the elements "
        f"from {elements[first].s_from:.0f} to {elements[last].s_to:.0f} m are given, where it holds."
    )
    return first, last


def _with_heights(
    alignment: Alignment,
    feet: np.ndarray,
    measured: Measured,
    settings: FitParameters,
    fixed: Optional[Alignment],
    progress: Progress,
) -> Alignment:
    """Return an alignment with grades and parabolas."""
    signal = _signal(alignment, feet, measured.xyz[:, 2], measured.in_height, HEIGHT)
    shape = fixed.vertical if fixed else ()
    given, used = _structure(alignment.track_id, signal, shape, settings, progress)
    chain = refitted(given.chain, signal, used, settings.min_length_m, given.held)
    chain = replace(chain, start=alignment.s_from, end=alignment.s_to)
    errors = chain_errors(chain, signal, used, given.held)
    return replace(alignment, vertical=heights(chain, signal, used, errors))


def _with_cants(
    alignment: Alignment,
    feet: np.ndarray,
    measured: Measured,
    track: Track,
    settings: FitParameters,
    fixed: Optional[Alignment],
    progress: Progress,
) -> Alignment:
    """Return an alignment with constant cants and ramps, as far as the cant is known."""
    s = np.interp(track.cant[:, 0], measured.along, feet, left=np.nan, right=np.nan)
    counts = ~strays(track.cant[:, 0], track.cant[:, 1], HOLDS * settings.tolerance_m)
    signal = _signal(alignment, s, track.cant[:, 1], counts.astype(float), CANT)
    if len(signal.s) < LEAST_CANT_POINTS:
        return alignment
    shape = fixed.cant if fixed else ()
    given, used = _structure(alignment.track_id, signal, shape, settings, progress)
    chain, errors = on_clothoids(given, alignment.plan, signal, used, settings.min_length_m)
    return replace(alignment, cant=cants(chain, signal, used, errors))


def _signal(alignment: Alignment, s: np.ndarray, values: np.ndarray, share: np.ndarray, kind: SignalKind) -> Signal:
    """Return values along the design, where their points count."""
    inside = np.clip(s, alignment.s_from, alignment.s_to)
    used = (np.abs(s - inside) < AT_END_M) & (share > 0)
    order = np.argsort(inside[used], kind="stable")
    return Signal(inside[used][order], values[used][order], share[used][order], kind)


def _structure(
    track_id: Optional[int], signal: Signal, shape: Sequence[Element], settings: FitParameters, progress: Progress
) -> tuple[Given, Noise]:
    """Return the structure of a signal, found or given, and its noise."""
    if shape:
        return given_along(track_id, shape, signal), noise_of(signal, settings.tolerance_m)[0]
    chain, used = find_structure(signal, settings.tolerance_m, settings.min_length_m, True, progress)
    return Given(chain), used
