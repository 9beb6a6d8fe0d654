"""Bad inputs and faults, each with what must come of it; the page that lists them is made of the tests themselves."""

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
WARNED = "goes on with a warning"
FINE = "gives the right result"

INTRODUCTION = """# What goes wrong, and what Rail Extract says

Each row is a test: the fault is made, the algorithm is run in QGIS, and it must end as the row says. What is refused,
in the dialog or in the run, is refused in the one sentence shown, without a traceback, and leaves no temporary file and
no output but those that the sentence calls whole. In the sentences, … stands for what changes from case to case.

`.venv/bin/python tools/faults.py` writes this page from the tables in `tests/plugin/test_faults_*.py`, and a test
compares the two.
"""


@dataclass(frozen=True)
class Fault:
    """Something that goes wrong.

    Attributes
    ----------
    name : str
    prepare : callable
        Makes the fault, given a bench (fixture of the tests), and gives the parameters of the run.
    ends : str
        `REFUSED`, `WARNED` or `FINE`.
    says : str
        The whole sentence; … stands for anything. Empty where nothing is said.
    gives : dict
        Some of the results.
    run : str
        Name of the algorithm, if not that of the whole table.
    """

    name: str
    prepare: Callable[[Any], dict[str, Any]]
    ends: str = FINE
    says: str = ""
    gives: dict[str, Any] = field(default_factory=dict)
    run: str = ""

    def matches(self, said: str) -> bool:
        """Tell whether a sentence is the one expected."""
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
    """Put the page together."""
    parts, count = [], 0
    for title, faults in tables():
        count += len(faults)
        parts += [f"\n## {title}\n\n| fault | what happens | the sentence |\n|---|---|---|\n"]
        parts += [f"| {fault.name} | {_outcome(fault)} | {fault.says} |\n" for fault in faults]
    return f"{INTRODUCTION}\nThere are {count} of them.\n{''.join(parts)}"


def _outcome(fault: Fault) -> str:
    figures = ", ".join(f"{name} {value}" for name, value in fault.gives.items())
    return f"{fault.ends}: {figures}" if figures else fault.ends


if __name__ == "__main__":
    PAGE.write_text(page(), encoding="utf-8")
