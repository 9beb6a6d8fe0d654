"""Let two runs write one output at once: one output is then whole, and the other run says that it was not written.

`. build/environment.sh; .venv/bin/python tools/races.py 20` lets twenty pairs write each format, with and without an
older file. Both runs have checked their output before either writes it, so that each believes it to be its own.
"""

from __future__ import annotations

import argparse
import os
import random
import sys
import tempfile
import time
from collections import Counter
from functools import partial
from pathlib import Path

from kills import FORMATS, elsewhere, raw_tiles, start_qgis, versions
from rail_extract.core.disk import Destination
from rail_extract.core.errors import RailExtractError

MAX_DELAY_S = 0.05
"""Longest time by which one of two runs begins to write before the other."""

WROTE, REFUSED, FAILED = 0, 1, 2
"""Exit codes of a run."""

TILES = "tiles"
"""Not raced: of tiles, the run that is refused keeps nothing, as a test shows."""

KEPT = "_new"
"""Ending of the name under which the run that is refused keeps its file."""


def race_once(name: str, folder: Path, first: int, delays_s: tuple[float, float]) -> str:
    """Have two processes write versions `first` and `first + 1` at once, after delays, and return what is there.

    This is "one whole, one refused" or what is wrong.
    """
    file, write, read = FORMATS[name]
    ready, go = os.pipe(), os.pipe()
    runs = []
    for number, delay_s in enumerate(delays_s):
        process = os.fork()
        if process == 0:
            code = FAILED
            try:
                destination = Destination.at(folder / file)
                os.close(go[1])
                os.write(ready[1], b"x")
                os.read(go[0], 1)
                time.sleep(delay_s)
                write(destination, first + number)
                code = WROTE
            except RailExtractError as error:
                code = REFUSED if "in the meantime" in str(error) else FAILED
                if code == FAILED:
                    print(f"{name}: {error}", flush=True)
            except BaseException as error:
                print(f"{name}: {error!r}", flush=True)
            os._exit(code)
        runs.append(process)
    for _ in runs:
        os.read(ready[0], 1)
    for end in go:
        os.close(end)
    codes = [os.waitstatus_to_exitcode(os.waitpid(process, 0)[1]) for process in runs]
    for end in ready:
        os.close(end)
    found = versions(read, folder / file)
    path = folder / file
    kept = path.with_name(f"{path.stem}{KEPT}{path.suffix}")
    beside = versions(read, kept) if kept.exists() else set()
    for one in folder.glob(f"*{KEPT}*"):
        one.unlink()
    left = [one.name for one in folder.iterdir() if one.is_dir()]
    if sorted(codes) != [WROTE, REFUSED] or left:
        return f"{name}: exit codes {codes}, versions {found}, left {left}"
    winner = codes.index(WROTE)
    wanted = [{first + number} for number in (winner, 1 - winner)]
    return "one whole, one refused" if [found, beside] == wanted else f"{name}: {found}, {beside} instead of {wanted}"


def race_often(name: str, times: int, seed: int = 1) -> Counter[str]:
    """Let pairs of runs write a format, each second pair into an empty folder, and count what is there afterwards."""
    moments, found = random.Random(seed), Counter[str]()
    file, write, _ = FORMATS[name]
    raw_tiles()
    for number in range(times):
        with tempfile.TemporaryDirectory() as place:
            folder = Path(place)
            if number % 2 or "table" in name:  # two runs cannot both add the first table to a file that is not there
                elsewhere(partial(write, Destination.at(folder / file), 1))
            found[race_once(name, folder, 2, (0.0, MAX_DELAY_S * moments.uniform(-1, 1) % MAX_DELAY_S))] += 1
    return found


def main() -> None:
    """Race, print the counts, and exit with 1 if anything was half or unsaid."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("times", type=int, nargs="?", default=20, help="pairs of runs per format (default: 20)")
    times = parser.parse_args().times
    application = start_qgis()  # noqa: F841 - kept alive
    wrong = False
    print(f"{'format':12} {'pairs':>6} {'one whole, one refused':>24}")
    for name in FORMATS:
        if name == TILES:
            continue
        found = race_often(name, times)
        print(f"{name:12} {times:6} {found['one whole, one refused']:24}", flush=True)
        for outcome in set(found) - {"one whole, one refused"}:
            print(f"  {found[outcome]} x {outcome}", flush=True)
            wrong = True
    sys.stdout.flush()
    os._exit(int(wrong))  # QGIS does not end well in a process that has forked


if __name__ == "__main__":
    main()
