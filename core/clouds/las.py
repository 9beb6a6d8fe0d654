"""LAS, LAZ and COPC files: checked headers, and points of wanted classes in chunks."""

from __future__ import annotations

import struct
import warnings
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from os import SEEK_END
from pathlib import Path

import numpy as np

from ..errors import CloudError
from ..progress import SILENT, Progress
from .crs import crs_of_geokeys, import_pyproj

with warnings.catch_warnings():
    # laspy imports pyproj, which in a virtual environment warns about a data folder that PROJ finds by itself.
    warnings.simplefilter("ignore", UserWarning)
    import laspy

try:
    import lazrs
except ImportError:
    lazrs = None

CHUNK = 250_000
"""Points read at once: some 10 MB, and well below the half second in which a cancel must be heard."""

SUFFIXES = (".las", ".laz")
"""What a folder is searched for; COPC files end in .copc.laz."""

SHORTEST_HEADER, HEADER_14, VLR_HEADER, EVLR_HEADER = 227, 375, 54, 60
"""Bytes, by the LAS 1.2 and 1.4 specifications."""

LARGEST_SCALE = 1000.0
"""Coarser steps between neighbouring coordinates are no survey but a damaged header."""

LARGEST_OFFSET = 1e10
"""No place on earth has larger coordinates, even in centimetres: its girth is 4e9 of them."""

LAST_POINT_FORMAT, FORMAT_BITS = 10, 0x3F
"""Of LAS 1.4; the other bits of the byte mark compressed points."""

AT_THE_END = -1
"""Place of a LAZ file's table of chunks where its writer could not go back: the last 8 bytes then tell it."""

LARGEST_LAZ_CHUNK = 2**30
"""Bytes of a chunk when unpacked; writers use 50,000 points, some 2 MB."""

READING_ERRORS = (
    laspy.errors.LaspyException,
    ValueError,
    OSError,
    LookupError,
    EOFError,
    RuntimeError,
    MemoryError,
    struct.error,
)
"""What laspy and its backends raise on damaged files; lazrs' own error is a RuntimeError."""

GEO_KEYS_RECORD = "GeoKeyDirectoryVlr"


@dataclass(frozen=True)
class CloudHeader:
    """What a file says of itself.

    Attributes
    ----------
    path : Path
    point_count : int
    extent : tuple of float
        Smallest x, smallest y, largest x, largest y in units of the CRS, as the header states them.
    crs_wkt : str or None
        Coordinate system as WKT 2; None where the file has none that is understood.
    """

    path: Path
    point_count: int
    extent: tuple[float, float, float, float]
    crs_wkt: str | None


def list_files(paths: str | Path | Sequence[str | Path]) -> tuple[Path, ...]:
    """Name the files of one path or several, each once; a folder stands for the LAS and LAZ files in it, by name.

    Raises
    ------
    CloudError
        A path does not exist, or a folder holds no such file.
    """
    files: list[Path] = []
    for path in [paths] if isinstance(paths, (str, Path)) else paths:
        path = Path(path).absolute()  # a worker may run elsewhere
        if not path.exists():
            raise CloudError(f"{path} does not exist: check the path.")
        found = _tiles(path) if path.is_dir() else [path]
        if not found:
            raise CloudError(f"The folder {path} holds no .las or .laz file: choose another one.")
        files.extend(found)
    if not files:
        raise CloudError("No point cloud was given: name a LAS or LAZ file or a folder of them.")
    return tuple({file.resolve(): file for file in reversed(files)}.values())[::-1]


def _tiles(folder: Path) -> list[Path]:
    """List a folder's LAS and LAZ files; those that macOS hides beside each on foreign disks begin with a dot."""
    return sorted(file for file in folder.iterdir() if file.suffix.lower() in SUFFIXES and file.name[0] != ".")


def read_header(path: Path) -> CloudHeader:
    """Read and check the header of one file, without its points.

    Raises
    ------
    CloudError
        The file is no LAS or LAZ file, is damaged, cut off or has no points.
    """
    with _open(path) as reader:
        header = reader.header
        extent = (*header.mins[:2], *header.maxs[:2])
        return CloudHeader(path, int(header.point_count), tuple(float(value) for value in extent), _crs_wkt(header))


def read_classes(
    path: Path, class_codes: Sequence[int], progress: Progress = SILENT
) -> Iterator[tuple[np.ndarray, np.ndarray, np.ndarray]]:
    """Read a file chunk by chunk and keep the points of the wanted classes; withheld points are left out.

    Yields
    ------
    xyz : (n, 3) array
        Kept points of a chunk, in units of the CRS.
    codes : (n,) uint8 array
        Their classes.
    census : (256,) int array
        Points in the chunk by class, wanted or not; none that are withheld.

    Raises
    ------
    CloudError
        The file turns out to be cut off or damaged.
    """
    wanted = np.zeros(256, dtype=bool)
    wanted[list(class_codes)] = True
    with _open(path) as reader:
        total = reader.header.point_count
        done = 0
        for chunk in reader.chunk_iterator(CHUNK):
            progress.check()
            codes, there = np.asarray(chunk.classification), np.asarray(chunk.withheld) == 0
            keep = np.flatnonzero(wanted[codes] & there)
            raw = np.column_stack([chunk.X[keep], chunk.Y[keep], chunk.Z[keep]])
            census = np.bincount(codes[there], minlength=256)
            yield raw * reader.header.scales + reader.header.offsets, codes[keep], census
            done += len(codes)
            progress.set_fraction(done / total)
    if done < total:
        raise CloudError(f"{path.name} is cut off: it holds {done} of the {total} points that its header announces.")


@contextmanager
def _open(path: Path) -> Iterator[laspy.LasReader]:
    """Open a checked file; whatever goes wrong in reading it becomes a `CloudError`."""
    try:
        _check_start(path)
    except OSError as error:
        raise CloudError(
            f"{path.name} can't be read ({error.strerror}): check its permissions, the disk or the network drive."
        ) from error
    fields = laspy.DecompressionSelection
    selection = fields.XY_RETURNS_CHANNEL | fields.Z | fields.CLASSIFICATION | fields.FLAGS
    try:
        with laspy.open(path, decompression_selection=selection) as reader:
            _check_header(path, reader.header)
            yield reader
    except READING_ERRORS as error:
        raise CloudError(f"{path.name} is cut off or damaged ({error}): copy or export it again.") from error


def _check_start(path: Path) -> None:
    """Refuse what is no LAS file by its first bytes, before laspy trusts the numbers in them."""
    size = path.stat().st_size
    if size == 0:
        raise CloudError(f"{path.name} is empty (0 bytes): copy or export it again.")
    with path.open("rb") as file:
        start = file.read(HEADER_14)
    if start[:4] != b"LASF":
        raise CloudError(f"{path.name} is no LAS or LAZ file, which begins with LASF: export the cloud as one.")
    if len(start) < (HEADER_14 if start[25:26] == b"\x04" else SHORTEST_HEADER):
        raise CloudError(f"{path.name} is cut off within its header: copy or export it again.")
    if start[24] != 1 or start[25] > 4:
        raise CloudError(f"{path.name} is LAS {start[24]}.{start[25]}: export it as LAS 1.2 to 1.4.")
    if start[104] & FORMAT_BITS > LAST_POINT_FORMAT:
        raise CloudError(
            f"{path.name} has a damaged header (point format {start[104] & FORMAT_BITS}): export it with a format from "
            f"0 to {LAST_POINT_FORMAT}."
        )
    header_size, points_at, records = struct.unpack("<HII", start[94:104])
    if points_at > size:
        raise CloudError(f"{path.name} is cut off before its first point: copy or export it again.")
    if header_size + records * VLR_HEADER > points_at:
        raise CloudError(
            f"{path.name} has a damaged header ({header_size} bytes and {records} records announced before the "
            "points): export it again."
        )
    late_at, late = struct.unpack("<QI", start[235:247]) if start[25] == 4 else (0, 0)
    if late and late_at + late * EVLR_HEADER > size:
        raise CloudError(f"{path.name} is cut off: the records behind its points are missing; copy or export it again.")


def _check_header(path: Path, header: laspy.LasHeader) -> None:
    """Refuse counts and scales that can't be true, and compressed files nothing here can read."""
    if header.point_count == 0:
        raise CloudError(f"{path.name} holds no points: leave it out, or export it again.")
    scales_fit = np.isfinite(header.scales).all() and (header.scales > 0).all()
    offsets_fit = (np.abs(header.offsets) <= LARGEST_OFFSET).all()
    if not scales_fit or (header.scales > LARGEST_SCALE).any() or not offsets_fit:
        raise CloudError(f"{path.name} has a damaged header (coordinate scale or offset): export it again.")
    if header.are_points_compressed:
        _check_compressed(path, header)
        return
    held = (path.stat().st_size - header.offset_to_point_data) // header.point_format.size
    if held < header.point_count:
        raise CloudError(
            f"{path.name} is cut off: it has room for {held} of the {header.point_count} points that its header "
            "announces; copy or export it again."
        )


def _check_compressed(path: Path, header: laspy.LasHeader) -> None:
    """Refuse LAZ files whose chunks can't be: the decompressor would ask for their memory and end the program."""
    if lazrs is None:
        raise CloudError(
            f"{path.name} is compressed and the Python package lazrs, which reads LAZ, is missing: "
            "run pip install lazrs, or export the cloud as LAS."
        )
    size = path.stat().st_size
    vlr = lazrs.LazVlr(header.vlrs.get("LasZipVlr")[0].record_data)
    fits = vlr.item_size() == header.point_format.size
    fits &= vlr.uses_variable_size_chunks() or vlr.chunk_size() * vlr.item_size() <= LARGEST_LAZ_CHUNK
    with path.open("rb") as file:
        file.seek(header.offset_to_point_data)
        (table_at,) = struct.unpack("<q", file.read(8))
        if table_at == AT_THE_END:
            file.seek(-8, SEEK_END)
            (table_at,) = struct.unpack("<q", file.read(8))
        if not header.offset_to_point_data < table_at <= size - 8:
            raise CloudError(f"{path.name} is cut off: its table of chunks is missing; copy or export it again.")
        file.seek(table_at)
        _, chunks = struct.unpack("<II", file.read(8))
        if fits and chunks <= size:
            file.seek(header.offset_to_point_data)
            table = lazrs.read_chunk_table(file, vlr)
            fits = sum(held for _, held in table) <= size and sum(count for count, _ in table) >= header.point_count
        if not fits or chunks > size:
            raise CloudError(f"{path.name} is damaged: its compressed chunks don't fit the file; export it again.")


def _crs_wkt(header: laspy.LasHeader) -> str | None:
    """Coordinate system of a header as WKT 2; None where there is none or PROJ does not understand it."""
    if not header.vlrs.get_by_id("LASF_Projection") and not (header.evlrs or []):
        return None
    pyproj = import_pyproj()
    try:
        crs = header.parse_crs()
        if crs is not None and not header.global_encoding.wkt:
            crs = crs_of_geokeys(crs, _geo_keys(header))
    except (pyproj.exceptions.CRSError, UnicodeDecodeError):
        return None
    return None if crs is None else crs.to_wkt()


def _geo_keys(header: laspy.LasHeader) -> dict[int, int]:
    """GeoTIFF keys of a header that carry their value themselves."""
    return {
        key.id: key.value_offset
        for record in header.vlrs.get(GEO_KEYS_RECORD)
        for key in record.geo_keys
        if key.tiff_tag_location == 0
    }
