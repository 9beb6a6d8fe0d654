"""Virtual point clouds (.vpc): STAC collections in JSON that name one file per item, as QGIS and PDAL write them."""

from __future__ import annotations

import json
import os
from pathlib import Path

from ..errors import CloudError


def list_tiles(catalogue: Path) -> tuple[Path, ...]:
    """List the tiles of a virtual point cloud; relative paths count from its folder.

    Raises
    ------
    CloudError
        The file can't be read as a virtual point cloud, names no tiles, or names one that does not exist.
    """
    try:
        items = json.loads(catalogue.read_text(encoding="utf-8"))["features"]
        # Other assets, such as the overview, repeat points of the tiles.
        tiles = tuple(catalogue.parent / item["assets"]["data"]["href"] for item in items)
    except (ValueError, TypeError, KeyError, AttributeError, OSError, RecursionError) as error:
        raise CloudError(f"{catalogue.name} is not a virtual point cloud: build it again from its tiles.") from error
    if not tiles:
        raise CloudError(f"{catalogue.name} names no tiles: build it again from existing tiles.")
    for tile in tiles:
        if not os.path.exists(tile):  # noqa: PTH110 - Path.exists raises an error where a name is too long
            raise CloudError(f"{catalogue.name} names {tile}, which does not exist: build it again from its tiles.")
    return tiles
