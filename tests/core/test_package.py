"""The core as a package: all of it is distributed, and the examples in its docstrings give what they show."""

import ast
import doctest
import importlib
import importlib.util
import pkgutil
import re
from pathlib import Path

import pytest
import rail_extract.core

ROOT = Path(__file__).resolve().parents[2]

OF_THE_WHEEL = "rail_extract.core.commands.front"
"""Its examples, which extract rails, run in `tests/tools/test_wheel.py`."""

MODULES = [module.name for module in pkgutil.walk_packages(rail_extract.core.__path__, "rail_extract.core.")]


def has_examples(name):
    return ">>> " in importlib.util.find_spec(name).loader.get_source(name)


@pytest.mark.parametrize("name", [name for name in MODULES if has_examples(name) and name != OF_THE_WHEEL])
def test_examples_give_what_they_show(name):
    results = doctest.testmod(importlib.import_module(name), optionflags=doctest.NORMALIZE_WHITESPACE)
    assert results.attempted > 0
    assert results.failed == 0


def test_every_package_is_distributed():
    listed = re.search(r"^packages = (\[.*?^\])", (ROOT / "pyproject.toml").read_text(encoding="utf-8"), re.M | re.S)
    folders = {path.parent for path in (ROOT / "core").rglob("*.py")}
    packages = {
        ".".join(("rail_extract", *folder.relative_to(ROOT).parts)) for folder in (ROOT, ROOT / "models", *folders)
    }
    assert ast.literal_eval(listed[1]) == sorted(packages)
