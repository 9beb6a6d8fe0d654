"""Evaluate this project on open clouds of real railways that anyone can download: RailCloud-HdF and SemanticRail3D-V2.

Run `python benchmarks/open_data.py FOLDER`; docs/open_data.md says what to download and how to read the tables. The
names of the files show which data set they are of; other labelled clouds need --rail-class and --standard.
"""

from __future__ import annotations

import argparse
import re
import sys
import time
from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from itertools import combinations, groupby
from pathlib import Path

import numpy as np
from rail_extract.core.checks.standard import measure_spacings
from rail_extract.core.classify.settings import Settings
from rail_extract.core.clouds.las import laspy
from rail_extract.core.clouds.on_heads import on_heads
from rail_extract.core.clouds.points import RailPoints
from rail_extract.core.errors import ParameterError, RailExtractError
from rail_extract.core.frame import LocalFrame
from rail_extract.core.learned.model import SHIPPED
from rail_extract.core.parameters import Parameters
from rail_extract.core.pipeline import extract_rails
from rail_extract.core.rails import RailLine
from rail_extract.core.standards import RAIL_CLASS, RailStandard, closest_standard, resolve
from rail_extract.laboratory.ruler.agreement import HEADER, agreement
from rail_extract.laboratory.ruler.lines import cut
from rail_extract.laboratory.ruler.whole_clouds import classify_cloud
from scipy.spatial import cKDTree

CELL_M = 0.25
"""Side of the cells in which lines are looked for."""

NEAR_M = 0.10
"""A line is right within this distance of labelled points: people label to some centimetres."""

ON_HEAD_M, BELOW_M, ON_TOP_M = 0.06, 0.012, 0.02
"""Points within the first distance of a line, and not deeper below it than the second, give its error across.

The sides of a head, of which a scanner sees one, are deeper. Points within the third give its error in height.
"""

PLACES = 20
"""Places that are evaluated by default."""


@dataclass(frozen=True)
class DataSet:
    """How the files of a data set are named, with the groups `run` and `part`, and labelled.

    `files_in_place` next to each other are evaluated together; registered runs have the same coordinates.
    """

    name: str
    file: re.Pattern[str]
    rail_class: int
    standard: str
    files_in_place: int
    registered: bool


DATA_SETS = (
    DataSet("RailCloud-HdF", re.compile(r"(?P<run>ACQ_.+)_(?P<part>\d+\+\d+)_\d+\+\d+"), 5, "EN_60E1_1435", 2, True),
    DataSet("SemanticRail3D-V2", re.compile(r"(?P<run>cloud\d+)_Seg(?P<part>\d+)"), 1, "EN_60E1_1668", 5, False),
)

ANY = DataSet("labelled clouds", re.compile(r"(?P<run>.+?)(?P<part>)"), RAIL_CLASS, "", 1, True)
"""Files of other names: each is a run and a place of its own."""


@dataclass(frozen=True)
class Place:
    """Files that are evaluated together."""

    run: str
    name: str
    files: tuple[Path, ...]


@dataclass(frozen=True)
class Result:
    """What was measured at a place, or at several: numbers add up, arrays are strung together.

    Attributes
    ----------
    points, labelled, heads, labelled_heads, found, right : int
        Points; those that are labelled as rail; labelled ones on heads; those of them that were found; points that were
        found; those of them that are labelled.
    of_class : (256,) int array
        Points that were found, by their class in the file.
    cells, cells_right : int
        Cells with labelled points, and those that a line crosses.
    rails_m, right_m, tracks_m : float
        Length of the rails, of what lies on labelled points, and of the centerlines.
    across_m, height_m, gauge_mm : (n,) array
        Line minus labelled points in each metre, and gauge at each metre of track.
    label_s, line_s : float
        Processor time.
    """

    points: int
    labelled: int
    heads: int
    labelled_heads: int
    found: int
    right: int
    of_class: np.ndarray
    cells: int
    cells_right: int
    rails_m: float
    right_m: float
    tracks_m: float
    across_m: np.ndarray
    height_m: np.ndarray
    gauge_mm: np.ndarray
    label_s: float
    line_s: float

    def __add__(self, other: Result) -> Result:
        both = ((field.name, getattr(self, field.name), getattr(other, field.name)) for field in fields(self))
        strung = ("across_m", "height_m", "gauge_mm")
        return Result(**{name: np.append(one, more) if name in strung else one + more for name, one, more in both})


@dataclass(frozen=True)
class Visit:
    """The rails of a run at a place: lines in the coordinates of the files."""

    run: str
    rails: tuple[RailLine, ...]


def main(words: Sequence[str] | None = None) -> None:
    """Print a row for each place, the sum, and how well runs that cover the same rails agree."""
    arguments = parsed(words)
    try:
        data, places = find_places(arguments.folder)
        data = replace(
            data, rail_class=arguments.rail_class or data.rail_class, standard=arguments.standard or data.standard
        )
        standard = chosen_standard(data)
        if arguments.repeated:
            places = covered_twice(places)
        weights = SHIPPED if arguments.learned else None
        evaluate(data, standard, spread(places, arguments.places), weights, arguments.labelled)
    except RailExtractError as error:
        sys.exit(str(error))


def parsed(words: Sequence[str] | None) -> argparse.Namespace:
    """Read the command line."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path, metavar="FOLDER", help="with LAS or LAZ files, also in folders below")
    parser.add_argument("--places", type=int, default=PLACES, help=f"to evaluate, evenly chosen; 0: all ({PLACES})")
    parser.add_argument("--repeated", action="store_true", help="only places that another run covers as well")
    parser.add_argument("--rail-class", type=int, help="class of rail points in the files")
    parser.add_argument("--standard", help="rail standard, such as EN_60E1_1435")
    parser.add_argument("--learned", action="store_true", help="find the points by the shipped network")
    parser.add_argument("--labelled", action="store_true", help="take the labelled points instead of finding any")
    return parser.parse_args(words)


def find_places(folder: Path) -> tuple[DataSet, list[Place]]:
    """Recognize the data set by the names of the files, and group the files of each place.

    Raises ParameterError if the folder has no point clouds.
    """
    paths = sorted(path for path in folder.rglob("*") if path.suffix.lower() in (".las", ".laz"))
    if not paths:
        raise ParameterError(
            f"{folder} has no LAS or LAZ files: name the folder into which the archives were unpacked."
        )
    for data in (*DATA_SETS, ANY):
        named = [(match, path) for path in paths if (match := data.file.fullmatch(path.stem))]
        if named:
            break
    keyed = sorted((match["run"], int(re.sub(r"\D", "", match["part"]) or 0), path) for match, path in named)
    places = []
    for run, group in groupby(keyed, key=lambda one: one[0]):
        files = [path for _, _, path in group]
        for first in range(0, len(files), data.files_in_place):
            chosen = tuple(files[first : first + data.files_in_place])
            places.append(Place(run, chosen[0].stem, chosen))
    return data, places


def chosen_standard(data: DataSet) -> RailStandard:
    """Look up the rail standard; raises ParameterError if none is known for these files, or its name is unknown."""
    if not data.standard:
        raise ParameterError(
            "The names of the files are those of neither RailCloud-HdF nor SemanticRail3D: give --standard and "
            "--rail-class."
        )
    return resolve(data.standard)


def spread(places: list[Place], count: int) -> list[Place]:
    """Choose some places evenly; all of them if `count` is 0."""
    if not 0 < count < len(places):
        return places
    return [places[number] for number in np.linspace(0, len(places) - 1, count).astype(int)]


def covered_twice(places: list[Place]) -> list[Place]:
    """Return the places whose extent meets that of a place of another run; raises ParameterError if there are none."""
    boxes = []
    for place in places:
        headers = [_header(path) for path in place.files]
        boxes.append((np.min([one.mins for one in headers], axis=0), np.max([one.maxs for one in headers], axis=0)))
    chosen: set[int] = set()
    for one, other in combinations(range(len(places)), 2):
        low, high = np.maximum(boxes[one][0], boxes[other][0]), np.minimum(boxes[one][1], boxes[other][1])
        if places[one].run != places[other].run and (low < high).all():
            chosen |= {one, other}
    if not chosen:
        raise ParameterError("No place is covered by two runs: unpack runs that meet, such as those to and from Don.")
    return [places[number] for number in sorted(chosen)]


def _header(path: Path) -> laspy.LasHeader:
    with laspy.open(path) as reader:
        return reader.header


def evaluate(
    data: DataSet, standard: RailStandard, places: Sequence[Place], weights: Path | None, labelled: bool
) -> None:
    """Measure places one after another, and print what was measured."""
    print(f"{data.name}: {len(places)} places, class {data.rail_class} is rail, {standard.name}")
    print(
        f"{'place':<44}{'Mio':>6}{'recall':>8}{'prec.':>7}{'IoU':>7}{'found %':>9}{'right %':>9}{'across':>8}"
        f"{'height':>8}{'gauge':>9}{'rails m':>9}{'tracks m':>10}{'s/Mio':>7}  detected"
    )
    total: Result | None = None
    visits = []
    for place in places:
        xyz, classes = read(place)
        rail = classes == data.rail_class
        result, visit = measure(place, xyz, classes, rail, standard, weights, labelled)
        print(row(place.name, result, detected(xyz[rail])), flush=True)
        visits.append(visit)
        total = result if total is None else total + result
    if total is not None:
        print(row("all", total, ""))
        warn_of_class(total, data.rail_class)
    if data.registered:
        print_repeated(visits)


def read(place: Place) -> tuple[np.ndarray, np.ndarray]:
    """Read the files of a place: (n, 3) coordinates, and classes, (n,)."""
    clouds = [laspy.read(path) for path in place.files]
    xyz = np.concatenate([np.column_stack([cloud.x, cloud.y, cloud.z]) for cloud in clouds])
    extra = [set(cloud.point_format.extra_dimension_names) for cloud in clouds]
    names = ["class" if "class" in own else "classification" for own in extra]
    return xyz, np.concatenate([np.asarray(cloud[name], dtype=np.uint8) for cloud, name in zip(clouds, names)])


def measure(
    place: Place,
    xyz: np.ndarray,
    classes: np.ndarray,
    rail: np.ndarray,
    standard: RailStandard,
    weights: Path | None,
    labelled: bool,
) -> tuple[Result, Visit]:
    """Find rail points, unless the labelled ones are taken, and rails at a place, and compare them with the labels."""
    start, found = time.process_time(), rail
    if not labelled:
        found = classify_cloud(xyz, Settings((standard.gauge_m,), standard.head_width_m, weights=weights)).rail
    classified = time.process_time()
    frame = LocalFrame(np.floor(xyz.min(axis=0)))
    rails, tracks_m, gauge_mm = draw(xyz[found], frame, standard, not labelled)
    drawn = time.process_time()
    heads = np.flatnonzero(rail)[on_heads(frame.to_local(xyz[rail]))]
    cells, cells_right, pieces_m, across_m, height_m = compare(rails, xyz[heads])
    result = Result(
        points=len(xyz),
        labelled=int(rail.sum()),
        heads=len(heads),
        labelled_heads=int(found[heads].sum()),
        found=int(found.sum()),
        right=int((found & rail).sum()),
        of_class=np.bincount(classes[found], minlength=256),
        cells=cells,
        cells_right=cells_right,
        rails_m=sum(one.length_m for one in rails),
        right_m=pieces_m,
        tracks_m=tracks_m,
        across_m=across_m,
        height_m=height_m,
        gauge_mm=gauge_mm,
        label_s=classified - start,
        line_s=drawn - classified,
    )
    return result, Visit(place.run, rails)


def draw(
    xyz: np.ndarray, frame: LocalFrame, standard: RailStandard, found: bool
) -> tuple[tuple[RailLine, ...], float, np.ndarray]:
    """Draw rails in the coordinates of the files, with the length of the tracks and their gauge at each metre."""
    if not len(xyz):
        return (), 0.0, np.empty(0)
    parameters = Parameters(standard.gauge_m, standard.head_width_m, quality_step_m=1.0)
    network = extract_rails([RailPoints(frame.to_local(xyz), frame, RAIL_CLASS, found=found)], parameters)
    rails = tuple(replace(one, xyz=network.frame.to_crs(one.xyz)) for one in network.rails)
    gauges = [track.gauge_mm[~track.bridged & np.isfinite(track.gauge_mm)] for track in network.geometry]
    return rails, sum(one.length_m for one in network.centerlines), np.concatenate([np.empty(0), *gauges])


def compare(rails: Sequence[RailLine], heads: np.ndarray) -> tuple[int, int, float, np.ndarray, np.ndarray]:
    """Compare lines with labelled points on heads, (n, 3); differences are as in `Result`."""
    cells = np.floor(heads[:, :2] / CELL_M).astype(np.int64)
    count = len(np.unique(cells, axis=0))
    chords = cut([one.xyz for one in rails])
    if not len(chords.start) or not len(heads):
        return count, 0, 0.0, np.empty(0), np.empty(0)
    feet, number = chords.nearest(heads)
    off = heads - feet
    near = np.hypot(off[:, 0], off[:, 1]) <= NEAR_M
    distance, _ = cKDTree(heads[:, :2]).query(chords.middle[:, :2])
    across = -np.sum(off[:, :2] * chords.left[number], axis=1)
    metre = np.column_stack([chords.number, np.floor(chords.middle_t)])[number]
    return (
        count,
        len(np.unique(cells[near], axis=0)),
        float(chords.lengths[distance <= NEAR_M].sum()),
        medians(metre, across, (np.abs(across) <= ON_HEAD_M) & (off[:, 2] >= -BELOW_M)),
        medians(metre, -off[:, 2], np.abs(across) <= ON_TOP_M),
    )


def medians(group: np.ndarray, values: np.ndarray, chosen: np.ndarray) -> np.ndarray:
    """Medians of chosen values, (n,), by group, (n, 2)."""
    if not chosen.any():
        return np.empty(0)
    _, number = np.unique(group[chosen], axis=0, return_inverse=True)
    order = np.argsort(number.ravel(), kind="stable")
    borders = np.flatnonzero(np.diff(number.ravel()[order])) + 1
    return np.array([np.median(part) for part in np.split(values[chosen][order], borders)])


def detected(xyz: np.ndarray) -> str:
    """Name of the rail standard that labelled points show, as DETECT finds it; a dash if they show none."""
    measured = measure_spacings(xyz - xyz.mean(axis=0)).most_common() if len(xyz) else None
    standard = closest_standard(*measured) if measured else None
    return standard.name if standard else "-"


def row(name: str, one: Result, standard: str) -> str:
    """Format what was measured."""
    together = one.labelled + one.found - one.right
    millions = one.points / 1e6
    return (
        f"{name:<44}{millions:>6.1f}{share(one.labelled_heads, one.heads, 3):>8}{share(one.right, one.found, 3):>7}"
        f"{share(one.right, together, 3):>7}{share(100 * one.cells_right, one.cells, 1):>9}"
        f"{share(100 * one.right_m, one.rails_m, 1):>9}{rms_mm(one.across_m):>8}{rms_mm(one.height_m):>8}"
        f"{median(one.gauge_mm):>9}{one.rails_m:>9.0f}{one.tracks_m:>10.0f}"
        f"{share(one.label_s + one.line_s, millions, 2):>7}  {standard}"
    )


def share(part: float, whole: float, digits: int) -> str:
    """Format a quotient; a dash where there is nothing to divide by."""
    return f"{part / whole:.{digits}f}" if whole else "-"


def rms_mm(values_m: np.ndarray) -> str:
    """Format a root mean square in millimetres."""
    return f"{1000 * np.sqrt(np.mean(values_m**2)):.1f}" if len(values_m) else "-"


def median(values: np.ndarray) -> str:
    """Format a median."""
    return f"{np.median(values):.1f}" if len(values) else "-"


def warn_of_class(total: Result, rail_class: int) -> None:
    """Say if most points that were found have another class than rail."""
    most = int(np.argmax(total.of_class))
    if total.found and most != rail_class and total.of_class[most] > total.found / 2:
        print(
            f"{100 * total.of_class[most] / total.found:.0f} % of the points found are of class {most}, not "
            f"{rail_class}: if class {most} is rail, give --rail-class {most}."
        )


def print_repeated(visits: Sequence[Visit]) -> None:
    """Print how well the rails of each two runs agree where both show them."""
    rails: dict[str, list[RailLine]] = {}
    for visit in visits:
        rails.setdefault(visit.run, []).extend(visit.rails)
    pairs = [(one, other, agreement(rails[one], rails[other])) for one, other in combinations(sorted(rails), 2)]
    if all(found is None for _, _, found in pairs):
        print("No rail was found by two runs.")
        return
    print(f"{'runs':<60}{HEADER}")
    for one, other, found in pairs:
        if found is not None:
            print(f"{one + ', ' + other:<60}{found.text()}")


if __name__ == "__main__":
    main()
