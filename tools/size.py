"""Print how large the code is: files and lines by part, and rooms, floors and named numbers of the core.

Run `python tools/size.py`, or `make size`. A room is a package or a module of `core`; its floor is one above the
highest of the rooms that it imports. Named numbers are those that `tools/constants.py` lists.
"""

from __future__ import annotations

import ast
from collections.abc import Mapping
from pathlib import Path

from constants import ROOT, groups_of

PARTS = ("core", "rail_extract_plugin", "laboratory", "benchmarks", "tools", "tests")
"""Folders with code."""


def main() -> None:
    """Print the figures."""
    print(f"{'':<20}{'files':>6}{'lines':>8}")
    sizes = {part: size(ROOT / part, "*.py") for part in PARTS}
    sizes["docs"] = size(ROOT / "docs", "*.md")
    sizes["all"] = tuple(map(sum, zip(*sizes.values())))
    for part, (files, lines) in sizes.items():
        print(f"{part:<20}{files:>6}{lines:>8}")
    imports = imported(ROOT / "core")
    print(f"\ncore: {named_numbers(ROOT / 'core')} named numbers, {len(imports)} rooms, {floors(imports)} floors")


def size(folder: Path, pattern: str) -> tuple[int, int]:
    """Return the number of files below a folder and of their lines."""
    counts = [path.read_bytes().count(b"\n") for path in folder.rglob(pattern)]
    return len(counts), sum(counts)


def named_numbers(folder: Path) -> int:
    """Return the number of numeric constants of all modules below a folder."""
    groups = [group for path in folder.rglob("*.py") for group in groups_of(path.read_text(encoding="utf-8"))]
    return sum(len(group.names) for group in groups)


def imported(package: Path) -> dict[str, set[str]]:
    """Return which rooms of a package each of its rooms imports."""
    found: dict[str, set[str]] = {}
    for path in package.rglob("*.py"):
        place = path.relative_to(package).with_suffix("").parts
        if place == ("__init__",):
            continue
        names = set()
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.ImportFrom) and node.level == len(place):
                names |= {node.module.split(".")[0]} if node.module else {alias.name for alias in node.names}
        found.setdefault(place[0], set()).update(names - {place[0]})
    return {room: names & set(found) for room, names in found.items()}


def floors(imports: Mapping[str, set[str]]) -> int:
    """Return the number of floors, given the rooms that each room imports."""
    found: dict[str, int] = {}

    def floor(room: str) -> int:
        if room not in found:
            found[room] = 1 + max(map(floor, imports[room]), default=0)
        return found[room]

    return max(map(floor, imports))


if __name__ == "__main__":
    main()
