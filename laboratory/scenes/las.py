"""Points as LAS, the same for the same points."""

from __future__ import annotations

from datetime import date
from pathlib import Path
from typing import Any

import numpy as np

from ...core.clouds.crs import parse_crs
from ...core.clouds.las import laspy

SCALE_M = 0.001
"""Resolution of the coordinates in the file: a millimetre, as scanners have."""

MADE = date(2025, 1, 1)
"""Date in the header of the file, fixed so that the same scene gives the same file."""


def las_data(
    xyz: np.ndarray,
    crs: str | None = None,
    *,
    offsets: np.ndarray | None = None,
    scales: float | list[float] = SCALE_M,
    point_format: int = 6,
    version: str = "",
    **dimensions: Any,
) -> laspy.LasData:
    """Return points, (n, 3), as LAS, with other values by the name of their dimension: (n,) each, or one for all.

    The coordinate system is WKT or a code. Without offsets, they are the whole numbers below the first point; without a
    version, it is 1.4 where the point format asks for it, else 1.2.
    """
    header = laspy.LasHeader(version=version or ("1.4" if point_format > 5 else "1.2"), point_format=point_format)
    header.scales = np.broadcast_to(scales, 3).astype(float)
    header.offsets = np.floor(xyz[0]) if offsets is None else offsets
    header.creation_date, header.generating_software = MADE, "Rail Extract scenes"
    if crs:
        header.add_crs(parse_crs(crs))
    points = laspy.LasData(header)
    points.x, points.y, points.z = xyz.T
    for name, values in dimensions.items():
        points[name] = np.broadcast_to(values, len(xyz))
    return points


def write_las(path: Path, xyz: np.ndarray, crs: str | None = None, **more: Any) -> Path:
    """Write points, compressed if the name ends in .laz; see `las_data`."""
    las_data(xyz, crs, **more).write(path)
    return path
