"""Additional folders of Python packages: one in the user's profile, and those that the user names."""

from __future__ import annotations

import importlib
import os
import sys
from pathlib import Path

from qgis.core import QgsApplication, QgsSettings

VARIABLE = "RAIL_EXTRACT_PACKAGES"
"""Environment variable with additional folders, separated as in PATH; the setting of this name holds one folder."""

SETTING_KEY = f"Processing/Configuration/{VARIABLE}"
"""Key of the setting in the options of the processing framework."""


def own_folder() -> Path:
    """Return the folder in the profile for Install Packages; separate per Python version because of compiled code."""
    return (
        Path(QgsApplication.qgisSettingsDirPath()) / "python" / "rail_extract_packages" / sys.implementation.cache_tag
    )


def folders() -> list[Path]:
    """Return all folders in the order in which Python searches them."""
    named = [*os.environ.get(VARIABLE, "").split(os.pathsep), QgsSettings().value(SETTING_KEY) or ""]
    return [*(Path(name) for name in named if name), own_folder()]


def use() -> None:
    """Add the existing folders to the end of Python's path, so that no package of QGIS is replaced."""
    for folder in folders():
        if folder.is_dir() and str(folder) not in sys.path:
            sys.path.append(str(folder))
    importlib.invalidate_caches()
