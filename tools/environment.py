"""Print shell lines that set up qgis_process with the plugin and a separate profile under build/."""

from __future__ import annotations

import shlex
import shutil
import sys
import sysconfig
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
BUILD = ROOT / "build"


def environment() -> dict[str, str]:
    """Return the variables that qgis_process needs, by name; raises SystemExit without one."""
    # The wrapper in Debian 12 passes an option that its program refuses.
    qgis_process = shutil.which("qgis_process.bin") or shutil.which("qgis_process")
    if qgis_process is None:
        sys.exit("QGIS has no qgis_process on the PATH: install the distribution's package qgis.")
    return {
        "QGIS_PROCESS": qgis_process,
        "QGIS_PLUGINPATH": str(BUILD / "plugins"),
        "QGIS_CUSTOM_CONFIG_PATH": str(BUILD / "profile"),
        "PYTHONPATH": sysconfig.get_path("purelib"),
        # pyproj looks for the data of PROJ next to its Python, which is the wrong place in a virtual environment.
        "PROJ_DATA": str(Path(sys.base_prefix) / "share" / "proj"),
        "QT_QPA_PLATFORM": "offscreen",
        "XDG_RUNTIME_DIR": str(BUILD / "runtime"),
    }


if __name__ == "__main__":
    for folder in ("plugins", "profile", "runtime"):
        (BUILD / folder).mkdir(mode=0o700, parents=True, exist_ok=True)
    for name, value in environment().items():
        print(f"export {name}={shlex.quote(value)}")
