import sys
from pathlib import Path

import numpy
import pytest
from rail_extract.core.errors import RailExtractError
from rail_extract.rail_extract_plugin.setup.interpreter import candidates, find_interpreter
from rail_extract.rail_extract_plugin.setup.processes import run

VERSION = "python{}.{}".format(*sys.version_info)


@pytest.fixture
def fake_qgis(monkeypatch, tmp_path):
    """Another prefix, with programs that print a given answer."""
    monkeypatch.setattr(sys, "prefix", str(tmp_path))
    monkeypatch.setattr(sys, "executable", str(tmp_path / "MacOS" / "QGIS"))

    def add(name: str, answer: str) -> Path:
        program = tmp_path / name
        program.parent.mkdir(exist_ok=True)
        program.write_text(f"#!/bin/sh\n{answer}\n")
        program.chmod(0o755)
        return program

    return add


@pytest.mark.parametrize(
    ("executable", "prefix", "platform", "expected"),
    [
        ("/usr/bin/python3", "/usr", "linux", "/usr/bin/python3"),
        ("/Q/Contents/MacOS/QGIS", "/Q/Contents/Frameworks", "darwin", "/Q/Contents/MacOS/bin/python3"),
        ("/Q/Contents/MacOS/QGIS", "/Q/Contents/Frameworks", "darwin", f"/Q/Contents/MacOS/{VERSION}"),
        ("C:/O/bin/qgis-bin.exe", "C:/O/apps/Python312", "win32", "C:/O/apps/Python312/python3.exe"),
        ("C:/O/bin/qgis-bin.exe", "C:/O/apps/Python312", "win32", "C:/O/bin/python3.exe"),
    ],
)
def test_candidates_on_each_system(executable, prefix, platform, expected):
    places = list(candidates(Path(executable), Path(prefix), platform))
    assert Path(expected) in places
    assert Path(executable) not in places or "python" in executable


def test_program_found_here_has_the_packages_of_qgis():
    found = find_interpreter()
    answer = run(found.program, ["-c", "import numpy; print(numpy.__version__)"], found.changes)
    assert answer.output.strip() == numpy.__version__


def test_another_python_is_skipped(fake_qgis):
    fake_qgis("bin/python3", "echo 2 7 None")
    right = fake_qgis("MacOS/python3", f"echo {sys.version_info[0]} {sys.version_info[1]} {numpy.__version__}")
    assert find_interpreter().program == str(right)


def test_program_that_does_not_find_its_library_gets_its_home(fake_qgis):
    answer = f"echo {sys.version_info[0]} {sys.version_info[1]} {numpy.__version__}"
    fake_qgis("MacOS/python", f'test "$PYTHONHOME" && {answer}')
    assert find_interpreter().changes == {"PYTHONHOME": sys.prefix}


def test_qgis_itself_is_never_started(fake_qgis, tmp_path):
    fake_qgis("MacOS/QGIS", f"touch '{tmp_path}/started'")
    with pytest.raises(RailExtractError, match="was not found in .*RAIL_EXTRACT_PACKAGES"):
        find_interpreter()
    assert not (tmp_path / "started").exists()
