"""The provider: Rail Extract in the Processing toolbox."""

from __future__ import annotations

from qgis.core import QgsProcessingProvider
from qgis.PyQt.QtGui import QIcon

from .algorithms import ALGORITHMS
from .paths import ICON


class RailExtractProvider(QgsProcessingProvider):
    """Lists all algorithms, even if packages that they need are missing."""

    def id(self) -> str:
        """Return the identifier for scripts and models; it never changes."""
        return "railextract"

    def name(self) -> str:
        """Return the name shown in the toolbox."""
        return "Rail Extract"

    def icon(self) -> QIcon:
        """Return the icon shown in the toolbox."""
        return QIcon(str(ICON))

    def svgIconPath(self) -> str:
        """Return the path of the icon, where QGIS draws it itself."""
        return str(ICON)

    def supportedOutputRasterLayerExtensions(self) -> list[str]:
        """Return the suffixes of the only format in which rail rasters are written."""
        return ["tif", "tiff"]

    def supportedOutputVectorLayerExtensions(self) -> list[str]:
        """Return the suffixes of the formats that keep heights, fields, coordinates and the coordinate system.

        DXF and CSV, which do not, are written for other programs; see `core.files.exchange`.
        """
        return ["gpkg", "shp", "geojson", "fgb", "gml", "dxf", "csv"]

    def loadAlgorithms(self) -> None:
        """Create the algorithms."""
        for algorithm in ALGORITHMS:
            self.addAlgorithm(algorithm())
