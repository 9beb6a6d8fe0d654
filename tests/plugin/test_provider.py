from pathlib import Path

from qgis.PyQt.QtGui import QIcon


def test_toolbox_offers_the_algorithms(qgis, plugin):
    provider = qgis.processingRegistry().providerById("railextract")
    assert provider.name() == "Rail Extract"
    assert {algorithm.id() for algorithm in provider.algorithms()} == {
        f"railextract:{name}"
        for name in (
            "extractrails",
            "rasterizerailpoints",
            "frpdfcleanup",
            "vectorizerails",
            "buildtrackcenterlines",
            "measuretrackgeometry",
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


def test_every_parameter_explains_itself(plugin):
    for algorithm in plugin.provider.algorithms():
        assert algorithm.group() in ("Rails and tracks", "Setup")
        for definition in algorithm.parameterDefinitions():
            assert definition.isDestination() or definition.help(), (algorithm.id(), definition.name())


def test_unloading_takes_the_provider_away(qgis, plugin):
    registry = qgis.processingRegistry()
    plugin.unload()
    assert registry.providerById("railextract") is None
    plugin.initGui()
    assert registry.providerById("railextract") is not None
