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
    """Return all folders in the order in which Python searches them.

    Names that are not absolute are left out: in the current folder, anybody's files may be found.
    """
    setting = QgsSettings().value(SETTING_KEY)
    # A comma in a settings file makes a list.
    named = [*os.environ.get(VARIABLE, "").split(os.pathsep), *(setting if isinstance(setting, list) else [setting])]
    return [*(Path(name) for name in named if isinstance(name, str) and Path(name).is_absolute()), own_folder()]


def use() -> None:
    """Add the existing folders to the end of Python's path, so that no package of QGIS is replaced."""
    for folder in folders():
        if _is_folder(folder) and str(folder) not in sys.path:
            sys.path.append(str(folder))
    importlib.invalidate_caches()


def _is_folder(path: Path) -> bool:
    """Return whether a folder exists, whatever the name consists of."""
    try:
        return path.is_dir()
    except (OSError, ValueError):  # too long, or without access
        return False
