"""The import contract, CONTRIBUTING and docs/architecture.md name the same packages of the core, in one order."""

import ast
import re
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]


def floors():
    """Return the number of the floor of each package, 0 at the top, as the import contract states it."""
    text = (ROOT / "pyproject.toml").read_text(encoding="utf-8")
    layers = re.search(r'name = "In the core, too".*?layers = (\[.*?\])', text, flags=re.DOTALL)[1]
    return {name: number for number, floor in enumerate(ast.literal_eval(layers)) for name in floor.split(" | ")}


def named(page, heading, column):
    """Return the packages in a column of the table with this heading, from top to bottom."""
    lines = iter((ROOT / page).read_text(encoding="utf-8").splitlines())
    next(line for line in lines if line.startswith(heading))
    next(lines)
    rows = []
    for line in lines:
        if not line.startswith("|"):
            break
        rows.append(line.split("|")[column])
    return [name for row in rows for name in re.findall(r"`(\w+)`", row)]


@pytest.mark.parametrize(
    ("page", "heading", "column", "downwards"),
    [("CONTRIBUTING.md", "| package |", 1, False), ("docs/architecture.md", "| floor |", 2, True)],
)
def test_a_table_names_every_package_once_and_in_the_order_of_the_contract(page, heading, column, downwards):
    contract, names = floors(), named(page, heading, column)
    assert sorted(names) == sorted(contract)
    order = [contract[name] for name in names]
    assert order == sorted(order, reverse=not downwards)


def test_the_contract_names_every_package_that_exists():
    core = ROOT / "core"
    packages = {one.parent.name for one in core.glob("*/__init__.py")} | {one.stem for one in core.glob("*.py")}
    assert packages - {"__init__"} == set(floors())
