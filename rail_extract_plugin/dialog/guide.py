"""Addresses: of the guide, which is in the zip, of the repository, and of the tracker."""

from __future__ import annotations

from configparser import ConfigParser

from ..paths import GUIDE, METADATA, ROOT


def guide(page: str) -> str:
    """Return the address of a page of the guide: in the zip, or the text that it is made of in a clone."""
    shipped, source = GUIDE / f"{page}.html", ROOT / "docs" / f"{page}.md"
    return next((path.as_uri() for path in (shipped, source) if path.exists()), on_the_web(f"docs/{page}.md"))


def on_the_web(file: str) -> str:
    """Return the address of a file in the repository; empty until `repository` is filled in in `metadata.txt`."""
    repository = _metadata("repository")
    return f"{repository}/blob/main/{file}" if repository else ""


def tracker() -> str:
    """Return the address where errors are reported; empty until `tracker` is filled in in `metadata.txt`."""
    return _metadata("tracker")


def _metadata(key: str) -> str:
    """Return a value of the plugin's metadata."""
    metadata = ConfigParser(interpolation=None)
    metadata.read(METADATA, encoding="utf-8")
    return metadata["general"][key]
