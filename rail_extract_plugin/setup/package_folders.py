"""Folders of Python packages beside QGIS's own: one in the user's profile, and those that the user names."""

from __future__ import annotations

import importlib
import os
import sys
from pathlib import Path

from qgis.core import QgsApplication, QgsSettings

VARIABLE = "RAIL_EXTRACT_PACKAGES"
"""Environment variable that names further folders, apart as in PATH; the setting of the same name names one."""

SETTING_KEY = f"Processing/Configuration/{VARIABLE}"
"""Where the options of the processing framework keep the setting."""


def own_folder() -> Path:
    """Folder in the profile that Install Packages fills: one for each version of Python, since compiled code is."""
    return (
        Path(QgsApplication.qgisSettingsDirPath()) / "python" / "rail_extract_packages" / sys.implementation.cache_tag
    )


def folders() -> list[Path]:
    """All folders, in the order in which packages are looked for."""
    named = [*os.environ.get(VARIABLE, "").split(os.pathsep), QgsSettings().value(SETTING_KEY) or ""]
    return [*(Path(name) for name in named if name), own_folder()]


def use() -> None:
    """Let Python find packages in the folders that exist; after QGIS's own, so that none of those is replaced."""
    for folder in folders():
        if folder.is_dir() and str(folder) not in sys.path:
            sys.path.append(str(folder))
    importlib.invalidate_caches()
