"""Where the plugin's own files lie."""

from __future__ import annotations

from pathlib import Path

RESOURCES = Path(__file__).resolve().parent.parent / "resources"
ICON = RESOURCES / "icons" / "rail_extract.svg"
STYLES = RESOURCES / "styles"
