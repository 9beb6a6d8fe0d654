"""Passes of the scanner: which points were scanned in one go, by the source ids and the GPS times of points.

Many clouds hold several passes without an id for each. Points at one place whose times differ by more than a minute are
of different passes. See docs/method.md section 6.6.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

SLOT_S = 30.0
"""Length of the slots of time that points are sorted into: a place is scanned in seconds, by hand in a minute."""

SAME_PASS_SLOTS = 2
"""Largest difference of slots within a pass at a place: a minute, more or less by half."""

SLOT_BITS, SLOTS = 16, 1 << 16
"""Slots are numbered modulo this: passes 23 days apart to the half minute would be taken for one."""

MAX_NUMBERS, MIN_IN_SLOT = 100, 100
"""Most source ids in a chunk, above which they number something else, such as profiles; and most slots, above which
they are none if they hold fewer points than this on average: the times of some clouds count points or microseconds."""


def marks_of(source_ids: np.ndarray, file_source_id: int, gps_time: np.ndarray | None) -> np.ndarray:
    """Mark points by their source id in the upper 16 bits and their slot of time in the lower ones, (n,) uint32.

    0 stands for what the file does not state; by the LAS specification, source id 0 stands for that of the file.
    """
    if source_ids.any() and np.count_nonzero(np.bincount(source_ids)) > MAX_NUMBERS:  # quicker than sorting them
        ids = np.zeros(len(source_ids), dtype=np.uint32)
    else:
        ids = np.where(source_ids == 0, file_source_id, source_ids).astype(np.uint32)
    return ids << SLOT_BITS | _slots(gps_time, len(ids))


def sources_of(marks: np.ndarray) -> np.ndarray:
    """Tell scanners and cameras apart by the marks of points, (n,): whole numbers, alike for points of one source.

    They differ where the source ids differ; of points with the same id, those without times are of another source, as
    images have none.
    """
    return marks.astype(np.int64) >> SLOT_BITS << 1 | ((marks & (SLOTS - 1)) > 0)


def _slots(gps_time: np.ndarray | None, count: int) -> np.ndarray:
    """Sort times into slots, (n,) uint32; all 0 if they count something else."""
    if gps_time is None or not gps_time.any():
        return np.zeros(count, dtype=np.uint32)
    slots = np.mod(np.floor(np.where(np.isfinite(gps_time), gps_time, 0.0) / SLOT_S), SLOTS).astype(np.uint32)
    used = np.count_nonzero(np.bincount(slots))
    return slots if used <= MAX_NUMBERS or used * MIN_IN_SLOT <= count else np.zeros(count, dtype=np.uint32)


def number_passes(marks: np.ndarray, places: np.ndarray) -> dict[int, int]:
    """Find the passes of a cloud and number them, below 2¹⁶, by mark, as of `marks_of`.

    A pass of one source id goes on from slot to slot, and ends where time is missing or where it comes back to a place
    that it has left. Where every source id is one pass, its number is the id; else passes are numbered in the order of
    their times. `places`, (m, 2), are squares some tens of metres wide that hold points with these marks.

    Examples
    --------
    The scanner of source id 7 passes two places and returns to both after minutes:

    >>> marks = np.array([[10, 20], [10, 21], [30, 20], [30, 21]]) @ [1, 0] + (7 << 16)
    >>> sorted(number_passes(marks, np.array([[0, 0], [1, 0], [0, 0], [1, 0]])).values())
    [1, 2]
    """
    passes = sorted(_passes(marks, places), key=lambda one: (one[0] % SLOTS, one[0]))
    ids = [one[0] >> SLOT_BITS for one in passes]
    numbers = ids if len(set(ids)) == len(ids) else range(1, len(ids) + 1)
    return {mark: number for one, number in zip(passes, numbers) for mark in one}


def _passes(marks: np.ndarray, places: np.ndarray) -> Iterator[list[int]]:
    """Yield the marks of each pass in the order of their times."""
    rows = np.unique(np.column_stack([marks.astype(np.int64), places]), axis=0)
    found, first = np.unique(rows[:, 0], return_index=True)
    own: list[int] = []
    left: dict[tuple[int, ...], int] = {}
    for mark, visited in zip(found.tolist(), np.split(rows[:, 1:], first[1:])):
        keys = [tuple(place) for place in visited.tolist()]
        goes_on = bool(own) and mark >> SLOT_BITS == own[-1] >> SLOT_BITS and mark - own[-1] <= SAME_PASS_SLOTS
        if not goes_on or any(mark - left.get(key, mark) > SAME_PASS_SLOTS for key in keys):
            if own:
                yield own
            own, left = [], {}
        own.append(mark)
        left.update(dict.fromkeys(keys, mark))
    if own:
        yield own
