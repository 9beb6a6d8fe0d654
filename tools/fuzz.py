"""Read damaged files: none may end in a traceback, a signal, a hang, or more memory than allowed.

Each kind of file has a process of its own, which is watched and replaced when it dies. Every damaged file is made from
a seed, so that `python tools/fuzz.py KIND:SEED` makes and reads one again. A temporary folder in memory, such as
`TMPDIR=/dev/shm`, makes it a third faster.
"""

from __future__ import annotations

import argparse
import faulthandler
import os
import re
import resource
import select
import signal
import subprocess
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Iterable
from contextlib import suppress
from importlib import import_module
from itertools import count, islice
from pathlib import Path

from fuzzing.kinds import KINDS, Kind

MAX_BYTES = 2**30
"""Memory that reading a file may take in addition to that of Python and its libraries."""

MAX_CPU_S, MAX_WALL_S = 20.0, 600.0
"""A file that takes longer hangs. The wall clock has a wide limit, because the machine may be shared."""

SCRIPT = Path(__file__).resolve()

READY = "ready"
READ, REFUSED, FAILED = "read", "refused", "failed"
"""Outcomes that a watched process reports; `FAILED` is followed by the reason."""

MAX_PLACES = 4
"""Innermost lines of Python that are named where a process died."""

FRESH_AFTER = 500
"""Files after which a process is replaced, so that its memory and open files do not count for the next: of six in ten
damaged rasters, a file stays open."""


def outcome_of(kind: Kind, path: Path) -> str:
    """Read a file, and return what became of it as one line."""
    from rail_extract.core.errors import RailExtractError

    try:
        kind.read(path)
    except RailExtractError as error:
        said = str(error)
        return REFUSED if said and "\n" not in said else f"{FAILED} not one line: {said!r}"
    except MemoryError:
        return f"{FAILED} memory: more than {MAX_BYTES / 2**30:.0f} GB"
    except BaseException as error:
        return f"{FAILED} {type(error).__name__}: {' '.join(str(error).split())}"
    return READ


def work(kind: Kind, folder: Path) -> None:
    """Read the files of the seeds that come in, line by line, and report each; the watched process runs this."""
    faulthandler.enable()
    answers = os.fdopen(os.dup(1), "w")
    os.dup2(os.open(os.devnull, os.O_WRONLY), 1)  # libraries write what they like
    good = kind.make(folder)
    outcome = outcome_of(kind, kind.copied(folder, good[0]))  # imports what is needed before the limit counts
    if outcome != READ:
        print(f"undamaged: {outcome}", file=answers, flush=True)
        return
    size = int(Path("/proc/self/statm").read_text().split()[0]) * resource.getpagesize()
    resource.setrlimit(resource.RLIMIT_AS, (size + MAX_BYTES,) * 2)
    print(READY, file=answers, flush=True)
    for line in sys.stdin:
        print(outcome_of(kind, kind.mutant(folder, good, int(line))), file=answers, flush=True)


class Watched:
    """A process that reads damaged files of one kind."""

    def __init__(self, kind: Kind, folder: Path) -> None:
        command = [sys.executable, str(SCRIPT), "--work", kind.name, "--folder", str(folder)]
        log = folder.parent / f"{kind.name}.log"
        self._log = log.open("wb")
        self._process = subprocess.Popen(
            command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=self._log, env=environment()
        )
        self.files = 0
        if (answer := self._answer()) != READY:
            raise RuntimeError(f"{kind.name} can't be prepared: {answer}\n{log.read_text(errors='replace')}")

    def ask(self, seed: int) -> str:
        """Return the outcome of a seed, or how the process died of it."""
        self.files += 1
        try:
            self._process.stdin.write(f"{seed}\n".encode())
            self._process.stdin.flush()
        except BrokenPipeError:
            return f"{FAILED} the process had ended"
        return self._answer()

    def _answer(self) -> str:
        start, cpu_s = time.monotonic(), self._cpu_s()
        while not select.select([self._process.stdout], [], [], 1.0)[0]:
            used_s, passed_s = self._cpu_s() - cpu_s, time.monotonic() - start
            if used_s > MAX_CPU_S or passed_s > MAX_WALL_S:
                self.end()
                return f"{FAILED} hang: {used_s:.0f} s of computing in {passed_s:.0f} s"
        line = self._process.stdout.readline().decode(errors="replace").strip()
        if line:
            return line
        code = self._process.wait()
        places = re.findall(r'File "(\S+)", line (\d+)', Path(self._log.name).read_text(errors="replace"))
        where = ", ".join(f"{Path(file).name}:{line}" for file, line in places[:MAX_PLACES])
        return f"{FAILED} {signal.Signals(-code).name if code < 0 else f'exit code {code}'} {where}".rstrip()

    def _cpu_s(self) -> float:
        try:
            fields = Path(f"/proc/{self._process.pid}/stat").read_text().rpartition(")")[2].split()
        except OSError:
            return 0.0
        return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")

    @property
    def is_alive(self) -> bool:
        """Whether the process can read another file."""
        return self._process.poll() is None

    def end(self) -> None:
        """End the process."""
        self._process.kill()
        self._process.wait()
        for pipe in (self._process.stdin, self._process.stdout, self._log):
            with suppress(BrokenPipeError):
                pipe.close()


def environment() -> dict[str, str]:
    """Environment of a watched process: few threads, and the modules that this process finds."""
    paths = [str(Path(__file__).resolve().parent), *filter(None, sys.path)]
    return {**os.environ, "OMP_NUM_THREADS": "1", "RAYON_NUM_THREADS": "1", "PYTHONPATH": os.pathsep.join(paths)}


def fuzz(kind: Kind, seeds: Iterable[int], until: float = float("inf")) -> tuple[Counter, dict[int, str]]:
    """Read the damaged files of seeds until a time of `time.monotonic`.

    Returns the number of files by outcome, and what went wrong, by seed, which is also printed at once.
    """
    counts: Counter = Counter()
    failures: dict[int, str] = {}
    with tempfile.TemporaryDirectory() as folder:
        watched = None
        try:
            for seed in seeds:
                if time.monotonic() > until:
                    break
                if watched is None or not watched.is_alive or watched.files >= FRESH_AFTER:
                    if watched is not None:
                        watched.end()
                    watched = Watched(kind, Path(tempfile.mkdtemp(dir=folder)))
                outcome, _, reason = watched.ask(seed).partition(" ")
                counts[outcome] += 1
                if outcome not in (READ, REFUSED):
                    failures[seed] = reason or outcome
                    print(f"{kind.name}:{seed} {failures[seed]}", flush=True)
        finally:
            if watched is not None:
                watched.end()
    return counts, failures


def main(arguments: list[str] | None = None) -> int:
    """Damage and read files for some minutes, or one file again, and print a table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("what", nargs="*", help=f"kinds ({', '.join(KINDS)}), or KIND:SEED to read one file again")
    parser.add_argument("--minutes", type=float, default=5.0, help="time for all kinds together (default 5)")
    parser.add_argument("--files", type=int, default=sys.maxsize, help="most files of each kind (default: no limit)")
    parser.add_argument("--seed", type=int, default=0, help="first seed (default 0)")
    parser.add_argument("--work", help=argparse.SUPPRESS)
    parser.add_argument("--folder", type=Path, help=argparse.SUPPRESS)
    args = parser.parse_args(arguments)
    if args.work:
        work(KINDS[args.work], args.folder)
        return 0
    single = [one.split(":") for one in args.what if ":" in one]
    if single:
        return max(_again(KINDS[name], int(seed)) for name, seed in single)
    kinds = [KINDS[name] for name in args.what] or [kind for kind in KINDS.values() if _can_run(kind)]
    rows, bad = [], 0
    for kind in kinds:
        share_s = 60 * args.minutes / len(kinds)
        start = time.monotonic()
        counts, failures = fuzz(kind, islice(count(args.seed), args.files), start + share_s)
        files = sum(counts.values())
        rows.append(
            (kind.name, files, counts[READ], counts[REFUSED], len(failures), files / (time.monotonic() - start))
        )
        bad += len(failures)
    print(f"{'kind':8} {'files':>8} {READ:>8} {REFUSED:>8} {FAILED:>8} {'per s':>8}")
    for row in rows:
        print(f"{row[0]:8} {row[1]:8} {row[2]:8} {row[3]:8} {row[4]:8} {row[5]:8.0f}")
    return 1 if bad else 0


def _again(kind: Kind, seed: int) -> int:
    """Make and read one damaged file, which stays for a closer look, with its traceback if it fails."""
    folder = Path(tempfile.mkdtemp(prefix=f"fuzz_{kind.name}_{seed}_"))
    path = kind.mutant(folder, kind.make(folder), seed)
    print(path, flush=True)
    from rail_extract.core.errors import RailExtractError

    try:
        kind.read(path)
    except RailExtractError as error:
        print(f"{REFUSED}: {error}")
        return int("\n" in str(error))
    print(READ)
    return 0


def _can_run(kind: Kind) -> bool:
    """Return whether this Python can read a kind."""
    try:
        import_module(kind.needs)
    except ImportError:
        print(f"{kind.name}: left out, because {kind.needs} is not installed", file=sys.stderr)
        return False
    return True


if __name__ == "__main__":
    sys.exit(main())
