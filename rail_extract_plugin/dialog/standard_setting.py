"""The setting that keeps the rail standard of the last run in a dialog."""

from __future__ import annotations

LAST = "rail_extract/standard"
"""Key of the setting."""
