"""Build the plugin's zip from the files that git tracks and the guide, and unpack it where QGIS finds it.

The same files give the same bytes: entries are sorted, without the times and permissions of this computer.
"""

from __future__ import annotations

import shutil
import subprocess
import zipfile
from pathlib import Path

from guide_pages import guide_files

ROOT = Path(__file__).resolve().parent.parent
ARCHIVE = ROOT / "build" / "rail_extract.zip"
PLUGINS = ROOT / "build" / "plugins"
PLUGIN = "rail_extract"

FILES = (
    "__init__.py",
    "__main__.py",
    "metadata.txt",
    "LICENSE",
    "README.md",
    "CHANGELOG.md",
    "requirements.txt",
)
FOLDERS = ("core", "models", "rail_extract_plugin", "resources")

EARLIEST = (1980, 1, 1, 0, 0, 0)
"""The earliest time in a zip."""

READABLE = 0o100644 << 16
"""A regular file that everyone may read, as a zip stores it."""


def product_files() -> list[str]:
    """Return the names of the tracked files in the plugin, relative to the root."""
    listing = ["git", "-c", f"safe.directory={ROOT}", "ls-files", "-z", "--", *FILES, *FOLDERS]
    names = subprocess.run(listing, cwd=ROOT, check=True, capture_output=True, text=True).stdout.split("\0")
    return sorted(name for name in names if name and (ROOT / name).is_file())


def build(archive: Path) -> None:
    """Write the zip."""
    archive.parent.mkdir(parents=True, exist_ok=True)
    with zipfile.ZipFile(archive, "w", zipfile.ZIP_DEFLATED, compresslevel=9) as file:
        contents = {**{name: (ROOT / name).read_bytes() for name in product_files()}, **guide_files()}
        for name, content in sorted(contents.items()):
            entry = zipfile.ZipInfo(f"{PLUGIN}/{name}", EARLIEST)
            entry.external_attr = READABLE
            entry.compress_type = zipfile.ZIP_DEFLATED
            file.writestr(entry, content)


def unpack(archive: Path, plugins: Path) -> None:
    """Unpack the plugin into a plugin folder, replacing an older one."""
    shutil.rmtree(plugins / PLUGIN, ignore_errors=True)
    with zipfile.ZipFile(archive) as file:
        file.extractall(plugins)


if __name__ == "__main__":
    build(ARCHIVE)
    unpack(ARCHIVE, PLUGINS)
