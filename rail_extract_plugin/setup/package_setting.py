"""The folder of further Python packages, among the providers' settings in the options of the processing framework."""

from __future__ import annotations

from processing.core.ProcessingConfig import ProcessingConfig, Setting
from qgis.PyQt.QtGui import QIcon

from ..i18n import tr
from ..paths import ICON
from .package_folders import VARIABLE

GROUP = "Rail Extract"


def register() -> None:
    """Show the setting; a change counts from the next start of QGIS."""
    ProcessingConfig.settingIcons[GROUP] = QIcon(str(ICON))
    description = tr("Folder of further Python packages (after a restart)")
    ProcessingConfig.addSetting(Setting(GROUP, VARIABLE, description, "", valuetype=Setting.FOLDER))
    ProcessingConfig.readSettings()


def deregister() -> None:
    """Take the setting away; its value stays."""
    ProcessingConfig.removeSetting(VARIABLE)
