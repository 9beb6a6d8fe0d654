import re
from pathlib import Path

import pytest
from qgis.PyQt.QtCore import QUrl
from qgis.PyQt.QtGui import QIcon, QImage


def test_toolbox_offers_the_algorithms(qgis, plugin):
    provider = qgis.processingRegistry().providerById("railextract")
    assert provider.name() == "Rail Extract"
    assert {algorithm.id() for algorithm in provider.algorithms()} == {
        f"railextract:{name}"
        for name in (
            "extractrails",
            "classifyrailpoints",
            "growrailpoints",
            "airbornecenterlines",
            "rasterizerailpoints",
            "frpdfcleanup",
            "vectorizerails",
            "buildtrackcenterlines",
            "measuretrackgeometry",
            "stationalongaxis",
            "fitalignment",
            "comparetracks",
            "exportalignment",
            "importalignment",
            "trainrailclassifier",
            "installpackages",
            "checkinstallation",
        )
    }


def test_icon_can_be_drawn(plugin):
    assert Path(plugin.provider.svgIconPath()).is_file()
    assert not QIcon(plugin.provider.icon()).pixmap(24, 24).isNull()


def test_algorithm_explains_itself(algorithm):
    assert algorithm.displayName() == "Extract rails"
    assert algorithm.group() == "Rails and tracks"
    assert "14 mm" in algorithm.shortHelpString()


@pytest.mark.parametrize("name", ["extractrails", "buildtrackcenterlines", "measuretrackgeometry"])
def test_help_shows_what_gauge_and_railhead_are(qgis, plugin, name):
    text = qgis.processingRegistry().createAlgorithmById(f"railextract:{name}").shortHelpString()
    (address,) = re.findall('<img src="(.*?)">', text)
    picture = QImage(QUrl(address).toLocalFile())
    assert 200 < picture.width() < 250  # width of the panel
    assert {picture.pixelColor(x, 50).name() for x in range(picture.width())} >= {"#1565c0", "#e64a19"}


def test_the_main_job_stands_apart_from_raw_clouds_and_single_steps(plugin):
    groups = {}
    for algorithm in plugin.provider.algorithms():
        groups.setdefault(algorithm.group(), set()).add(algorithm.name())
    assert groups["Rails and tracks"] == {"extractrails", "measuretrackgeometry"}
    assert groups["Raw clouds"] >= {"classifyrailpoints", "growrailpoints", "trainrailclassifier"}
    assert groups["Single steps"] == {"rasterizerailpoints", "frpdfcleanup", "vectorizerails", "buildtrackcenterlines"}
    assert groups["Setup"] == {"installpackages", "checkinstallation"}
    assert set(groups) <= {"Rails and tracks", "Alignment", "Raw clouds", "Single steps", "Setup"}


def test_every_parameter_explains_itself(plugin):
    for algorithm in plugin.provider.algorithms():
        for definition in algorithm.parameterDefinitions():
            assert definition.help(), (algorithm.id(), definition.name())


def test_unloading_takes_the_provider_away(qgis, plugin):
    registry = qgis.processingRegistry()
    plugin.unload()
    assert registry.providerById("railextract") is None
    plugin.initGui()
    assert registry.providerById("railextract") is not None
