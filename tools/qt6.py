"""Find names in the plugin's code that Qt 6, and therefore QGIS 4, no longer has.

QGIS 4 is not run: the check inspects the syntax tree of every file and asks the installed QGIS which names are enums.
"""

from __future__ import annotations

import ast
import enum
import sys
from collections.abc import Iterator
from importlib import import_module
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parent.parent
CODE = ROOT / "rail_extract_plugin"

BINDINGS = ("PyQt5", "PyQt6", "PySide2", "PySide6", "sip")
MOVED = ("QAction", "QActionGroup", "QShortcut")
"""In QtGui of Qt 6 and in QtWidgets of Qt 5; qgis.PyQt.QtWidgets has them in both cases."""

REMOVED = ("QRegExp", "QRegExpValidator", "QDesktopWidget", "QMatrix", "QStringRef", "QTextCodec", "QGLWidget")
RENAMED_METHODS = ("exec_", "print_")
"""Names of PyQt5 that avoided keywords of Python 2."""

VARIANTS_ALLOWED_IN = ("compat.py",)
"""Modules that may use the field types of QGIS before 3.38."""


def findings(source: str, name: str) -> list[str]:
    """List what Qt 6 lacks in a file, as ``name:line what``."""
    tree = ast.parse(source, name)
    imported = _imported(tree)
    outer = {id(node.value) for node in ast.walk(tree) if isinstance(node, ast.Attribute)}
    found = []
    for node in ast.walk(tree):
        if isinstance(node, (ast.Import, ast.ImportFrom)):
            found += [(node.lineno, text) for text in _of_import(node)]
        elif isinstance(node, ast.Attribute):
            found += [(node.lineno, text) for text in _of_attribute(node, imported, id(node) in outer, name)]
    return [f"{name}:{line} {text}" for line, text in sorted(found)]


def _imported(tree: ast.AST) -> dict[str, tuple[str, str]]:
    """Return the names imported from QGIS, each with its module and its name in that module."""
    names = {}
    for node in ast.walk(tree):
        if isinstance(node, ast.ImportFrom) and (node.module or "").split(".")[0] == "qgis":
            names.update({alias.asname or alias.name: (node.module, alias.name) for alias in node.names})
    return names


def _of_import(node: ast.Import | ast.ImportFrom) -> Iterator[str]:
    module = node.module or "" if isinstance(node, ast.ImportFrom) else ""
    for alias in node.names:
        root = (module if module or isinstance(node, ast.ImportFrom) else alias.name).split(".")[0]
        if root in BINDINGS and not getattr(node, "level", 0):
            yield f"{root} is imported: take it from qgis.PyQt"
        elif module == "qgis.PyQt.QtGui" and alias.name in MOVED:
            yield f"{alias.name} is imported from QtGui: take it from qgis.PyQt.QtWidgets"
        elif module.startswith("qgis.PyQt") and alias.name in REMOVED:
            yield f"{alias.name} is not in Qt 6"


def _of_attribute(
    node: ast.Attribute, imported: dict[str, tuple[str, str]], is_scope: bool, name: str
) -> Iterator[str]:
    """Check an attribute access; `is_scope` states whether another one follows."""
    if node.attr in RENAMED_METHODS:
        yield f"{node.attr} is not in PyQt6: leave out the underscore"
    path = _path(node)
    if len(path) < 2 or path[0] not in imported:
        return
    if path[-2] == "QtGui" and path[-1] in MOVED:
        yield f"{'.'.join(path)} is not in Qt 5: take it from QtWidgets"
    elif path[-1] in REMOVED:
        yield f"{path[-1]} is not in Qt 6"
    elif path[-2] == "QVariant" and path[-1][0].isupper():
        if Path(name).name not in VARIANTS_ALLOWED_IN:
            yield f"{'.'.join(path)} is not in Qt 6: take the type from compat.py"
    elif not is_scope and _is_unscoped_member(imported[path[0]], path[1:]):
        yield f"{'.'.join(path)} lacks the enum's name"


def _path(node: ast.expr) -> list[str]:
    """Split ``a.b.c`` into its names; empty if it does not consist of names."""
    names: list[str] = []
    while isinstance(node, ast.Attribute):
        names.insert(0, node.attr)
        node = node.value
    return [node.id, *names] if isinstance(node, ast.Name) else []


def _is_unscoped_member(origin: tuple[str, str], names: list[str]) -> bool:
    """Return whether `names` lead from an import to a member of an enum, but not through the enum.

    Names unknown to the installed QGIS are judged by their spelling: enum members and classes begin with a capital.
    """
    scope, value = None, _resolve(*origin)
    for name in names:
        scope, value = value, getattr(value, name, None)
    if value is None:
        return len(names) == 1 and names[0][0].isupper()
    is_member = isinstance(value, enum.Enum) or (isinstance(value, int) and type(value) not in (int, bool))
    return is_member and type(value) is not scope


def _resolve(module: str, name: str) -> Any:
    try:
        return getattr(import_module(module), name, None) or import_module(f"{module}.{name}")
    except ImportError:
        return None


def main() -> int:
    """Print the findings; return 1 if there are any."""
    found = [
        finding
        for path in sorted(CODE.rglob("*.py"))
        for finding in findings(path.read_text(encoding="utf-8"), str(path.relative_to(ROOT)))
    ]
    print(*found, sep="\n", end="\n" if found else "")
    return len(found) > 0


if __name__ == "__main__":
    sys.exit(main())
