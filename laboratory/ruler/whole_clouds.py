"""A whole raw cloud in memory, classified square by square."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from functools import partial
from itertools import chain
from typing import NamedTuple

import numpy as np

from ...core.classify.settings import MARGIN_M, Settings, Way
from ...core.classify.square import Classified
from ...core.classify.ways import any_sharp, blunt_among, search_alike, searched_alone
from ...core.grow.heads import GrowSettings, OnHeads, Rail
from ...core.labelling.finding import search_square
from ...core.progress import SILENT, Progress
from ...core.rails import SearchFigures
from ...core.run.tasks import Context, Once
from ...core.tiles.grid import Key, Tiling


class Part(NamedTuple):
    """What was found in a square: numbers of rail points in the cloud, (k,), and figures."""

    number: np.ndarray
    figures: SearchFigures


def classify_cloud(
    xyz: np.ndarray,
    settings: Settings,
    progress: Progress = SILENT,
    sources: np.ndarray | None = None,
    of_images: bool = False,
) -> Classified:
    """Find the points on railheads in a cloud of any size, (n, 3), of several sources, (n,) whole numbers, or of one.

    Metres count from the zero of the coordinate system, so that the squares do not depend on how files are cut. With a
    guide, only points near it are given. See `ways.search_alike` for `of_images`.
    """
    rail = np.zeros(len(xyz), dtype=bool)
    figures = SearchFigures()
    own = np.zeros(len(xyz), dtype=int) if sources is None else sources
    context, mixed = Context({}, Once(), progress), False
    around_them = Tiling(settings.side_m, MARGIN_M).sort(xyz)

    def search(some: Sequence[Key], way: Way, which: np.ndarray) -> Iterator[Part]:
        for key in progress.follow(some):
            number = around_them[key][which[around_them[key]]]
            corner = np.array([*np.multiply(key, settings.side_m), 0.0])
            found = search_square(xyz[number] - corner, replace(settings.at(key), way=way), context)
            yield Part(number[found.rail], found.figures.filling if way is Way.BLUNT and mixed else found.figures)

    def seen(some: Sequence[tuple[int, Key]]) -> Iterator[tuple[int, SearchFigures]]:
        for source, key in some:
            yield from ((source, part.figures) for part in search([key], Way.SHARP, own == source))

    def fullest(which: np.ndarray) -> list[Key]:
        keys, square = Tiling(settings.side_m).keys(xyz[which])
        return [keys[place] for place in np.argsort(-np.bincount(square), kind="stable")]

    alone = searched_alone({source: fullest(own == source) for source in np.unique(own).tolist()}, seen)
    blunt = blunt_among(alone)
    mixed = bool(blunt)
    every, filling = np.ones(len(xyz), dtype=bool), np.isin(own, sorted(blunt))
    parts = [search_alike(fullest(every), partial(search, which=every), of_images, any_sharp(alone))]
    if mixed:
        parts = [search(fullest(which), way, which) for way, which in ((Way.SHARP, ~filling), (Way.BLUNT, filling))]
    for part in chain(*parts):
        rail[part.number] = True
        figures += part.figures
    return Classified(rail, figures)


class GrowingCloud:
    """A cloud in memory, (n, 3) metres from the zero of the coordinate system, in which rails grow."""

    def __init__(self, xyz: np.ndarray, settings: GrowSettings) -> None:
        self._squares = Tiling(settings.classification.side_m, MARGIN_M).sort(xyz)
        self._xyz = xyz
        self.heads = OnHeads(lambda key: xyz[self._numbers(key)], settings)

    def _numbers(self, key: Key) -> np.ndarray:
        return self._squares.get(key, np.empty(0, dtype=np.int64))

    def on(self, rails: Sequence[Rail]) -> np.ndarray:
        """Return which points are on rails, (n,) bool."""
        found = np.zeros(len(self._xyz), dtype=bool)
        for key, numbers in self.heads.on(rails):
            found[self._numbers(key)[numbers]] = True
        return found
