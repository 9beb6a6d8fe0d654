"""The entry "Open the Sample": Extract Rails with the sample that comes with the plugin filled in."""

from __future__ import annotations

from .paths import SAMPLE
from .toolbox_action import ToolboxAction

PARAMETERS = {"INPUT": str(SAMPLE / "sample.laz"), "STANDARD": "IN_75R_1000"}
"""The sample, and the standard of its rails."""


class OpenSampleAction(ToolboxAction):
    """Opens the dialog with the sample; it is in the toolbox's context menu and in the menu of the plugin."""

    def __init__(self) -> None:
        super().__init__("Open the Sample…")

    def execute(self) -> None:
        """Open the dialog."""
        from .runs.run_dialog import open_dialog

        self.dialog = open_dialog("extractrails", PARAMETERS)
