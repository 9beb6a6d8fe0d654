"""Simulated airborne clouds and their guides as files."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from ...core.clouds.las import laspy
from ...core.frame import LocalFrame
from ..scenes.las import las_data
from .flight import AirborneCloud

CRS, ORIGIN = "EPSG:25832", np.array([500_400.0, 5_500_400.0, 0.0])
"""Coordinate system of the files, and where the zero of a design lies in it."""

FRAME = LocalFrame(ORIGIN, crs_wkt=CRS)

GROUND = 2
"""Class of the points."""


def las_of(cloud: AirborneCloud, class_code: int = GROUND, frame: LocalFrame = FRAME) -> laspy.LasData:
    """Return a cloud as LAS 1.4, with a source id for each strip; the cloud has the zero of the frame."""
    xyz, crs, strips = frame.to_crs(cloud.xyz), str(frame.crs_wkt), cloud.strip + 1
    return las_data(xyz, crs, offsets=frame.origin, classification=class_code, point_source_id=strips)


def write_airborne(cloud: AirborneCloud, path: Path, class_code: int = GROUND, frame: LocalFrame = FRAME) -> None:
    """Write a cloud, compressed if the name ends in .laz; see `las_of`."""
    las_of(cloud, class_code, frame).write(path)


def write_guides(guides: Sequence[np.ndarray], path: Path, **stated: Sequence[str]) -> None:
    """Write guides, (k, 2) each, as GeoJSON, with the values of further fields, one for each guide."""
    features = [
        {
            "type": "Feature",
            "properties": {name: values[number] for name, values in stated.items()},
            "geometry": {"type": "LineString", "coordinates": (guide + ORIGIN[:2]).round(3).tolist()},
        }
        for number, guide in enumerate(guides)
    ]
    crs = {"type": "name", "properties": {"name": f"urn:ogc:def:crs:{CRS.replace(':', '::')}"}}
    collection = {"type": "FeatureCollection", "name": path.stem, "crs": crs, "features": features}
    path.write_text(json.dumps(collection), encoding="ascii")
