"""How well a fitted alignment meets the design that a track was made from."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from typing import Any, Optional, TypeVar

import numpy as np
from scipy.special import erf

from ...core.alignment.elements import Alignment, Element, PlanElement, VerticalElement
from ...core.alignment.fit import fit_track
from ...core.alignment.layouts import given_of, noted, plan_errors
from ...core.alignment.noise import Noise
from ...core.alignment.plane_fit import MeasuredLine, fit_plan
from ...core.errors import ParameterError
from ...core.polyline import Polyline
from ...core.progress import SILENT, Recording
from ..designs import TrackScene

SIZES, TINY = 100_000, 1e-9
"""Number of sizes of an error that are tried, and least standard deviation, metres."""

Some = TypeVar("Some", bound=Element)

LEAST_SAGITTA_M = 0.005
"""Parabolas that bend the track by less are not looked for, metres."""

NEAR_M = 5.0
"""Tangent points farther from a true one are not compared with it by their standard error, metres."""


@dataclass(frozen=True)
class Met:
    """What was found of one or several designs.

    Attributes
    ----------
    true, found, fitted : int
        Elements in plan: of the design, those of it that were found, and those of the fit. An element is found if one
        of the same type overlaps more than half of both.
    radius : (n,) array
        Errors of the radii of found arcs, as shares.
    ends_m : (k,) array
        Distances of the ends of found elements from the true ones.
    radius_scores, start_scores : (n,) array
        Errors of radii and of tangent points in units of their stated standard errors.
    curve_m : (m,) array
        Distances of the fitted curve from the true one, by the metre.
    curves_true, curves_found : int
        Parabolas that bend the track by more than `LEAST_SAGITTA_M`.
    ramps_true, ramps_found : int
        Ramps of cant.
    ramp_ends_m : (r,) array
    """

    true: int
    found: int
    fitted: int
    radius: np.ndarray
    ends_m: np.ndarray
    radius_scores: np.ndarray
    start_scores: np.ndarray
    curve_m: np.ndarray
    curves_true: int
    curves_found: int
    ramps_true: int
    ramps_found: int
    ramp_ends_m: np.ndarray


@dataclass(frozen=True)
class Bound:
    """Least standard errors that any fit can have which is given the types of the elements (Cramér and Rao).

    Those of radii of arcs are shares; those of the ends of elements are in metres, in the order of `Met.ends_m` if all
    are found.
    """

    radius: np.ndarray
    ends_m: np.ndarray


def bound_of(design: Alignment, line: np.ndarray, white_m: float) -> Bound:
    """Return the least standard errors for a design: the inverse of the information at the true elements.

    `line`, (n, 3), has vertices on the design without errors; `white_m` is the standard deviation of independent errors
    across.
    """
    s = Polyline(line).t
    given = given_of(replace(design, plan=tuple(map(noted, design.plan))), 0.0, float(s[-1]))
    points = MeasuredLine(line[:, :2], s, np.full(len(s), 1.0 / white_m**2))
    fit = fit_plan(given.chain, points, given.held, poses=given.poses)
    errors = plan_errors(fit, points, white_m, Noise(white_m))
    arcs = np.array([one.type == "arc" for one in fit.elements])
    bends = np.array([one.k_from for one in fit.elements])
    ends_m = np.column_stack([errors.s, np.append(errors.s[1:], 0.0)]).ravel()
    return Bound(errors.bend[arcs] / np.abs(bends[arcs]), ends_m)


def quantiles(sigmas: np.ndarray, shares: Sequence[float]) -> np.ndarray:
    """Return quantiles of the size of normal errors with standard deviations, (n,), all of them taken together."""
    sizes = np.linspace(0.0, 5.0 * sigmas.max(), SIZES)
    below = np.array([np.mean(erf(size / (np.maximum(sigmas, TINY) * np.sqrt(2.0)))) for size in sizes])
    return np.interp(shares, below, sizes)


def compared(design: Alignment, fit: Alignment) -> Met:
    """Compare a fit with the design."""
    pairs = [(one, partner(one, fit.plan)) for one in design.plan]
    found = [(one, match) for one, match in pairs if match is not None]
    arcs = [
        (1.0 / one.k_from, 1.0 / match.k_from, match.figures.sigma_r_m) for one, match in found if one.type == "arc"
    ]
    s = np.arange(1.0, min(design.s_to, fit.s_to) - 1.0)
    bends = [one for one in design.vertical if one.type == "parabola" and _sagitta(one) > LEAST_SAGITTA_M]
    ramps = [(one, partner(one, fit.cant)) for one in design.cant if one.type == "ramp"]
    return Met(
        len(pairs),
        len(found),
        len(fit.plan),
        np.array([abs(fitted / true - 1.0) for true, fitted, _ in arcs]),
        _ends(found),
        np.array([(fitted - true) / sigma for true, fitted, sigma in arcs if sigma]),
        np.array(list(_start_scores(design.plan, fit.plan))),
        fit.foot(design.places(s)).across_m,
        len(bends),
        sum(partner(one, fit.vertical) is not None for one in bends),
        len(ramps),
        sum(match is not None for _, match in ramps),
        _ends([(one, match) for one, match in ramps if match is not None]),
    )


def together(parts: Sequence[Met]) -> Met:
    """Return several comparisons as one."""
    values: list[list[Any]] = [[getattr(part, name) for part in parts] for name in Met.__dataclass_fields__]
    joined: list[Any] = [np.concatenate(one) if isinstance(one[0], np.ndarray) else sum(one) for one in values]
    return Met(*joined)


def partner(one: Some, fitted: Iterable[Some]) -> Optional[Some]:
    """Return the element of the same type that overlaps more than half of both, or None."""
    for other in fitted:
        common = min(one.s_to, other.s_to) - max(one.s_from, other.s_from)
        if other.type == one.type and common > 0.5 * max(one.length_m, other.length_m):
            return other
    return None


def _sagitta(one: VerticalElement) -> float:
    return one.length_m**2 * abs(one.curvature) / 8.0


def _ends(pairs: Sequence[tuple[Element, Element]]) -> np.ndarray:
    """Return the distances between the ends of pairs."""
    return np.array([abs(a - b) for one, two in pairs for a, b in ((one.s_from, two.s_from), (one.s_to, two.s_to))])


def _start_scores(true: Sequence[PlanElement], fitted: Sequence[PlanElement]) -> Iterable[float]:
    """Yield the errors of tangent points in units of their standard errors."""
    for one in true[1:]:
        nearest = min(fitted, key=lambda other: abs(other.s_from - one.s_from))
        error = nearest.s_from - one.s_from
        if nearest.figures.sigma_s_m and abs(error) < NEAR_M:
            yield error / nearest.figures.sigma_s_m


def fit_figures(scene: TrackScene) -> dict[str, float]:
    """Fit an alignment to a scene, and measure it.

    `found %` is the share of the true elements that were found, `elements` the number of those that were fitted;
    `radius %` and `ends m` are median errors of radii and of ends; `curve mm` is the distance of the curve from the
    true one (rms); `in sigmas`, errors of tangent points in units of their standard errors (rms); `curves`, `ramps` and
    `ramp m`, parabolas and ramps of cant that were found, and the median error of their ends; `off mm`, the distance of
    the points from the curve (rms); `round`, radii whose proposal is the true one; `said`, the number of warnings.
    Where the track is refused, nothing is found and one thing is said.
    """
    heard = Recording(SILENT)
    try:
        fit = fit_track(scene.track, scene.design.frame, scene.settings, scene.fixed, heard)
    except ParameterError:
        return {"found %": 0.0, "said": 1}
    met = compared(scene.design, fit.alignment)
    true = {round(1.0 / one.k_from) for one in scene.design.plan if one.type == "arc"}
    return {
        "found %": 100.0 * met.found / met.true,
        "elements": met.fitted,
        "radius %": 100.0 * _median(met.radius),
        "ends m": _median(met.ends_m),
        "curve mm": 1000.0 * _rms(met.curve_m),
        "in sigmas": _rms(met.start_scores),
        "curves": met.curves_found,
        "ramps": met.ramps_found,
        "ramp m": _median(met.ramp_ends_m),
        "off mm": fit.rms_mm,
        "round": sum(one.figures.r_round_m in true for one in fit.alignment.plan),
        "said": len(heard.warnings),
    }


def _median(values: np.ndarray) -> float:
    return float(np.median(values)) if len(values) else np.nan


def _rms(values: np.ndarray) -> float:
    return float(np.sqrt(np.mean(values**2))) if len(values) else np.nan
