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
    return f"{INTRODUCTION}\nThe page lists {count} faults.\n{''.join(parts)}"


def _outcome(fault: Fault) -> str:
    figures = ", ".join(f"{name} {value}" for name, value in fault.gives.items())
    return f"{fault.ends}: {figures}" if figures else fault.ends


if __name__ == "__main__":
    PAGE.write_text(page(), encoding="utf-8")
