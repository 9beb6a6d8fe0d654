"""The package as `pip install` brings it: what the wheel holds, and its examples and command run from there."""

import os
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
PIP = [sys.executable, "-m", "pip", "--disable-pip-version-check", "-q"]

EXAMPLES = """
import doctest, rail_extract, rail_extract.core.commands.front, rail_extract.core.clouds.points
for module in (rail_extract, rail_extract.core.commands.front, rail_extract.core.clouds.points):
    assert module.__file__.startswith({folder!r}), module.__file__
    failed, attempted = doctest.testmod(module, optionflags=doctest.NORMALIZE_WHITESPACE)
    assert attempted and not failed, module
"""


@pytest.fixture(scope="module")
def wheel(tmp_path_factory):
    folder = tmp_path_factory.mktemp("wheel")
    # A copy: building leaves files in the tree.
    names = subprocess.run(["git", "ls-files", "-z"], cwd=ROOT, check=True, capture_output=True, text=True).stdout
    for name in filter(None, names.split("\0")):
        if name.split("/")[0] in ("core", "models", "resources", "py.typed", "pyproject.toml", "README.md") or (
            "/" not in name and name.endswith(".py")
        ):
            target = folder / "source" / name
            target.parent.mkdir(parents=True, exist_ok=True)
            target.write_bytes((ROOT / name).read_bytes())
    build = ["wheel", "--no-deps", "--no-build-isolation", "-w", str(folder), str(folder / "source")]
    subprocess.run([*PIP, *build], check=True)
    return next(folder.glob("*.whl"))


@pytest.fixture(scope="module")
def installed(wheel):
    folder = wheel.parent / "installed"
    subprocess.run([*PIP, "install", "--no-deps", "--target", str(folder), str(wheel)], check=True)
    return folder


def test_wheel_holds_the_core_its_weights_and_the_sample_only(wheel):
    names = zipfile.ZipFile(wheel).namelist()
    folders = {"/".join(name.split("/")[:2]) for name in names if name.count("/") > 1}
    assert folders == {"rail_extract/core", "rail_extract/models", "rail_extract/resources"}
    expected = ["py.typed", "core/commands/front.py", "models/frpdf_fast.npz", "resources/sample/sample.laz"]
    assert {f"rail_extract/{name}" for name in expected} <= set(names)


def test_examples_run_from_the_installed_wheel(installed, tmp_path):
    script = EXAMPLES.format(folder=str(installed))
    subprocess.run([sys.executable, "-c", script], check=True, cwd=tmp_path, env=_environment(installed))


def test_the_command_is_installed(installed, tmp_path):
    command = [sys.executable, str(installed / "bin" / "rail-extract"), "--help"]
    done = subprocess.run(
        command, check=True, cwd=tmp_path, env=_environment(installed), capture_output=True, text=True
    )
    assert "the 3D lines of the railheads and of the track centerlines" in " ".join(done.stdout.split())
    assert "synthetic" not in done.stdout  # the laboratory is not installed


def _environment(folder):
    return {**os.environ, "PYTHONPATH": str(folder)}
