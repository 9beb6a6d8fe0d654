"""Where the guide lies: in the zip, or for a clone, where nothing was built, on the web."""

from __future__ import annotations

from configparser import ConfigParser

from ..paths import GUIDE, METADATA


def guide(page: str) -> str:
    """Give the address of a page of the guide: `tools/package.py` puts them into the zip."""
    shipped = GUIDE / f"{page}.html"
    if shipped.exists():
        return shipped.as_uri()
    return on_the_web(f"docs/{page}.md")


def on_the_web(file: str) -> str:
    """Give the address of a file in the repository that the plugin's metadata name."""
    metadata = ConfigParser(interpolation=None)
    metadata.read(METADATA, encoding="utf-8")
    return f"{metadata['general']['repository']}/blob/main/{file}"
