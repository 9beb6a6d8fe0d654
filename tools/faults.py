"""Faults and bad inputs: the rows of docs/faults.md, and what makes the fault of each."""

from __future__ import annotations

import re
from ast import literal_eval
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest

PAGE = Path(__file__).resolve().parent.parent / "docs" / "faults.md"

REFUSED = "is refused"
WARNED = "continues with a warning"
FINE = "gives the correct result"


@dataclass(frozen=True)
class Fault:
    """A row of the page: how the run ends, some of its results, and what it says, where … stands for any text.

    `prepare` creates the fault, given the fixture `bench`, and returns the parameters of the run.
    """

    name: str
    ends: str
    gives: dict[str, Any]
    says: str
    algorithm: str
    prepare: Callable[[Any], dict[str, Any]]

    def __str__(self) -> str:
        return self.name

    def matches(self, said: str) -> bool:
        """Return whether a message is the expected one."""
        return re.fullmatch(".*".join(map(re.escape, self.says.split("…"))), said) is not None


def faults(title: str, makers: dict[str, dict[str, Callable[[Any], dict[str, Any]]]]) -> list[Fault]:
    """Return the faults of a section of the page, from what makes each by algorithm and by the name of its row.

    Raises ValueError if a row has no maker, or a maker no row.
    """
    found = {name: (algorithm, make) for algorithm, some in makers.items() for name, make in some.items()}
    rows = {name: rest for name, *rest in _rows(title)}
    if found.keys() != rows.keys():
        raise ValueError(f"In only one of tests and page, section {title}: {sorted(found.keys() ^ rows.keys())}")
    return [Fault(name, *_result(result), says, *found[name]) for name, (result, says) in rows.items()]


def titles() -> list[str]:
    """Return the titles of all tables of faults."""
    return re.findall(r"^## (.*)\n\n\| fault ", PAGE.read_text(encoding="utf-8"), re.MULTILINE)


def _rows(title: str) -> list[list[str]]:
    """Return the cells of a section: name, result and message of each row."""
    section = PAGE.read_text(encoding="utf-8").split(f"\n## {title}\n")[1].split("\n## ")[0]
    lines = [line for line in section.splitlines() if line.startswith("| ")]
    return [[cell.strip() for cell in line[1:-1].split(" | ")] for line in lines[1:]]


def _result(cell: str) -> tuple[str, dict[str, Any]]:
    """Return how a run ends, and the results that the cell states."""
    ends, _, figures = cell.partition(": ")
    pairs = (figure.split(" ") for figure in figures.split(", ") if figure)
    return ends, {name: literal_eval(value) for name, value in pairs}


def cancelled(prepare: Callable[[Any], dict[str, Any]], percent: float) -> Callable[[Any], dict[str, Any]]:
    """Return the same preparation; the user cancels at this progress."""

    def and_cancel(bench: Any) -> dict[str, Any]:
        bench.feedback.progressChanged.connect(lambda done: bench.feedback.cancel() if done >= percent else None)
        return prepare(bench)

    return and_cancel


def full_disk(prepare: Callable[[Any], dict[str, Any]], room: int, suffix: str) -> Callable[[Any], dict[str, Any]]:
    """Return the same preparation for an output on a disk that takes files of up to `room` bytes."""

    def and_fill(bench: Any) -> dict[str, Any]:
        resource = pytest.importorskip("resource", reason="only Unix limits the size of files")
        parameters = prepare(bench)
        soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
        bench.run.callback(lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard)))
        resource.setrlimit(resource.RLIMIT_FSIZE, (room, hard))
        return {**parameters, "OUTPUT": bench.folder / "out" / f"OUTPUT{suffix}"}

    return and_fill
