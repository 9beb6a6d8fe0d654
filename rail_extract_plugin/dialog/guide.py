"""Addresses: of the guide, which is in the zip or, for a clone that was not built, on the web, and of the tracker."""

from __future__ import annotations

from configparser import ConfigParser

from ..paths import GUIDE, METADATA


def guide(page: str) -> str:
    """Return the address of a page of the guide; `tools/package.py` puts the pages into the zip."""
    shipped = GUIDE / f"{page}.html"
    if shipped.exists():
        return shipped.as_uri()
    return on_the_web(f"docs/{page}.md")


def on_the_web(file: str) -> str:
    """Return the address of a file in the repository named in the plugin's metadata."""
    return f"{_metadata('repository')}/blob/main/{file}"


def tracker() -> str:
    """Return the address where errors are reported."""
    return _metadata("tracker")


def _metadata(key: str) -> str:
    """Return a value of the plugin's metadata."""
    metadata = ConfigParser(interpolation=None)
    metadata.read(METADATA, encoding="utf-8")
    return metadata["general"][key]
