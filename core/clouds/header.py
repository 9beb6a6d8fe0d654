"""What a reader of point clouds returns, the header of a file and chunks of its points, and virtual point clouds.

A virtual point cloud (.vpc) is a STAC collection in JSON that names one file per item, as QGIS and PDAL write them.
"""

from __future__ import annotations

import json
import os
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from pathlib import Path, PurePosixPath
from typing import Union

import numpy as np

from ..errors import CloudError

Extent = tuple[float, float, float, float]
"""Smallest x, smallest y, largest x, largest y, in units of the CRS."""

Part = tuple[Callable[[Union[np.ndarray, slice]], np.ndarray], np.ndarray, np.ndarray, np.ndarray, bool]
"""A chunk of points: a function that returns the coordinates (k, 3) of some of them, classes (n,), marks (n,) and which
are valid (n,) bool, as in `Points`, and whether the file is read as a whole."""


@dataclass(frozen=True)
class CloudHeader:
    """What the header of a file states; the extent is smallest x and y, largest x and y in units of the CRS.

    `crs_wkt` is WKT 2; None if the file states no coordinate system that PROJ understands.
    """

    path: Path
    point_count: int
    extent: Extent
    crs_wkt: str | None


def list_tiles(catalogue: Path) -> tuple[Path, ...]:
    """List the tiles of a virtual point cloud; relative paths count from its folder.

    Raises CloudError if the file can't be read as a virtual point cloud, names no tiles, or names one that does not
    exist.
    """
    try:
        items = json.loads(catalogue.read_text(encoding="utf-8-sig"))["features"]
        # Other assets, such as the overview, repeat points of the tiles. Nothing is looked up a million times.
        hrefs = dict.fromkeys(item["assets"]["data"]["href"] for item in items)
        tiles = tuple(catalogue.parent / href for href in hrefs)
    except (ValueError, TypeError, KeyError, AttributeError, OSError, RecursionError) as error:
        raise CloudError(f"{catalogue.name} is not a virtual point cloud: build it again from its tiles.") from error
    if not tiles:
        raise CloudError(f"{catalogue.name} names no tiles: build it again from existing tiles.")
    for tile in tiles:
        if not os.path.exists(tile):  # noqa: PTH110 - Path.exists raises an error where a name is too long
            raise CloudError(f"{catalogue.name} names {tile}, which does not exist: build it again from its tiles.")
    return tiles


def catalogue_text(tiles: Iterable[tuple[str, int, Extent]], crs_wkt: str | None) -> str:
    """Return the text of a virtual point cloud, given href, point count and extent of each tile, and the common CRS."""
    features = [_feature(*tile, crs_wkt) for tile in tiles]
    return json.dumps({"type": "FeatureCollection", "features": features}, indent=1)


def _feature(href: str, point_count: int, extent: Extent, crs_wkt: str | None) -> dict:
    """Describe a tile as an item of STAC."""
    west, south, east, north = extent
    ring = [[west, south], [east, south], [east, north], [west, north], [west, south]]
    outline = {"type": "Polygon", "coordinates": [ring]}
    return {
        "type": "Feature",
        "stac_version": "1.0.0",
        "stac_extensions": [
            "https://stac-extensions.github.io/pointcloud/v1.0.0/schema.json",
            "https://stac-extensions.github.io/projection/v1.1.0/schema.json",
        ],
        "id": PurePosixPath(href).stem,
        "geometry": outline,
        "bbox": [west, south, east, north],
        "properties": {
            "datetime": None,
            "pc:count": point_count,
            "pc:type": "lidar",
            "pc:encoding": PurePosixPath(href).suffix,
            "proj:bbox": [west, south, east, north],
            "proj:geometry": outline,
            **({"proj:wkt2": crs_wkt} if crs_wkt else {}),
        },
        "links": [],
        "assets": {"data": {"href": href, "roles": ["data"]}},
    }
