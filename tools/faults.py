"""Faults and bad inputs with their expected results; writes the page that lists them from the tests."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parent.parent
PAGE = ROOT / "docs" / "faults.md"

REFUSED = "is refused"
WARNED = "continues with a warning"
FINE = "gives the correct result"

INTRODUCTION = """# Faults and their messages

Each row is a test: it creates the fault, runs the algorithm in QGIS, and checks the result. If the dialog or the run
refuses an input, it shows exactly the message in the row, no traceback, and leaves no temporary file and no output
except those that the message calls complete. In the messages, … stands for text that differs from case to case.

`.venv/bin/python tools/faults.py` writes this page from the tables in `tests/plugin/test_faults_*.py`; a test checks
that it is up to date.
"""

TRIED = (
    (
        "make fuzz",
        "damaged files of eighteen kinds: LAS, LAZ, COPC and classified copies of them, catalogues, lists of names, "
        "weights and interrupted trainings, folders of earlier runs, vector layers and rasters; 50,000 of each kind",
        "none ends in a traceback or a signal, takes more than 1 GB, or hangs, after what was found has been mended: "
        "two LAZ files of 50,000 ended lazrs, 19 copies of 50,000 were refused without a reason, and one shapefile of "
        "50,000 had coordinates that nothing can be computed with",
    ),
    (
        "tools/kills.py 50",
        "runs that are killed while they write, 50 for each of thirteen formats",
        "the old file or the new one, 650 of 650",
    ),
    (
        "tools/races.py 20",
        "two runs that write one output at once, 20 pairs for each of eleven formats",
        "one is whole; the other says that the output was changed, and names its own file: 220 of 220",
    ),
    (
        "tools/growth.py 200",
        "one extraction with all outputs after another, in one process",
        "the memory that is held grows by 2 MB from the first run (483 MB) to the 200th (485 MB)",
    ),
)
"""Faults that are made at random: the command, what it tries, and what its last run found."""

BEYOND = """
## Beyond these rows

Some faults are made at random. Each command below makes as many as time allows; a few of each are tests.

| command | tries | found |
|---|---|---|
"""

DENSE = """
A cloud of 10 million points in one square metre takes 0.85 GB: 0.28 GB for Python and its libraries, 0.48 GB for the
points as they are stored and in local metres.
"""


@dataclass(frozen=True)
class Fault:
    """A fault.

    Attributes
    ----------
    name : str
    prepare : callable
        Creates the fault, given the fixture `bench`, and returns the parameters of the run.
    ends : str
        `REFUSED`, `WARNED` or `FINE`.
    says : str
        The expected message; … stands for any text. Empty if there is none.
    gives : dict
        Some of the expected results.
    run : str
        Name of the algorithm, if it differs from that of the table.
    """

    name: str
    prepare: Callable[[Any], dict[str, Any]]
    ends: str = FINE
    says: str = ""
    gives: dict[str, Any] = field(default_factory=dict)
    run: str = ""

    def matches(self, said: str) -> bool:
        """Return whether a message is the expected one."""
        return re.fullmatch(".*".join(map(re.escape, self.says.split("…"))), said) is not None


def refused(name: str, prepare: Callable[..., dict[str, Any]], says: str, **more: Any) -> Fault:
    """Return a fault that is refused with this message."""
    return Fault(name, prepare, REFUSED, says, **more)


def tables() -> Iterator[tuple[str, list[Fault]]]:
    """Load the tables of the tests: title and faults of each."""
    for path in sorted((ROOT / "tests" / "plugin").glob("test_faults_*.py")):
        spec = spec_from_file_location(path.stem, path)
        module = module_from_spec(spec)
        spec.loader.exec_module(module)
        if hasattr(module, "FAULTS"):
            yield module.TITLE, module.FAULTS


def page() -> str:
    """Return the page."""
    parts, count = [], 0
    for title, faults in tables():
        count += len(faults)
        parts += [f"\n## {title}\n\n| fault | result | message |\n|---|---|---|\n"]
        parts += [f"| {fault.name} | {_outcome(fault)} | {fault.says} |\n" for fault in faults]
    tried = "".join(f"| `{command}` | {what} | {found} |\n" for command, what, found in TRIED)
    return f"{INTRODUCTION}\nThe page lists {count} faults.\n{''.join(parts)}{BEYOND}{tried}{DENSE}"


def _outcome(fault: Fault) -> str:
    figures = ", ".join(f"{name} {value}" for name, value in fault.gives.items())
    return f"{fault.ends}: {figures}" if figures else fault.ends


if __name__ == "__main__":
    PAGE.write_text(page(), encoding="utf-8")
