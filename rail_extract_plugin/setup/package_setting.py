"""The setting for an additional folder of Python packages, in the options of the processing framework."""

from __future__ import annotations

from processing.core.ProcessingConfig import ProcessingConfig, Setting
from qgis.PyQt.QtGui import QIcon

from ..paths import ICON
from .package_folders import VARIABLE

GROUP = "Rail Extract"


def register() -> None:
    """Show the setting; a change takes effect after a restart of QGIS."""
    ProcessingConfig.settingIcons[GROUP] = QIcon(str(ICON))
    description = "Additional folder of Python packages (takes effect after a restart)"
    ProcessingConfig.addSetting(Setting(GROUP, VARIABLE, description, "", valuetype=Setting.FOLDER))
    ProcessingConfig.readSettings()


def deregister() -> None:
    """Remove the setting; its value is kept."""
    ProcessingConfig.removeSetting(VARIABLE)
