"""Changes of the structure of a chain that the search tries: parts and joints that go, change or come."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from .chain import Chain

RAMPS_M = (8.0, 32.0)
"""Lengths of a ramp that replaces a jump, metres; the fit lengthens it."""

SPLITS = (0.2, 0.4, 0.6, 0.8)
"""Where a ramp or a part is divided, as shares of its length."""


def simpler(chain: Chain, m: int, ramps: bool, jumps: bool) -> Iterator[Chain]:
    """Yield chains with as many parameters as a chain or fewer, changed at part `m` or at the joint after it."""
    last = len(chain.bends) - 1
    starts, ends = chain.extents
    if 0 < m < last:
        yield from _joined(chain, m, float(starts[m]), float(ends[m]), ramps, jumps)
    if m < last:
        for curved in {chain.curved[m], chain.curved[m + 1]}:
            yield _united(chain, m, curved)
        if jumps and chain.q[m] > chain.p[m]:
            middle = 0.5 * (chain.p[m] + chain.q[m])
            yield _with_joint(chain, m, middle, middle)
    if chain.curved[m] and ends[m] > starts[m]:
        yield _with_curved(chain, m, False)
    if ramps and 0 < m < last and starts[m] < ends[m]:
        middle = 0.5 * (starts[m] + ends[m])
        if chain.q[m - 1] > chain.p[m - 1] and chain.q[m] > chain.p[m]:
            q, p = chain.q.copy(), chain.p.copy()
            q[m - 1] = p[m] = middle
            yield replace(_with_curved(chain, m, True), p=p, q=q)


def richer(chain: Chain, m: int, ramps: bool, jumps: bool, least_m: float) -> Iterator[Chain]:
    """Yield chains with more parameters, changed at part `m` or at the joint after it."""
    starts, ends = chain.extents
    start, end = float(starts[m]), float(ends[m])
    length = end - start
    if not chain.curved[m]:
        yield _with_curved(chain, m, True)
    if length == 0.0 and 0 < m < len(chain.bends) - 1:
        yield from _widened(chain, m, least_m)
    if m < len(chain.p):
        yield from _richer_joint(chain, m, ramps, least_m)
    for share in SPLITS if length > 3.0 * least_m else ():
        middle = start + share * length
        half = 0.5 * max(least_m, min(0.1 * length, 20.0))
        widths = ([0.0] if jumps else []) + ([half] if ramps else [])
        for width in widths:
            if start + least_m < middle - width and middle + width < end - least_m:
                yield _split(chain, m, [(middle - width, middle + width)])
    if length > 6.0 * least_m:
        for share in (0.3, 0.6):
            a, b = start + (share - 0.1) * length, start + (share + 0.2) * length
            quarter = 0.25 * (b - a) if ramps else 0.0
            yield _split(chain, m, [(a, a + quarter), (b - quarter, b)])


def _richer_joint(chain: Chain, m: int, ramps: bool, least_m: float) -> Iterator[Chain]:
    """Yield chains in which the joint after part `m` has more parameters."""
    starts, ends = chain.extents
    p, q = float(chain.p[m]), float(chain.q[m])
    if not ramps:
        return
    if p == q:
        room = 2.0 * min(p - starts[m], ends[m + 1] - p) - 2.0 * least_m
        for length in (*RAMPS_M, 0.5 * room):
            if least_m < length <= room:
                yield _with_joint(chain, m, p - 0.5 * length, p + 0.5 * length)
        return
    if q - p > 2.0 * least_m:
        for share in SPLITS:
            middle = p + share * (q - p)
            yield _between(chain, m, middle, middle)
    if q - p > 3.0 * least_m:
        third = (q - p) / 3.0
        yield _between(chain, m, p + third, q - third)
    if q - p > 2.0 * least_m:
        middle, half = 0.5 * (p + q), 0.5 * least_m
        yield _with_joint(chain, m, middle - half, middle + half)


def _joined(chain: Chain, m: int, start: float, end: float, ramps: bool, jumps: bool) -> Iterator[Chain]:
    """Yield chains without part `m`, with one ramp or one jump in its place."""
    p, q = np.delete(chain.p, m), np.delete(chain.q, m - 1)
    bends, curved = np.delete(chain.bends, m), (*chain.curved[:m], *chain.curved[m + 1 :])
    shorter = replace(chain, bends=bends, curved=curved, p=p, q=q)
    if ramps and q[m - 1] > p[m - 1]:
        yield shorter
    if jumps:
        middle = 0.5 * (start + end)
        yield _with_joint(shorter, m - 1, middle, middle)


def _united(chain: Chain, m: int, curved: bool) -> Chain:
    """Return a chain in which parts `m` and `m + 1` are one."""
    starts, ends = chain.extents
    weights = np.maximum((ends - starts)[m : m + 2], 1e-3)
    bends = np.delete(chain.bends, m + 1)
    bends[m] = np.average(chain.bends[m : m + 2], weights=weights) if curved else 0.0
    flags = (*chain.curved[:m], curved, *chain.curved[m + 2 :])
    return replace(chain, bends=bends, curved=flags, p=np.delete(chain.p, m), q=np.delete(chain.q, m))


def _with_curved(chain: Chain, m: int, curved: bool) -> Chain:
    bends = chain.bends.copy()
    bends[m] = bends[m] if curved else 0.0
    return replace(chain, bends=bends, curved=(*chain.curved[:m], curved, *chain.curved[m + 1 :]))


def _with_joint(chain: Chain, j: int, p: float, q: float) -> Chain:
    """Return a chain with another joint `j`."""
    ps, qs = chain.p.copy(), chain.q.copy()
    ps[j], qs[j] = p, q
    return replace(chain, p=ps, q=qs)


def _widened(chain: Chain, m: int, least_m: float) -> Iterator[Chain]:
    """Yield chains in which part `m`, which has no length, gets one, as a curve or as a line."""
    middle, half = chain.p[m], 0.6 * least_m
    if middle - half > chain.p[m - 1] + least_m and middle + half < chain.q[m] - least_m:
        p, q = chain.p.copy(), chain.q.copy()
        q[m - 1], p[m] = middle - half, middle + half
        wide = replace(chain, p=p, q=q)
        yield wide
        if chain.curved[m]:
            yield _with_curved(wide, m, False)


def _between(chain: Chain, m: int, start: float, end: float) -> Chain:
    """Return a chain with a further curved part inside the joint after part `m`."""
    p, q = float(chain.p[m]), float(chain.q[m])
    share = (0.5 * (start + end) - p) / (q - p)
    bend = (1.0 - share) * chain.bends[m] + share * chain.bends[m + 1]
    return replace(
        chain,
        bends=np.insert(chain.bends, m + 1, bend),
        curved=(*chain.curved[: m + 1], True, *chain.curved[m + 1 :]),
        p=np.insert(chain.p, m + 1, end),
        q=np.insert(chain.q, m, start),
    )


def _split(chain: Chain, m: int, joints: list[tuple[float, float]]) -> Chain:
    """Return a chain with further joints inside part `m`; the parts between them are curved."""
    count = len(joints)
    return replace(
        chain,
        bends=np.insert(chain.bends, m, np.full(count, chain.bends[m])),
        curved=(*chain.curved[:m], *(True,) * (count + 1), *chain.curved[m + 1 :]),
        p=np.insert(chain.p, m, [p for p, _ in joints]),
        q=np.insert(chain.q, m, [q for _, q in joints]),
    )
