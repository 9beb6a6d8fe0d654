import sys

import pytest
from qgis.core import QgsApplication, QgsSettings
from rail_extract.rail_extract_plugin.algorithms import ALGORITHMS
from rail_extract.rail_extract_plugin.setup import package_folders


@pytest.fixture
def clean_path(monkeypatch, qgis):
    monkeypatch.setattr(sys, "path", list(sys.path))
    monkeypatch.delenv("RAIL_EXTRACT_PACKAGES", raising=False)
    yield
    QgsSettings().remove(package_folders.SETTING_KEY)


def test_own_folder_is_in_the_profile(clean_path):
    folder = package_folders.own_folder()
    assert str(folder).startswith(QgsApplication.qgisSettingsDirPath())
    assert folder.name == f"cpython-{sys.version_info[0]}{sys.version_info[1]}"
    assert package_folders.folders() == [folder]


NAMES = ["/" + 5000 * "x", "/x" * 3000, "\udcff/\udcfe", "relative", ".", ":::", "~", "/etc/passwd", "/proc/1/cwd/x"]
VALUES = ["", ["/a", "b"], {"a": 1}, 5, True, 2.5, "/" + 5000 * "x", "\0", None]


@pytest.mark.parametrize(("names", "value"), list(zip(NAMES, VALUES)))
def test_no_value_stops_the_plugin(plugin, clean_path, monkeypatch, names, value):
    plugin.unload()
    monkeypatch.setenv("RAIL_EXTRACT_PACKAGES", names)
    QgsSettings().setValue(package_folders.SETTING_KEY, value)
    before = list(sys.path)
    plugin.initProcessing()
    assert len(plugin.provider.algorithms()) == len(ALGORITHMS)
    assert sys.path == before


def test_folders_from_the_variable_and_the_setting(clean_path, monkeypatch, tmp_path):
    named = [tmp_path / name for name in ("one", "two", "three", "gone")]
    for folder in named[:3]:
        folder.mkdir()
    monkeypatch.setenv("RAIL_EXTRACT_PACKAGES", f"{named[0]}:{named[3]}:{named[1]}")
    QgsSettings().setValue(package_folders.SETTING_KEY, str(named[2]))
    before = list(sys.path)
    package_folders.use()
    package_folders.use()
    assert sys.path == [*before, str(named[0]), str(named[1]), str(named[2])]


def test_packages_of_qgis_come_first(clean_path, monkeypatch, tmp_path):
    (tmp_path / "numpy.py").write_text("")
    (tmp_path / "railfirst.py").write_text("")
    monkeypatch.setenv("RAIL_EXTRACT_PACKAGES", str(tmp_path))
    package_folders.use()
    from rail_extract.rail_extract_plugin.setup.dependencies import find_spec, is_installed

    assert is_installed("railfirst")
    assert find_spec("numpy").origin != str(tmp_path / "numpy.py")


def test_setting_is_listed_with_those_of_the_providers(plugin, clean_path, tmp_path):
    from processing.core.ProcessingConfig import ProcessingConfig

    plugin.unload()
    plugin.initGui()
    ProcessingConfig.setSettingValue("RAIL_EXTRACT_PACKAGES", str(tmp_path))
    assert package_folders.folders()[0] == tmp_path
    assert ProcessingConfig.settings["RAIL_EXTRACT_PACKAGES"].group == plugin.provider.name()
    plugin.unload()
    assert "RAIL_EXTRACT_PACKAGES" not in ProcessingConfig.settings
    plugin.initProcessing()
