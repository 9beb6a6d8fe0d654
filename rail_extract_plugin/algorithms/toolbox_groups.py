"""The groups of the toolbox, which lists them by their labels."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Group:
    """A group: its identifier, which never changes, and its label."""

    id: str
    label: str


RAILS = Group("railsandtracks", "Rails and tracks")
ALIGNMENT = Group("alignment", "Alignment")
RAW_CLOUDS = Group("rawclouds", "Raw clouds")
STEPS = Group("singlesteps", "Single steps")
SETUP = Group("setup", "Setup")
