"""Where the guide lies on the web."""

from __future__ import annotations

from configparser import ConfigParser

from .paths import METADATA


def guide(page: str) -> str:
    """Give the address of a page of the guide, in the repository that the plugin's metadata name."""
    metadata = ConfigParser(interpolation=None)
    metadata.read(METADATA, encoding="utf-8")
    return f"{metadata['general']['repository']}/blob/main/docs/{page}"
