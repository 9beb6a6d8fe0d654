"""The widget for the rail standard: a list by region, which begins with the standard of the last run.

QGIS imports this module when it shows a dialog; nothing else may, because there are no windows under ``qgis_process``.
"""

from __future__ import annotations

from qgis.core import QgsSettings
from qgis.gui import QgsProcessingGui

from ...core.standards import DETECT, STANDARDS
from ..notices import notices
from .choice_widget import ChoiceWidgetWrapper
from .choices import WORDS
from .standard_setting import LAST


class StandardWidgetWrapper(ChoiceWidgetWrapper):
    """Connects the list with the dialogs for one run, for a batch, and for a step of a model."""

    def entries(self) -> list[tuple[str, str]]:
        """Return the standards by region; other choices come first."""
        return described(self.parameterDefinition().options())

    def postInitialize(self, wrappers: list) -> None:
        """Begin with the standard of the last run, or let it be detected; values that are set later replace this.

        Only in the dialog for one run.
        """
        options, last = self.parameterDefinition().options(), QgsSettings().value(LAST)
        first = next((one for one in (last, DETECT) if one in options), None)
        if self.dialogType == QgsProcessingGui.WidgetType.Standard and first:
            self.setValue(first)

    def remember(self) -> None:
        """Keep the choice for the next dialog and the toolbar; to be called when a run has used it."""
        if isinstance(self.value(), str):
            QgsSettings().setValue(LAST, self.value())
            notices.standard_used.emit(self.value())


def described(names: list[str]) -> list[tuple[str, str]]:
    """Return the names of standards with their descriptions, sorted by these; other choices come first."""
    first = [(text, name) for name, text in WORDS["STANDARD"].items() if name in names]
    return first + sorted((STANDARDS[name].description, name) for name in names if name in STANDARDS)
