"""Small clouds in every layout that the readers know, to be damaged, and places in them."""

from __future__ import annotations

import json
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from unittest import mock

import laspy
import lazrs
import numpy as np
from laspy._compression import lazrsbackend
from rail_extract.core.clouds.crs import import_pyproj

RAIL = 10
"""Class of the points of all clouds."""

SHAPES = (
    '{"type": "Point", "coordinates": [500003, 3000001]}',
    '{"type": "LineString", "coordinates": [[500000, 3000000], [500009, 3000004]]}',
    '{"type": "Polygon", "coordinates": [[[500000, 3000000], [500009, 3000000], [500009, 3000009], [5e5, 3e6]]]}',
)
"""Seeds, a guide and a mask."""


@contextmanager
def chunks_of_any_size() -> Iterator[None]:
    """Have laspy write compressed points as COPC files hold them: in chunks of several sizes."""

    class Writer(lazrsbackend.LazrsPointWriter):
        def __init__(self, dest, point_format, parallel):
            super().__init__(dest, point_format, parallel=False)
            self.vlr = lazrs.LazVlr.new_for_compression(point_format.id, point_format.num_extra_bytes, True)

        def write_points(self, points):
            for part in (points[:70], points[70:2000], points[2000:]):
                super().write_points(part)
                self.compressor.finish_current_chunk()

    with mock.patch.object(lazrsbackend, "LazrsPointWriter", Writer):
        yield


def small_cloud(version: str, point_format: int) -> laspy.LasData:
    """Make a cloud of 300 points with a coordinate system, GPS times, a record and extra bytes."""
    header = laspy.LasHeader(version=version, point_format=point_format)
    header.scales, header.offsets = [0.001] * 3, [500_000, 3_000_000, 0]
    header.vlrs.append(laspy.VLR("someone", 7, "a record", b"x" * 40))
    header.add_crs(import_pyproj().CRS.from_epsg(32643))
    header.add_extra_dim(laspy.ExtraBytesParams(name="quality", type=np.float32))
    cloud = laspy.LasData(header)
    cloud.xyz = header.offsets + np.random.default_rng(1).uniform(0, 5, (300, 3))
    cloud.classification = np.full(300, RAIL, dtype=np.uint8)
    cloud.gps_time = 1e8 + 1e-6 * np.arange(300)
    if version == "1.4":
        cloud.evlrs = laspy.vlrs.vlrlist.VLRList([laspy.VLR("someone", 8, "a late record", b"y" * 90)])
    return cloud


def write_las(folder: Path) -> list[Path]:
    """Write LAS files of the oldest and the newest layout."""
    return _written(folder, "las", (("1.2", 1), ("1.3", 4), ("1.4", 7)))


def write_laz(folder: Path) -> list[Path]:
    """Write LAZ files of both compressors."""
    return _written(folder, "laz", (("1.2", 3), ("1.4", 6), ("1.4", 8)))


def write_copc(folder: Path) -> list[Path]:
    """Write LAZ files with chunks of several sizes."""
    with chunks_of_any_size():
        return _written(folder, "copc.laz", (("1.4", 6), ("1.4", 7)))


def write_vpc(folder: Path) -> list[Path]:
    """Write a virtual point cloud of two tiles, and the tiles."""
    tiles = _written(folder, "las", (("1.2", 1), ("1.4", 6)))
    items = [
        {"type": "Feature", "id": tile.stem, "assets": {"data": {"href": f"./{tile.name}", "roles": ["data"]}}}
        for tile in tiles
    ]
    path = folder / "all.vpc"
    path.write_text(json.dumps({"type": "FeatureCollection", "features": items}), encoding="utf-8")
    return [path]


def _written(folder: Path, suffix: str, layouts: tuple[tuple[str, int], ...]) -> list[Path]:
    paths = [folder / f"{version}_{point_format}.{suffix}" for version, point_format in layouts]
    for path, layout in zip(paths, layouts):
        small_cloud(*layout).write(path)
    return paths
