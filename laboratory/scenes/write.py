"""Scenes as files: a LAZ cloud and its true lines; the command `python -m rail_extract scenes`."""

from __future__ import annotations

import argparse
import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ...core.clouds.crs import parse_crs
from ...core.errors import CloudError, ParameterError
from .catalogue import SCENES
from .las import write_las
from .raw import RawScene
from .scene import Scene

TRUTH_DECIMALS = 4
"""Decimals of the coordinates of true lines: a tenth of a millimetre."""

POINTS_PER_S = 500_000
"""Points that a scanner measures in a second."""

TONES = np.array(
    [90, 130, 70, 220, 60, 120, 150, 140, 170, 160, 110, 120, 40, 80, 100, 120], dtype=np.uint16
) * np.uint16(256)
"""Colour and intensity of each kind of point, see `raw_world.KINDS`: ballast is dark, railheads are bright."""


def write_cloud(scene: Scene, path: Path) -> None:
    """Write a scene as LAS 1.4, compressed if the name ends in .laz."""
    known = {"classification": scene.classification, "point_source_id": scene.strips, "gps_time": scene.times}
    _write(scene, path, 6, {**known, "intensity": scene.intensity})


def write_raw(scene: RawScene, path: Path) -> None:
    """Write a raw scene as LAS 1.4 without rail classes.

    A survey by images has colours and the classes of a ground filter, but no intensity and no time (format 2); a scan
    has intensities and times (format 6).
    """
    tone, of_images = TONES[scene.kind], scene.classification is not None
    known: dict[str, Any] = {"return_number": 1, "number_of_returns": 1, "point_source_id": scene.strips}
    if of_images:
        known.update(classification=scene.classification, red=tone, green=tone, blue=tone)
    else:
        times = np.arange(len(scene.xyz)) / POINTS_PER_S if scene.times is None else scene.times
        known.update(classification=1, intensity=tone, gps_time=times)
    _write(scene, path, 2 if of_images else 6, known)


def _write(scene: Scene | RawScene, path: Path, point_format: int, values: dict[str, Any]) -> None:
    """Write points with the values that are known."""
    known = {name: value for name, value in values.items() if value is not None}
    xyz, crs, offsets = scene.frame.to_crs(scene.xyz), scene.frame.crs_wkt, scene.frame.origin
    write_las(path, xyz, crs, offsets=offsets, version="1.4", point_format=point_format, **known)


def write_truth(scene: Scene, path: Path) -> None:
    """Write true rails and centerlines as GeoJSON in the coordinate system of the cloud."""
    lines = [("rail", line) for line in scene.rails] + [("centerline", line) for line in scene.centerlines]
    features = [json.dumps(_feature(scene, kind, line)) for kind, line in lines]
    head: dict[str, object] = {"type": "FeatureCollection", "name": path.stem}
    if scene.frame.crs_wkt:
        code = "::".join(parse_crs(scene.frame.crs_wkt).to_authority())
        head["crs"] = {"type": "name", "properties": {"name": f"urn:ogc:def:crs:{code}"}}
    text = json.dumps(head)[:-1] + ', "features": [\n' + ",\n".join(features) + "\n]}\n"
    path.write_text(text, encoding="ascii")


def _feature(scene: Scene, kind: str, line: np.ndarray) -> dict:
    coordinates = np.round(scene.frame.to_crs(line), TRUTH_DECIMALS).tolist()
    properties = {
        "kind": kind,
        "gauge_mm": round(scene.standard.gauge_m * 1000, 2),
        "head_mm": round(scene.standard.head_width_m * 1000, 2),
    }
    geometry = {"type": "LineString", "coordinates": coordinates}
    return {"type": "Feature", "properties": properties, "geometry": geometry}


def read_truth(path: Path, kind: str) -> tuple[np.ndarray, ...]:
    """Read the true lines of a kind, "rail" or "centerline": (n, 3) arrays in the coordinates of the cloud."""
    features = json.loads(path.read_text(encoding="ascii"))["features"]
    return tuple(
        np.array(feature["geometry"]["coordinates"]) for feature in features if feature["properties"]["kind"] == kind
    )


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments of the command."""
    parser.add_argument("scenes", nargs="*", metavar="SCENE", help=f"any of {', '.join(SCENES)}; all by default")
    parser.add_argument("--into", type=Path, default=Path(), help="folder to write to (default: here)")
    parser.add_argument("--name", help="name of the files, for a single scene (default: that of the scene)")
    parser.set_defaults(run=run)


def run(args: argparse.Namespace) -> None:
    """Write the chosen scenes, each as a cloud and a file of true lines.

    Raises ParameterError where a scene is unknown or a name is given for several scenes, CloudError where the folder
    cannot be written to.
    """
    names: Sequence[str] = args.scenes or tuple(SCENES)
    unknown = [name for name in names if name not in SCENES]
    if unknown:
        raise ParameterError(f"There is no scene {unknown[0]!r}: choose from {', '.join(SCENES)}.")
    if args.name and len(names) > 1:
        raise ParameterError("--name is for a single scene: name one scene, or leave --name out.")
    for name in names:
        scene = SCENES[name]()
        stem = args.name or name
        try:
            args.into.mkdir(parents=True, exist_ok=True)
            write_cloud(scene, args.into / f"{stem}.laz")
            write_truth(scene, args.into / f"{stem}_truth.geojson")
        except OSError as error:
            raise CloudError(f"The folder {args.into} cannot be written to ({error}): choose another.") from error
        print(f"{stem}.laz: {len(scene.xyz)} points, {len(scene.rails)} rails, {len(scene.centerlines)} tracks")
