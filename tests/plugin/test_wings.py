"""Which packages of the plugin may import which: none imports in a circle."""

import ast
from pathlib import Path

import pytest

PLUGIN = Path(__file__).resolve().parents[2] / "rail_extract_plugin"
BELOW = {"setup": set(), "reading": set(), "dialog": {"reading"}, "writing": {"reading"}}
"""Packages that each package may import from, besides itself."""


def imported_packages(path):
    """Find the packages of the plugin that a module of another one imports, wherever the import stands."""
    modules = [node.module or "" for node in ast.walk(ast.parse(path.read_text())) if is_of_the_plugin(node)]
    return {module.partition(".")[0] for module in modules} & {*BELOW, "algorithms"}


def is_of_the_plugin(node):
    return isinstance(node, ast.ImportFrom) and node.level == 2


@pytest.mark.parametrize("package", BELOW)
def test_packages_import_only_from_below(package):
    modules = sorted((PLUGIN / package).glob("*.py"))
    assert len(modules) > 3
    for module in modules:
        assert imported_packages(module) <= BELOW[package], module.name
