"""The provider: the group of Rail Extract in the processing toolbox."""

from __future__ import annotations

from qgis.core import QgsProcessingProvider
from qgis.PyQt.QtGui import QIcon

from .algorithms import ALGORITHMS
from .paths import ICON


class RailExtractProvider(QgsProcessingProvider):
    """Offers every algorithm, also where packages they need are missing."""

    def id(self) -> str:
        """Give the identifier that scripts and models use; never changes."""
        return "railextract"

    def name(self) -> str:
        """Give the name shown in the toolbox."""
        return "Rail Extract"

    def icon(self) -> QIcon:
        """Give the icon shown in the toolbox."""
        return QIcon(str(ICON))

    def svgIconPath(self) -> str:
        """Give the same icon, for places that draw it themselves."""
        return str(ICON)

    def supportedOutputRasterLayerExtensions(self) -> list[str]:
        """Give the one format that rail rasters are written in."""
        return ["tif", "tiff"]

    def loadAlgorithms(self) -> None:
        """Create the algorithms."""
        for algorithm in ALGORITHMS:
            self.addAlgorithm(algorithm())
