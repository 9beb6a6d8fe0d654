"""The tables of accuracy as text: completeness and errors."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np

from .lines import Match
from .measuring import Result

TOLERANCES_M = (0.01, 0.02, 0.05, 0.10)
JUDGED_M = 0.05
"""Tolerance of the errors."""


def found_table(results: Sequence[Result]) -> str:
    """Return completeness and correctness at each tolerance, lengths, numbers of lines, time and memory."""
    centimetres = "".join(f"{100 * tolerance:>7.0f}" for tolerance in TOLERANCES_M)
    lines = [
        "Found: share of the true length with a line within 1, 2, 5 and 10 cm.",
        "Right: share of the length of the lines with a true line within the same distances.",
        f"{'':<27}{'found %':>28}{'right %':>28}  length",
        f"{'scene':<13}{'lines of':<14}{centimetres}{centimetres}  : true {'lines':>8}{'s':>8}{'MiB':>7}",
    ]
    for result in results:
        lines.append(_found(result.scene, "rails", result.rails) + f"{result.seconds:>8.1f}{result.peak_mib:>7.0f}")
        lines.append(_found("", "centerlines", result.centerlines))
        lines.append(_found("", "plain script", result.script) + f"{result.script_seconds:>8.1f}")
    return "\n".join(lines)


def error_table(results: Sequence[Result]) -> str:
    """Return errors across and in height, of gauge, cant and radius, and the shares within the standard error."""
    lines = [
        "Errors within 5 cm, in millimetres, the larger of those along truth and lines. Measured: track geometry.",
        f"{'':<27}{'across':>18}{'height':>18}{'within':>12}{'gauge':>12}{'cant':>12}{'measured rms':>18}{'w/':>9}",
        f"{'scene':<13}{'lines of':<14}" + 2 * f"{'rms':>6}{'p95':>6}{'bias':>6}" + f"{'sigma':>6}{'2 s.':>6}"
        f"{'bias':>6}{'rms':>6}" + f"{'bias':>6}{'rms':>6}" + f"{'gauge':>6}{'cant':>6}{'rad.':>6}{'sqrt 12n':>9}",
    ]
    for result in results:
        tracks = result.tracks
        lines.append(
            _errors(result.scene, "rails", result.rails)
            + f"{100 * result.within_sigma:>5.0f}%{100 * result.within_two_sigma:>5.0f}%{'':>42}"
            f"{1000 * result.mean_error_m:>9.1f}"
        )
        gauge_and_cant = tracks.gauge_bias_m, tracks.gauge_rmse_m, tracks.cant_bias_m, tracks.cant_rmse_m
        measured = result.geometry
        lines.append(
            _errors("", "centerlines", result.centerlines)
            + f"{'':>12}"
            + _millimetres((*gauge_and_cant, measured.gauge_m, measured.cant_m))
            + (f"{100 * measured.radius:>5.1f}%" if np.isfinite(measured.radius) else f"{'-':>6}")
        )
        lines.append(_errors("", "plain script", result.script))
    return "\n".join(lines)


def _found(scene: str, lines: str, found: Match) -> str:
    by_tolerance = [found.within(tolerance) for tolerance in TOLERANCES_M]
    judged = by_tolerance[TOLERANCES_M.index(JUDGED_M)]
    shares = [one.completeness for one in by_tolerance] + [one.correctness for one in by_tolerance]
    return (
        f"{scene:<13}{lines:<14}" + "".join(f"{100 * share:>7.2f}" for share in shares) + f"{judged.length_ratio:>8.3f}"
        f"{f'{judged.line_count}:{judged.truth_count}':>8}"
    )


def _errors(scene: str, lines: str, found: Match) -> str:
    judged = found.within(JUDGED_M)
    return f"{scene:<13}{lines:<14}" + _millimetres(
        (
            judged.lateral_rmse_m,
            judged.lateral_p95_m,
            judged.lateral_bias_m,
            judged.height_rmse_m,
            judged.height_p95_m,
            judged.height_bias_m,
        )
    )


def _millimetres(values_m: Iterable[float]) -> str:
    return "".join(f"{1000 * value:>6.1f}" if np.isfinite(value) else f"{'-':>6}" for value in values_m)
