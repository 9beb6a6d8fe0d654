"""Rail Extract: survey-grade 3D rails and track centerlines from classified lidar points."""


def classFactory(iface):  # noqa: N802 - the name QGIS calls
    """Build the plugin for QGIS.

    Parameters
    ----------
    iface : qgis.gui.QgisInterface or None
        None under ``qgis_process``.
    """
    from .rail_extract_plugin.plugin import RailExtractPlugin

    return RailExtractPlugin(iface)
