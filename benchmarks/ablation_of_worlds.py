"""Switch rules off, one at a time, and count in how many worlds drawn at random each decides over failure.

Run `python benchmarks/ablation_of_worlds.py --from 1 --count 200 --jobs 2 [--kind raw] [RULE ...]`. Each world appends
a line of JSON to `build/ablation/raw.jsonl` or `classified.jsonl`: whether it fails with all rules, and without each of
those that act in it. What the same code has asked a world is not asked again, and counts in the table. McNemar's exact
test says whether the difference is more than chance; further worlds are not asked for a rule for which it is.
"""

from __future__ import annotations

import argparse
import json
import os
import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager
from functools import wraps
from pathlib import Path
from typing import Any
from unittest.mock import patch

from processes import processes
from rail_extract.core import pipeline
from rail_extract.core.pipeline import drawing, sources
from rail_extract.laboratory.ruler.rates import mcnemar
from rail_extract.laboratory.ruler.worlds import run
from rail_extract.laboratory.worlds.world import CLOUDS, VERSION, World, make
from rules import chosen_by, remembering, same, watched, without
from worlds import ROOT, fingerprint, one_thread, written

RESULTS = ROOT / "build" / "ablation"

OF_LINES = ("classify.", "clouds.", "heads.", "lines.", "polyline.", "squares.", "vectorize.")
"""Rules that decide which lines are drawn: a world fails by its lines alone."""

OF_SEARCH = ("classify.", "polyline.")
"""Rules that the search for rail points in a raw cloud follows; without any other one, it is not made again."""

OF_CLEANING = (*OF_SEARCH, "squares.steps.drawn")
"""Rules that decide what the network cleans; without any other one, no square is cleaned again."""

CHANCE = 0.05
"""Chance of a difference by McNemar's test from which on it is more than chance."""

Line = Mapping[str, Any]
"""A line of the file of results.

`asked` are the rules that were switched off in the world, `without` says whether it fails without each that acts.
"""


class Unchanged(BaseException):
    """The lines are the same without a rule, so that the rest of the run need not be made."""


def main() -> None:
    """Ablate worlds and print a row for each rule."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("rules", nargs="*", help="parts of the names of rules; default: all")
    parser.add_argument("--from", type=int, default=1, dest="first", metavar="A", help="first seed (default 1)")
    parser.add_argument("--count", type=int, default=200, metavar="N", help="number of worlds (default 200)")
    parser.add_argument("--jobs", type=int, default=os.cpu_count() or 1, metavar="J", help="processes (default: cores)")
    parser.add_argument("--kind", choices=CLOUDS, action="append", help="kind of cloud (default: both)")
    parser.add_argument("--into", type=Path, default=RESULTS, help="folder of the results (default: build/ablation)")
    arguments = parser.parse_args()
    arguments.into.mkdir(parents=True, exist_ok=True)
    for kind in arguments.kind or CLOUDS:
        names = [switch.name for switch in chosen_by(arguments.rules) if switch.name.startswith(OF_LINES)]
        names = [name for name in names if kind == "raw" or not name.startswith("classify.")]
        seeds = range(arguments.first, arguments.first + arguments.count)
        lines = collect(seeds, kind, names, arguments.into / f"{kind}.jsonl", max(arguments.jobs, 1))
        print(f"\n{kind} clouds", *rows(names, lines), sep="\n")


def collect(seeds: Sequence[int], kind: str, names: Sequence[str], path: Path, jobs: int) -> list[Line]:
    """Ask each world for the rules that it was not asked for yet; returns what is known of all worlds, old ones too.

    Each world that is asked appends a line to the file.
    """
    ours = {"kind": kind, "version": VERSION, "code": fingerprint()}
    known: dict[int, Line] = {}
    for line in written(path):
        if ours.items() <= line.items():
            known[line["seed"]] = _with(known.get(line["seed"]), line)
    with processes(jobs) as pool, path.open("a", encoding="utf-8") as file:
        for start in range(0, len(seeds), jobs):
            wanted = undecided(names, list(known.values()))
            asked = {
                seed: [name for name in wanted if seed not in known or name not in known[seed]["asked"]]
                for seed in seeds[start : start + jobs]
            }
            for line in pool.map(ablate, [(seed, kind, some) for seed, some in asked.items() if some]):
                known[line["seed"]] = _with(known.get(line["seed"]), line)
                file.write(json.dumps({**ours, **line}) + "\n")
                file.flush()
                decided = [name for name, fails in line["without"].items() if fails != line["fails"]]
                words = f"{'fails' if line['fails'] else 'right'}, {', '.join(decided) or 'whatever is off'}"
                print(f"{kind} world {line['seed']}: {words}", file=sys.stderr, flush=True)
    return list(known.values())


def _with(earlier: Line | None, line: Line) -> Line:
    """Add what was asked of a world earlier."""
    if earlier is None:
        return line
    return {
        **line,
        "asked": [*earlier["asked"], *line["asked"]],
        "without": {**earlier["without"], **line["without"]},
    }


def ablate(task: tuple[int, str, Sequence[str]]) -> dict[str, Any]:
    """Extract a world with all rules, and without each of those that have an effect in it; a task of a worker."""
    seed, kind, names = task
    one_thread()
    world = make(seed, kind)
    chosen = [switch for switch in chosen_by(()) if switch.name in names]
    effective: set[str] = set()
    with ExitStack() as stack:
        search = stack.enter_context(_kept(sources, "find_rail_points", _listing))
        clean = stack.enter_context(_kept(drawing, "clean_square", remembering))
        draw, rails = pipeline.drawn, []
        stack.enter_context(patch.object(pipeline, "drawn", _noting(draw, rails)))
        with watched(chosen, effective):
            fails = bool(run(world).faults)
        stack.enter_context(patch.object(pipeline, "drawn", _stopping(draw, rails)))
        fails_without = {}
        for switch in (switch for switch in chosen if switch.name in effective):
            with ExitStack() as again:
                if switch.name.startswith(OF_SEARCH):
                    again.enter_context(patch.object(sources, "find_rail_points", search))
                if switch.name.startswith(OF_CLEANING):
                    again.enter_context(patch.object(drawing, "clean_square", clean))
                again.enter_context(without(switch))
                outcome = _outcome(world)
            if outcome is not None:
                fails_without[switch.name] = outcome
    return {"seed": seed, "fails": fails, "asked": list(names), "without": fails_without}


def _outcome(world: World) -> bool | None:
    """Return whether a world fails, or None if its lines are what they are with all rules."""
    try:
        return bool(run(world).faults)
    except Unchanged:
        return None


def _noting(draw: Callable, rails: list) -> Callable:
    """Wrap the drawing of lines, so that these are noted."""

    @wraps(draw)
    def wrapped(*arguments: Any) -> Any:
        result = draw(*arguments)
        rails.append(result[0].rails)
        return result

    return wrapped


def _stopping(draw: Callable, rails: Sequence) -> Callable:
    """Wrap the drawing of lines, so that the run stops where they are those of the list."""

    @wraps(draw)
    def wrapped(*arguments: Any) -> Any:
        result = draw(*arguments)
        if rails and same(result[0].rails, rails[0]):
            raise Unchanged
        return result

    return wrapped


@contextmanager
def _kept(module: Any, name: str, keeping: Callable[[Callable], Callable]) -> Iterator[Callable]:
    """Keep the results of a function; yields the function that computes them each time."""
    function = getattr(module, name)
    with patch.object(module, name, keeping(function)):
        yield function


def _listing(search: Callable) -> Callable:
    """Wrap the search for rail points, so that it is made once."""
    results: list[list] = []

    @wraps(search)
    def wrapped(*arguments: Any) -> list:
        if not results:
            results.append(list(search(*arguments)))
        return results[0]

    return wrapped


def undecided(names: Sequence[str], lines: Sequence[Line]) -> list[str]:
    """Return the rules that are not known to be needed, or to be worse than nothing, by more than chance."""
    return [name for name in names if _counts(name, lines)[-1] > CHANCE]


def _counts(name: str, lines: Sequence[Line]) -> tuple[int, int, int, int, float]:
    """Count the worlds that were asked for a rule, in which it acts, and that fail without or with it alone.

    Also returns the chance of such a difference.
    """
    asked = [line for line in lines if name in line["asked"]]
    acts = sum(name in line["without"] for line in asked)
    after = [line["without"].get(name, line["fails"]) for line in asked]
    return len(asked), acts, *mcnemar(after, [line["fails"] for line in asked])


def rows(names: Sequence[str], lines: Sequence[Line]) -> Iterator[str]:
    """Yield the table of rules."""
    yield f"{len(lines)} worlds, {sum(line['fails'] for line in lines)} fail with all rules."
    yield "| rule | asked | acts in | fail without it alone | fail with it alone | chance |\n|---|---|---|---|---|---|"
    for name in names:
        asked, acts, worse, better, chance = _counts(name, lines)
        yield f"| `{name}` | {asked} | {acts} | {worse} | {better} | {chance:.3f} |"


if __name__ == "__main__":
    main()
