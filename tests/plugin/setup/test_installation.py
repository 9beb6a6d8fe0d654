"""The real pip, with wheels from a folder instead of the network."""

import hashlib
import os
import platform
import re
import sys
import zipfile
from itertools import product
from pathlib import Path

import pytest
from heard import Heard
from rail_extract.core.errors import Cancelled, RailExtractError
from rail_extract.core.progress import SILENT, Progress
from rail_extract.rail_extract_plugin.algorithms import install_packages
from rail_extract.rail_extract_plugin.algorithms.install_packages import InstallPackages, Job
from rail_extract.rail_extract_plugin.setup import installation, locked, package_folders
from rail_extract.rail_extract_plugin.setup.dependencies import OPTIONAL, OWNED_BY_QGIS, PACKAGES
from rail_extract.rail_extract_plugin.setup.installation import Order, install
from rail_extract.rail_extract_plugin.setup.interpreter import Interpreter, find_interpreter
from rail_extract.rail_extract_plugin.setup.locked import Locked


@pytest.fixture
def add_wheel(monkeypatch, tmp_path):
    """Add a package with one module to the only folder in which pip looks."""
    index = tmp_path / "index"
    index.mkdir()
    for name in ("PIP_FIND_LINKS", "PIP_EXTRA_INDEX_URL", "PIP_CONFIG_FILE"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setenv("PIP_CONFIG_FILE", "/dev/null")
    monkeypatch.setenv("PIP_NO_INDEX", "1")
    monkeypatch.setenv("PIP_FIND_LINKS", str(index))

    def add(name: str, version: str = "1.0", requires: tuple[str, ...] = (), code: str = "") -> None:
        record = f"{name}-{version}.dist-info"
        needs = "".join(f"Requires-Dist: {one}\n" for one in requires)
        with zipfile.ZipFile(index / f"{name}-{version}-py3-none-any.whl", "w") as wheel:
            wheel.writestr(f"{name}.py", code or f"VERSION = '{version}'\n")
            wheel.writestr(f"{record}/METADATA", f"Metadata-Version: 2.1\nName: {name}\nVersion: {version}\n{needs}")
            wheel.writestr(f"{record}/WHEEL", "Wheel-Version: 1.0\nRoot-Is-Purelib: true\nTag: py3-none-any\n")
            wheel.writestr(f"{record}/RECORD", "")

    return add


@pytest.fixture
def folder(tmp_path):
    return tmp_path / "Größe 1" / "packages"


@pytest.fixture
def put(folder):
    """Install a package by its name, which is also the name of its module."""

    def put(name: str, progress: Progress = SILENT, *options: str) -> str:
        return install(Order((name,), (name,), options), find_interpreter(), folder, [folder], progress)

    return put


def names_in(folder: Path) -> set[str]:
    return {entry.name for entry in folder.iterdir()} - {"__pycache__"}


def test_package_and_its_dependencies_go_into_the_folder(put, add_wheel, folder):
    add_wheel("railfirst", requires=("railsecond", "numpy"))
    add_wheel("railsecond", "2.1")
    assert sorted(put("railfirst").split(", ")) == ["railfirst 1.0", "railsecond 2.1"]
    assert {"railfirst.py", "railsecond.py"} <= names_in(folder)
    assert not [name for name in names_in(folder) if name.startswith("numpy")]
    assert list(folder.parent.iterdir()) == [folder]


def test_installed_packages_are_not_installed_again(put, add_wheel):
    add_wheel("railfirst", requires=("railsecond",))
    add_wheel("railsecond")
    assert put("railsecond") == "railsecond 1.0"
    assert put("railfirst") == "railfirst 1.0"


def test_numpy_of_qgis_determines_the_version(put, add_wheel):
    add_wheel("railfirst", "2.0", requires=("numpy>=99",))
    add_wheel("railfirst", "1.0", requires=("numpy>=1",))
    assert put("railfirst") == "railfirst 1.0"
    assert put("railfirst") == ""


def test_other_packages_of_qgis_are_kept(put, add_wheel, folder):
    heard = Heard()
    add_wheel("railfirst", requires=("laspy>=99",))
    add_wheel("laspy", "99.0")
    assert put("railfirst", heard) == "railfirst 1.0"
    assert [
        text for text in heard.warnings if text.startswith("QGIS has laspy ") and text.endswith("used instead of 99.0.")
    ]
    assert "laspy.py" not in names_in(folder)


@pytest.mark.parametrize(
    ("requires", "code", "sentence"),
    [
        (("railmissing",), "", "No matching distribution found for railmissing"),
        (
            (),
            "import railmissing",
            "does not work in the Python of this QGIS .*No module named 'railmissing'",
        ),
        ((), "import os; os.abort()", "does not work in the Python of this QGIS"),
    ],
)
def test_failure_is_a_sentence_and_changes_nothing(put, add_wheel, folder, requires, code, sentence):
    add_wheel("railsecond")
    put("railsecond")
    before = names_in(folder)
    add_wheel("railfirst", requires=requires, code=code)
    with pytest.raises(RailExtractError, match=sentence):
        put("railfirst")
    assert names_in(folder) == before
    assert list(folder.parent.iterdir()) == [folder]


def test_cancel_changes_nothing(put, add_wheel, folder):
    class Impatient(Heard):
        def is_cancelled(self):
            return any("Processing" in text for text in self.infos)

    add_wheel("railfirst")
    with pytest.raises(Cancelled):
        put("railfirst", Impatient())
    assert not list(folder.parent.iterdir())


STRANGER = "import os; open(os.environ['RAIL_STRANGER'], 'w').close(); raise SystemExit(1)"


@pytest.fixture
def stranger(tmp_path, monkeypatch):
    """A current folder with a stranger's modules; returns the file that they write if they run."""
    folder, sign = tmp_path / "downloads", tmp_path / "stranger was here"
    folder.mkdir()
    for name in ("pip", "numpy", "json", "railfirst", "sitecustomize", "encodings"):
        (folder / f"{name}.py").write_text(STRANGER)
    for name in ("python3", "python"):
        (folder / name).write_text(f"#!/bin/sh\ntouch '{sign}'\n")
        (folder / name).chmod(0o755)
    monkeypatch.setenv("RAIL_STRANGER", str(sign))
    monkeypatch.chdir(folder)
    return sign


def test_modules_in_the_current_folder_are_not_run(put, add_wheel, stranger, monkeypatch):
    monkeypatch.setenv("PYTHONPATH", f"{os.environ.get('PYTHONPATH', '')}{os.pathsep}{os.pathsep}.")
    add_wheel("railfirst")
    assert put("railfirst") == "railfirst 1.0"
    assert not stranger.exists()


def test_programs_in_the_current_folder_and_along_path_are_not_run(stranger, monkeypatch, tmp_path):
    monkeypatch.setenv("PATH", f".{os.pathsep}{os.environ['PATH']}")
    monkeypatch.setattr(sys, "executable", "")
    monkeypatch.setattr(sys, "prefix", str(tmp_path))
    with pytest.raises(RailExtractError, match="The Python program of this QGIS was not found"):
        find_interpreter()
    assert not stranger.exists()


def lock(monkeypatch, *packages):
    monkeypatch.setattr(installation, "locked_packages", lambda: {package.name: package for package in packages})


def checksum(tmp_path, name, version="1.0"):
    wheel = tmp_path / "index" / f"{name}-{version}-py3-none-any.whl"
    return f"sha256:{hashlib.sha256(wheel.read_bytes()).hexdigest()}"


def test_files_of_the_list_are_downloaded_once(put, add_wheel, monkeypatch, tmp_path, folder):
    """Asking pip what it would install downloads the files, OpenCV's 50 MB, once more."""
    calls, run = [], installation.processes.run
    monkeypatch.setattr(installation.processes, "run", lambda *given: calls.append(given[1]) or run(*given))
    add_wheel("railfirst", requires=("railsecond",))
    add_wheel("railsecond")
    files = {
        name: (tmp_path / "index" / f"{name}-1.0-py3-none-any.whl").read_bytes() for name in ("railfirst", "railsecond")
    }
    sums = {name: f"sha256:{hashlib.sha256(content).hexdigest()}" for name, content in files.items()}
    lock(monkeypatch, *(Locked(name, "1.0", (checksum,)) for name, checksum in sums.items()))
    monkeypatch.setitem(locked.BROUGHT, "railfirst", ("railfirst", "railsecond"))
    assert put("railfirst") == "railfirst 1.0, railsecond 1.0"
    assert sum("install" in call for call in calls) == 1


def test_the_list_has_what_every_requirement_brings():
    listed = {package.name for package, _ in locked._listed()}
    assert {name for names in locked.BROUGHT.values() for name in names} | {"pip"} <= listed
    assert set(locked.BROUGHT) == {one.requirement for one in PACKAGES if one.module not in (*OWNED_BY_QGIS, *OPTIONAL)}


def test_the_locked_version_is_installed(put, add_wheel, monkeypatch, tmp_path):
    for version in ("1.0", "1.1", "2.0"):
        add_wheel("railfirst", version)
    lock(
        monkeypatch,
        Locked("railfirst", "1.1", (checksum(tmp_path, "railfirst"), checksum(tmp_path, "railfirst", "1.1"))),
    )
    assert put("railfirst") == "railfirst 1.1"


def test_an_index_of_its_own_has_other_files_than_the_list(put, add_wheel, monkeypatch, tmp_path):
    heard = Heard()
    for version in ("1.0", "2.0"):
        add_wheel("railfirst", version)
    lock(monkeypatch, Locked("railfirst", "1.0", (checksum(tmp_path, "railfirst"),)))
    own = tmp_path / "index"
    assert put("railfirst", heard, "--find-links", str(own)) == "railfirst 2.0"
    assert (
        f"The files of railfirst come from an index of their own, {own}: they are compared with its" in heard.infos[0]
    )


def test_a_file_with_another_checksum_is_refused(put, add_wheel, monkeypatch, tmp_path, folder):
    add_wheel("railfirst", requires=("railsecond",))
    add_wheel("railsecond")
    lock(monkeypatch, Locked("railsecond", "1.0", (checksum(tmp_path, "railfirst"),)))
    with pytest.raises(RailExtractError, match="files of railfirst==1.0, railsecond==1.0 are not the original ones"):
        put("railfirst")
    assert not list(folder.parent.iterdir())


def test_the_list_covers_every_package_and_python():
    """If this fails, run tools/lock.py."""
    needed = {package.requirement.partition("[")[0] for package in PACKAGES if package.module not in OPTIONAL}
    listed = list(locked._listed())
    without_torch = set()
    for python, system in product(("3.9", "3.10", "3.11", "3.12", "3.13", "3.14"), locked.SYSTEMS):
        names = [package.name for package, places in listed if {python, f"{python}:{system}"} & set(places)]
        assert len(names) == len(set(names))
        assert needed - set(OWNED_BY_QGIS) | {"lazrs", "pip"} <= set(names)
        without_torch |= set() if "torch" in names else {(python, system)}
    assert without_torch == {(python, "darwin-x86_64") for python in ("3.13", "3.14")}
    for package, _ in listed:
        assert package.name == installation.normalized(package.name)
        assert all(re.fullmatch("sha256:[0-9a-f]{64}", one) for one in package.checksums)
    assert all(len(package.checksums) >= 5 for package, _ in listed if package.name in ("lazrs", "pyproj"))


def test_the_list_applies_to_the_systems_it_was_made_for(monkeypatch):
    here = locked.locked_packages()
    assert {"laspy", "lazrs", "opencv-python-headless", "pyproj"} <= set(here)
    monkeypatch.setattr(platform, "machine", lambda: "riscv64")
    assert locked.locked_packages() == {}


def test_folder_that_cannot_be_created(put, folder):
    folder.parent.write_text("a file")
    with pytest.raises(RailExtractError, match="can't be written"):
        put("railfirst")


def test_python_without_pip(folder):
    with pytest.raises(RailExtractError, match="has no pip: install it"):
        install(Order(("one",), ("one",)), Interpreter("/bin/false"), folder, [], SILENT)


def test_old_pip_installs_a_newer_one(add_wheel, folder, tmp_path):
    program = tmp_path / "python"
    script = f'if test "$3" = --version; then echo "pip 21.1 from x"; else exec {sys.executable} "$@"; fi'
    program.write_text(f"#!/bin/sh\n{script}\n")
    program.chmod(0o755)
    add_wheel("railfirst")
    with pytest.raises(RailExtractError, match="pip could not install pip"):
        install(Order(("railfirst",), ("railfirst",)), Interpreter(str(program)), folder, [], SILENT)


def test_failure_of_pytorch_lists_what_was_installed_before(add_wheel, folder, monkeypatch):
    add_wheel("railone")
    monkeypatch.setattr(package_folders, "own_folder", lambda: folder)
    monkeypatch.setitem(install_packages.BUILDS, ("CPU", sys.platform), ("--no-such-option",))
    with pytest.raises(
        RailExtractError, match=r"could not install torch .* No files were kept\. Already installed: railone 1\.0\.$"
    ):
        InstallPackages().compute(Job({"railone": "railone"}, "CPU"), None, SILENT)
    assert (folder / "railone.py").exists()
