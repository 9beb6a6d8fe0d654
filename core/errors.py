"""Errors of the core; each message is one sentence that says what is wrong and what to do."""

from __future__ import annotations


class RailExtractError(Exception):
    """Base of every error that a user can remedy."""


class CloudError(RailExtractError):
    """A point cloud file is missing, empty, damaged or no point cloud."""


class NoRailPointsError(RailExtractError):
    """The cloud has no point of the wanted classes."""


class CrsError(RailExtractError):
    """The coordinate reference system can't be computed in."""


class ParameterError(RailExtractError):
    """A parameter is out of range or contradicts another."""


class RasterError(RailExtractError):
    """A raster does not fit what the step expects of it."""


class ModelError(RailExtractError):
    """The network's weights are missing, damaged or don't fit the rail standard."""


class NoTrackError(RailExtractError):
    """Rails were found but no two of them make a track of the given gauge."""


class DiskError(RailExtractError):
    """A file can't be written, as on a full disk."""


class DeviceExhaustedError(Exception):
    """The device has too little memory for so many cells at once."""


class Cancelled(Exception):  # noqa: N818 - not an error: the user asked for it
    """The user cancelled the run."""
