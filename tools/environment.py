"""Print the lines that let any shell run the plugin in qgis_process, with a profile of its own under build/."""

from __future__ import annotations

import shlex
import shutil
import sys
import sysconfig
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
BUILD = ROOT / "build"


def environment() -> dict[str, str]:
    """Variables that qgis_process needs, by name.

    Raises
    ------
    SystemExit
        There is no qgis_process.
    """
    # Debian 12's wrapper passes an option that its own program refuses.
    qgis_process = shutil.which("qgis_process.bin") or shutil.which("qgis_process")
    if qgis_process is None:
        sys.exit("QGIS has no qgis_process on the PATH: install the distribution's package qgis.")
    return {
        "QGIS_PROCESS": qgis_process,
        "QGIS_PLUGINPATH": str(BUILD / "plugins"),
        "QGIS_CUSTOM_CONFIG_PATH": str(BUILD / "profile"),
        "PYTHONPATH": sysconfig.get_path("purelib"),
        # pyproj looks for PROJ's data beside its Python, which in a virtual environment is the wrong place.
        "PROJ_DATA": str(Path(sys.base_prefix) / "share" / "proj"),
        "QT_QPA_PLATFORM": "offscreen",
        "XDG_RUNTIME_DIR": str(BUILD / "runtime"),
    }


if __name__ == "__main__":
    for folder in ("plugins", "profile", "runtime"):
        (BUILD / folder).mkdir(mode=0o700, parents=True, exist_ok=True)
    for name, value in environment().items():
        print(f"export {name}={shlex.quote(value)}")
