"""Packages that `pip install .` installs; the other tests import the checkout itself."""

import ast
import re
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]


def test_every_package_is_distributed():
    listed = re.search(r"^packages = (\[.*?^\])", (ROOT / "pyproject.toml").read_text(encoding="utf-8"), re.M | re.S)
    folders = {path.parent for path in (ROOT / "core").rglob("*.py")}
    packages = {
        ".".join(("rail_extract", *folder.relative_to(ROOT).parts)) for folder in (ROOT, ROOT / "models", *folders)
    }
    assert ast.literal_eval(listed[1]) == sorted(packages)
