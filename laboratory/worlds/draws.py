"""Draws that every part of a world uses."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TypeVar

import numpy as np

One = TypeVar("One")


def stream(seed: int, topic: str) -> np.random.RandomState:
    """Return the random numbers of a topic of a world: a topic that draws more leaves the others as they are."""
    return np.random.RandomState([seed, *topic.encode()])


def chosen(rng: np.random.RandomState, shares: Mapping[One, float]) -> One:
    """Choose a key by its share."""
    keys, share = list(shares), np.array(list(shares.values()))
    return keys[int(np.searchsorted(np.cumsum(share) / share.sum(), rng.random_sample(), side="right"))]


def one_of(rng: np.random.RandomState, values: Sequence[One]) -> One:
    """Choose one of several values, each with the same chance."""
    return values[rng.randint(len(values))]


def maybe(rng: np.random.RandomState, chance: float) -> bool:
    """Return True with this chance."""
    return bool(rng.random_sample() < chance)


def even_in_log(rng: np.random.RandomState, low: float, high: float) -> float:
    """Draw a value whose logarithm is uniformly distributed."""
    return float(np.exp(rng.uniform(np.log(low), np.log(high))))
