"""The way in which a cloud is searched: one for all of it, because it follows from the scanner and the railway.

Rails are the only things of known width. A cloud that shows some of them as narrow as their heads is sharp, unless
round ones are several times as long, and one that shows round ones only is blunt. One that shows hardly any that stand
clear of their bed has tracks that are filled with ballast up to the heads, or no tracks. Of several sources, scanners
and cameras, each is sharp or blunt (docs/classification.md).
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from typing import Protocol, TypeVar

from ..rails import SearchFigures
from .settings import Way

SHARP_M = 20.0
"""Length of rails as narrow as their heads that shows a cloud to be sharp, unless it is certainly blunt. Measured: less
than 2 m of a drone survey's 770 m, a scanner's weeds and mixed pixels widen single metres. The
search for heads just above the ballast counts if it finds as much more."""

BLUNT_M = 100.0
"""Length of round rails that shows a cloud without these to be blunt; the rest of it need not be seen."""

CLEAR = 5.0
"""How much longer narrow rails are than round ones in a source that is certainly sharp, and round ones than narrow ones
in a cloud or source that is certainly blunt. Passes of one wide beam from the air showed 33 m narrow and 35 m round,
and 0 and 110 m; a scanner on a train 243 and 0 m, and images of the same rails 0 and 239 m; sharp images of a track on
slabs 33 and 266 m."""

FOUND_AGAIN = 0.75
"""Share of the rails of a cloud that seems blunt which its search as such finds again at least: they are ridges of a
smooth surface. Measured: all and more in images, none of 265 m in the points of a thin, wide beam, and half of 389 m
where passes of a scanner are 2 cm apart and widen heads together."""

MOSTLY_CLEAR = 0.75
"""Least share of the rails of a cloud that stand clear of their bed where no track is filled. Measured on 43 random
clouds: 0.89 and more in 36, 0.76 and 0.81 in two, and at most 0.57 in five whose tracks are filled in places."""

FIRST_PARTS = 4
"""Parts of a cloud that are searched first to find out; then as many again as were searched, until enough rails are
seen."""

MOST_PARTS = 16
"""Parts in which a source is looked at alone: one that is not decided where it has most points is not certain."""

Part = TypeVar("Part")


class HasFigures(Protocol):
    """What was found in a part of a cloud."""

    @property
    def figures(self) -> SearchFigures:
        """Its figures."""


Answer = TypeVar("Answer", bound=HasFigures)


def is_blunt(seen: SearchFigures) -> bool:
    """Return whether a cloud is blunt, by the sum of the figures of parts that were searched as if it were sharp."""
    return seen.sharp_m < min(SHARP_M, _round_m(seen)) or _is_certainly_blunt(seen)


def is_decided(seen: SearchFigures) -> bool:
    """Return whether further parts would not change that."""
    return seen.sharp_m >= SHARP_M or _round_m(seen) >= BLUNT_M


def shows_clear(seen: SearchFigures) -> bool:
    """Return whether rails that stand clear of their bed, or round ones, show that the tracks are not filled."""
    return seen.clear_m >= max(SHARP_M, MOSTLY_CLEAR * length_m(seen)) or _round_m(seen) >= BLUNT_M


def _round_m(seen: SearchFigures) -> float:
    """Return the length of round rails that those which are neither narrow nor round do not outweigh.

    These are rather those of a sharp cloud. But images of smooth ground showed 29 m of rails in pavements, by chance.
    """
    return seen.round_m - seen.unsure_m


def blunt_among(seen: Mapping[int, SearchFigures]) -> frozenset[int]:
    """Return the sources of a cloud that are blunt while others are sharp, by the figures of each.

    There are none unless both kinds show enough rails to be certain: a cloud of one kind is left as it is.
    """
    if not any_sharp(seen):
        return frozenset()
    return frozenset(one for one, figures in seen.items() if _is_certainly_blunt(figures))


def any_sharp(seen: Mapping[int, SearchFigures]) -> bool:
    """Return whether a source of a cloud is certainly sharp, by the figures of each that was searched alone."""
    return any(figures.sharp_m >= max(SHARP_M, CLEAR * figures.round_m) for figures in seen.values())


def _is_certainly_blunt(seen: SearchFigures) -> bool:
    """Return whether round rails are many, and several times as long as narrow ones: a few of a blunt cloud are."""
    return _round_m(seen) >= max(BLUNT_M, CLEAR * seen.sharp_m)


def searched_alone(
    parts: Mapping[int, Sequence[Part]],
    search: Callable[[Sequence[tuple[int, Part]]], Iterable[tuple[int, SearchFigures]]],
) -> dict[int, SearchFigures]:
    """Search some parts of a cloud for the rails of each of its sources alone, and return their figures.

    Given are the parts in which each source has points, those with most of them first. `search` searches parts for the
    rails of one source each, as if it were sharp, and yields the source and its figures. A single source is not
    searched: it is the cloud.
    """
    seen = dict.fromkeys(parts, SearchFigures())
    done, step = 0, 1
    while len(parts) > 1 and done < MOST_PARTS:
        batch = [
            (one, part) for one, own in parts.items() if not is_decided(seen[one]) for part in own[done : done + step]
        ]
        if not batch:
            break
        for one, figures in search(batch):
            seen[one] += figures
        done, step = done + step, done + step
    return seen


def length_m(seen: SearchFigures) -> float:
    """Return the length of the rails of a cloud, by the sum of the figures of its parts."""
    return seen.paired_m + seen.single_m


def _figures_of(answers: Iterable[HasFigures]) -> SearchFigures:
    """Return the sum of the figures of some parts."""
    return sum((answer.figures for answer in answers), SearchFigures())


def search_alike(
    parts: Sequence[Part],
    search: Callable[[Sequence[Part], Way], Iterable[Answer]],
    of_images: bool = False,
    is_sharp: bool = False,
) -> Iterator[Answer]:
    """Search all parts of a cloud, those that show most first, in the way that suits it.

    A cloud of which a source is known to be sharp, `is_sharp`, is not blunt, although passes that are apart look round
    together. Nor do a few metres of ridges show that a cloud is blunt: it may be filled. `of_images` says that nothing
    shows that a scanner measured the points. Heads that hardly stand out of their bed are then searched for as ridges
    first: those of images have no edges, and what looks like one is a flank.
    """
    found: list[Answer] = []
    done = 0  # number of parts that were searched; one that failed has no answer

    def seen_until(enough: Callable[[SearchFigures], bool]) -> SearchFigures:
        nonlocal done
        seen = _figures_of(found)
        while done < len(parts) and not enough(seen):
            batch = parts[done : done + max(done, FIRST_PARTS)]
            found.extend(search(batch, Way.SHARP))
            done += len(batch)
            seen = _figures_of(found)
        return seen

    seen, blunt, unless_filled = seen_until(is_decided), list[Answer](), found
    looked = 0 if is_sharp or not is_blunt(seen) else done
    if looked:
        blunt += search(parts[:looked], Way.BLUNT)
        again_m = length_m(_figures_of(blunt))
        shows_ridges = seen.paired_m <= max(again_m / FOUND_AGAIN, SHARP_M)
        if shows_ridges and again_m >= SHARP_M:
            yield from blunt
            yield from search(parts[looked:], Way.BLUNT)
            return
        unless_filled = blunt if shows_ridges else found
    seen = seen_until(shows_clear)
    if shows_clear(seen):
        yield from found
        yield from search(parts[done:], Way.SHARP)
        return
    if of_images:
        blunt += search(parts[looked:], Way.BLUNT)
        if length_m(_figures_of(blunt)) >= max(FOUND_AGAIN * length_m(seen), SHARP_M):
            yield from blunt
            return
    filled = list(search(parts, Way.FILLED))
    yield from filled if length_m(_figures_of(filled)) > length_m(seen) + SHARP_M else unless_filled
