"""Errors of the core. Each message is one sentence that states what is wrong and what to do."""

from __future__ import annotations


class RailExtractError(Exception):
    """Base class of the errors that a user can put right."""


class CloudError(RailExtractError):
    """A point cloud file is missing, empty, damaged or not a point cloud."""


class EmptyCloudError(CloudError):
    """A file has no points: a reason to leave it out, but not to refuse the other tiles of a folder."""


class NoRailPointsError(RailExtractError):
    """The cloud has no points of the rail classes."""


class UnclassifiedError(NoRailPointsError):
    """The cloud has points, but none of the rail classes: perhaps nobody has classified it."""


class CrsError(RailExtractError):
    """Lengths can't be computed in the coordinate system, or it is unknown."""


class ParameterError(RailExtractError):
    """A parameter is out of range or contradicts another."""


class MissingError(ParameterError):
    """A layer has no feature of the kind that a parameter needs.

    >>> str(MissingError("AXIS", "line"))
    'AXIS has no lines: give a line layer.'
    """

    def __init__(self, name: str, kind: str) -> None:
        super().__init__(f"{name} has no {kind}s: give a {kind} layer.")


class OffRailError(RailExtractError):
    """No seed is on a rail."""


class OffCloudError(ParameterError):
    """No seed is in the cloud."""


class RasterError(RailExtractError):
    """A raster does not meet the requirements of a step."""


class AlignmentFileError(RailExtractError):
    """A file of alignments is missing, damaged or states what can't be read."""


class DesignNumberError(RailExtractError):
    """A number of a design, or of what is placed by one, is not one that a railway has."""


class ModelError(RailExtractError):
    """The network's weights are missing, are damaged or don't fit the rail standard."""


class NoTrackError(RailExtractError):
    """Rails were found, but no two of them form a track of the given gauge."""


class DiskError(RailExtractError):
    """A file can't be written, for example because the disk is full."""


class WorkerError(RailExtractError):
    """A process that is to execute tasks has ended, or has another version."""


class DeviceExhaustedError(Exception):
    """The device does not have enough memory for the cells given to it at once."""


class Cancelled(Exception):  # noqa: N818 - not an error: the user asked for it
    """The user cancelled the run."""
