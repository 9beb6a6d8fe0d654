"""The parameter for a point cloud: a layer, a file, a folder of files or a virtual point cloud.

QGIS's own refuses paths that its build cannot open, and its button offers neither LAZ files nor folders.
"""

from __future__ import annotations

from typing import Any

from qgis.core import (
    QgsProcessingContext,
    QgsProcessingParameterDefinition,
    QgsProcessingParameterFile,
    QgsProcessingParameterPointCloudLayer,
)

SUFFIXES = ("las", "laz", "vpc")
"""Suffixes of the files that can be read; COPC files end in .copc.laz."""

WIDGET = {"widget_wrapper": {"class": f"{__package__}.cloud_widget.CloudWidgetWrapper"}}
"""Metadata by which QGIS finds the widget. Models contain it: the class never changes its place."""


class CloudParameter(QgsProcessingParameterPointCloudLayer):
    """A point cloud layer or a path, with a widget of its own."""

    def __init__(self, name: str, description: str, optional: bool = False) -> None:
        super().__init__(name, description, None, optional)
        self.setMetadata(WIDGET)

    def checkValueIsAcceptable(self, value: Any, context: QgsProcessingContext | None = None) -> bool:
        """Accept whatever names something: the algorithm checks it and explains what is wrong with it."""
        return value not in (None, "") or bool(self.flags() & QgsProcessingParameterDefinition.Flag.FlagOptional)

    def createFileFilter(self) -> str:
        """Return the filter for the batch dialog's selection of files."""
        return file_filter()


def model_input(cloud: QgsProcessingParameterDefinition) -> QgsProcessingParameterFile:
    """Return a cloud's parameter as the input of a model, which can't hold classes of Python.

    It takes the same values, of layers their id.
    """
    made = QgsProcessingParameterFile(cloud.name(), cloud.description())
    made.setHelp(cloud.help())
    made.setFileFilter(file_filter())
    made.setMetadata(WIDGET)
    return made


def file_filter() -> str:
    """Return the filter for dialogs in which a cloud is selected."""
    patterns = " ".join(f"*.{suffix} *.{suffix.upper()}" for suffix in SUFFIXES)
    return f"{'Point clouds'} ({patterns});;{'All files'} (*)"
