from pathlib import Path

from qgis.PyQt.QtGui import QIcon


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
