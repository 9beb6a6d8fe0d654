"""Rates of failure in many worlds, with their bounds, and the calibration of standard errors."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Any

import numpy as np
from scipy.stats import beta, binomtest

Line = Mapping[str, Any]
"""What is known of a world: a line of the JSON file."""

SHOWN_SEEDS = 12
"""Seeds that are printed for each cause."""

WITHIN = {1: (60.0, 80.0), 2: (92.0, 99.0)}
"""Shares of the errors, in percent, that are expected within the standard error and within twice it."""


def bounds(count: int, of: int, confidence: float = 0.95) -> tuple[float, float]:
    """Return the bounds of a rate by Clopper and Pearson, which hold for any number of worlds.

    >>> low, high = bounds(4, 100)
    >>> round(low, 4), round(high, 4)
    (0.011, 0.0993)
    >>> round(bounds(0, 500)[1], 4)
    0.0074
    """
    outside = (1 - confidence) / 2
    low = 0.0 if count == 0 else float(beta.ppf(outside, count, of - count + 1))
    high = 1.0 if count == of else float(beta.ppf(1 - outside, count + 1, of - count))
    return low, high


def mcnemar(first: Sequence[bool], second: Sequence[bool]) -> tuple[int, int, float]:
    """Compare failures of the same worlds in two ways, by McNemar's exact test.

    Returns the worlds that fail in the first way alone, those in the second alone, and the chance of a difference at
    least as large if neither way is better.

    >>> mcnemar([True] * 8 + [False] * 2, [False] * 10)
    (8, 0, 0.0078125)
    >>> mcnemar([True, False], [True, False])
    (0, 0, 1.0)
    """
    one = sum(a and not b for a, b in zip(first, second))
    other = sum(b and not a for a, b in zip(first, second))
    chance = 1.0 if one + other == 0 else float(binomtest(one, one + other).pvalue)
    return one, other, chance


def is_silent(line: Line) -> bool:
    """Return whether a world fails without a word."""
    return any(fault["silent"] for fault in line["faults"])


def summary(lines: Sequence[Line]) -> Iterator[str]:
    """Yield the lines of text that sum up worlds of one kind of cloud."""
    if not lines:
        yield "No worlds."
        return
    failed = [line for line in lines if line["faults"]]
    silent = [line for line in failed if is_silent(line)]
    seeds = sorted(line["seed"] for line in lines)
    seconds = np.mean([line["seconds"] for line in lines])
    yield f"{len(lines)} worlds, seeds {seeds[0]} to {seeds[-1]}; {seconds:.1f} s each"
    for name, some in (("fail", failed), ("fail silently", silent)):
        low, high = bounds(len(some), len(lines))
        yield (
            f"{name + ':':<15}{len(some):>5} of {len(lines)}, {100 * len(some) / len(lines):.1f} %"
            f" (95 % bounds {100 * low:.1f} to {100 * high:.1f} %)"
        )
    yield ""
    yield from causes(failed)
    yield ""
    for name in ("survey", "layout"):
        yield from by_group(lines, name)
        yield ""
    yield from calibration(lines)


def causes(failed: Sequence[Line]) -> Iterator[str]:
    """Yield a row for each cause with the seeds of its worlds; silent ones first, with an exclamation mark."""
    by_cause: dict[str, list[Line]] = defaultdict(list)
    for line in failed:
        for fault in line["faults"]:
            by_cause[fault["cause"]].append(line)
    yield f"{'cause':<22}{'worlds':>7}{'alone':>7}  seeds (! silent)"
    for cause, some in sorted(by_cause.items(), key=lambda item: -len(item[1])):
        alone = sum(len(line["faults"]) == 1 for line in some)
        marked = sorted((not is_silent(line), line["seed"]) for line in some)
        seeds = " ".join(f"{seed}{'' if loud else '!'}" for loud, seed in marked[:SHOWN_SEEDS])
        more = f" and {len(marked) - SHOWN_SEEDS} more" if len(marked) > SHOWN_SEEDS else ""
        yield f"{cause:<22}{len(some):>7}{alone:>7}  {seeds}{more}"


def by_group(lines: Sequence[Line], name: str) -> Iterator[str]:
    """Yield a row for each kind of survey, or of layout: failures, and quantiles of the errors of its worlds, in mm."""
    yield f"{'':<12}{'':>7}{'':>6}{'':>8}{'across, mm':>26}{'height, mm':>26}"
    yield f"{name:<12}{'worlds':>7}{'fail':>6}{'silent':>8}" + 2 * f"{'median':>12}{'90 %':>7}{'99 %':>7}"
    groups: dict[str, list[Line]] = defaultdict(list)
    for line in lines:
        groups[line["world"][name]].append(line)
    for group, some in sorted(groups.items()):
        failed, silent = sum(bool(one["faults"]) for one in some), sum(map(is_silent, some))
        cells = [f"{group:<12}{len(some):>7}{failed:>6}{silent:>8}"]
        for figure in ("across mm", "height mm"):
            values = [one[figure] for one in some if one.get(figure) is not None]
            middle, high, highest = np.percentile(values, (50, 90, 99)) if values else [np.nan] * 3
            cells.append(f"{middle:>12.2f}{high:>7.2f}{highest:>7.2f}")
        yield "".join(cells)


def calibration(lines: Iterable[Line]) -> Iterator[str]:
    """Yield the shares of the errors within the standard error and within twice it, over the length of all lines."""
    parts = [line["within"] for line in lines if "within" in line]
    length_m = sum(part["n m"] for part in parts)
    if not length_m:
        return
    for direction in ("across", "height"):
        shares = {times: 100 * sum(part[f"{direction} {times}"] for part in parts) / length_m for times in WITHIN}
        words = [
            f"{share:.1f} % within {name} (expected {WITHIN[times][0]:g} to {WITHIN[times][1]:g})"
            for (times, share), name in zip(shares.items(), ("the standard error", "twice it"))
        ]
        yield f"{direction}: {', '.join(words)}"
