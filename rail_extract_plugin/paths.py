"""Paths of the plugin's own files."""

from __future__ import annotations

from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
METADATA = ROOT / "metadata.txt"
RESOURCES = ROOT / "resources"
MODEL = ROOT / "models" / "extract_rails.model3"
ICONS = RESOURCES / "icons"
ICON = ICONS / "rail_extract.svg"
SAMPLE = RESOURCES / "sample"
STYLES = RESOURCES / "styles"
PICTURES = RESOURCES / "help"
GUIDE = RESOURCES / "guide"


def is_sample(path: str) -> bool:
    """Return whether a path leads to the sample cloud, a demonstration that is nobody's survey."""
    return bool(path) and SAMPLE in Path(path).resolve().parents
