"""Write build/constants.md: every number of the core and the laboratory that has a name, with its docstring.

Run `python tools/constants.py`. A docstring belongs to all assignments between it and the previous docstring.
"""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
PAGE = ROOT / "build" / "constants.md"

NAME = re.compile(r"_?[A-Z][A-Z0-9_]*")

HEAD = """# Constants

Every number of the core and of the laboratory that has a name, by module. `tools/constants.py` writes this page from
the code; [method.md](../docs/method.md) explains the steps in which the numbers are used.
"""


@dataclass(frozen=True)
class Group:
    """Constants that share a docstring, as the code writes them, and its text on one line, empty without one."""

    names: tuple[str, ...]
    values: tuple[str, ...]
    meaning: str


def groups_of(source: str) -> Iterator[Group]:
    """Yield the numeric constants of a module in their order."""
    names: list[str] = []
    values: list[str] = []
    for node in ast.parse(source).body:
        pairs = list(_constants(node))
        names += [name for name, _ in pairs]
        values += [value for _, value in pairs]
        if not pairs and names:
            yield Group(tuple(names), tuple(values), " ".join(_docstring(node).split()))
            names, values = [], []
    if names:
        yield Group(tuple(names), tuple(values), "")


def _constants(node: ast.stmt) -> Iterator[tuple[str, str]]:
    """Yield name and value of the numbers that a statement assigns."""
    if not isinstance(node, (ast.Assign, ast.AnnAssign)) or node.value is None:
        return
    target = node.targets[0] if isinstance(node, ast.Assign) else node.target
    both = isinstance(target, ast.Tuple) and isinstance(node.value, ast.Tuple)
    pairs = zip(target.elts, node.value.elts) if both else [(target, node.value)]  # type: ignore[attr-defined]
    for name, value in pairs:
        if NAME.fullmatch(ast.unparse(name)) and _is_number(value):
            yield ast.unparse(name), ast.unparse(value)


def _is_number(value: ast.expr) -> bool:
    """Return whether an expression consists of numbers, names and arithmetic, with at least one number or name."""
    parts = list(ast.walk(value))
    text = any(isinstance(part, ast.Constant) and not isinstance(part.value, (int, float)) for part in parts)
    calls = [ast.unparse(part.func) for part in parts if isinstance(part, ast.Call)]
    text |= any(not call.startswith(("np.", "math.")) or call == "np.empty" for call in calls)
    kinds = (ast.Constant, ast.BinOp, ast.UnaryOp, ast.Tuple, ast.Name, ast.Attribute, ast.Call, ast.Subscript)
    kinds += (ast.operator, ast.unaryop, ast.expr_context)
    numbers = any(isinstance(part, ast.Constant) and not isinstance(part.value, bool) for part in parts)
    return numbers and not text and all(isinstance(part, kinds) for part in parts)


def _docstring(node: ast.stmt) -> str:
    """Return the text of a statement that is only a text."""
    if isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant) and isinstance(node.value.value, str):
        return node.value.value
    return ""


def modules() -> Iterator[Path]:
    """Yield the modules in the order of the page."""
    for folder in ("core", "laboratory"):
        yield from sorted((ROOT / folder).rglob("*.py"), key=lambda path: (len(path.parts), path.as_posix()))


def page() -> str:
    """Return the text of the page."""
    sections = [HEAD]
    for path in modules():
        groups = list(groups_of(path.read_text(encoding="utf-8")))
        if groups:
            rows = [f"| {_code(group.names)} | {_code(group.values)} | {_cell(group.meaning)} |" for group in groups]
            title = path.relative_to(ROOT).as_posix()
            sections.append("\n".join([f"## {title}\n", "| constant | value | meaning |", "|---|---|---|", *rows, ""]))
    return "\n".join(sections)


def _code(words: tuple[str, ...]) -> str:
    return ", ".join(f"`{word}`" for word in words)


def _cell(text: str) -> str:
    return text.replace("|", "\\|")


if __name__ == "__main__":
    PAGE.parent.mkdir(exist_ok=True)
    PAGE.write_text(page(), encoding="utf-8")
