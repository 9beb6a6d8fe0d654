"""Reader of LAS, LAZ and COPC files: checks the header, then reads the points in chunks."""

from __future__ import annotations

import struct
import warnings
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from functools import partial
from pathlib import Path

import numpy as np

from ..errors import CloudError, EmptyCloudError
from ..parameters import OVERLAP, SYNTHETIC
from ..progress import Progress
from . import laz
from .crs import MAX_COORDINATE, crs_of_geokeys, import_pyproj
from .header import CloudHeader, Extent, Part
from .passes import marks_of

with warnings.catch_warnings():
    # In a virtual environment, pyproj (imported by laspy) warns about a data folder that PROJ finds by itself.
    warnings.simplefilter("ignore", UserWarning)
    import laspy
    from laspy.vlrs.vlrlist import VLRList

_PARTS = laspy.DecompressionSelection
FIELDS = _PARTS.XY_RETURNS_CHANNEL | _PARTS.Z | _PARTS.CLASSIFICATION | _PARTS.FLAGS
FIELDS |= _PARTS.POINT_SOURCE_ID | _PARTS.GPS_TIME
"""What is decompressed of a point."""

OVERLAP_CLASS = 12
"""Class of overlap points in point formats 0 to 5, which have no flag for it."""

CHUNK = 250_000
"""Points read at once: about 10 MB, and read in much less than the half second within which a run must react to a
cancel."""

FIRST_POINTS = 10_000
"""Points that are asked whether a scanner measured them."""

MIN_HEADER, HEADER_14, VLR_HEADER, EVLR_HEADER = 227, 375, 54, 60
"""Sizes in bytes, from the LAS 1.2 and 1.4 specifications."""

MAX_SCALE = 1000.0
"""Largest step between neighbouring coordinates, in units of the CRS; a larger one means a damaged header."""

MAX_EMPTY = 64
"""Most bytes between the header and the end of a file without points: LAZ files have an empty table of chunks there."""

MAX_POINT_FORMAT, FORMAT_BITS = 10, 0x3F
"""Last point format of LAS 1.4, and the bits of the byte that hold it; the others mark compressed points."""

MAX_READ = 2**26
"""Largest block of points read at once, in bytes; a point may have up to 65,535."""

PROJECTION_USER = b"LASF_Projection"
"""User of the records that state the coordinate system."""

GEO_KEYS_RECORD = "GeoKeyDirectoryVlr"


def read_header(path: Path) -> CloudHeader:
    """Read and check the header of one file; see `readers.read_header`."""
    with _open(path) as reader:
        header = reader.header
        (xmin, ymin), (xmax, ymax) = header.mins[:2].tolist(), header.maxs[:2].tolist()
        header.evlrs = _late_projection_records(path, header)
        return CloudHeader(path, int(header.point_count), (xmin, ymin, xmax, ymax), _crs_wkt(header))


def read_chunks(
    path: Path, progress: Progress, extent: Extent | np.ndarray | None, leave_out: Sequence[str]
) -> Iterator[Part]:
    """Check a file and read it chunk by chunk; see `readers.read_classes`."""
    with _open(path) as reader:
        header, done, chunks, some = reader.header, 0, None, None
        timed = "gps_time" in header.point_format.dimension_names
        if header.are_points_compressed:
            chunks = laz.read_chunk_table(path, header)
            laz.check_layers(path, header, chunks, progress)
            some = laz.chunks_in(path, header, chunks, extent) if extent is not None else None
        total = header.point_count if some is None else sum(one.points for one in some)
        for chunk in read_blocks(path, reader, FIELDS, chunks if some is None else some):
            progress.check()
            gps_time = np.asarray(chunk.gps_time) if timed else None
            marks = marks_of(np.asarray(chunk.point_source_id), header.file_source_id, gps_time)
            codes = np.asarray(chunk.classification)
            yield partial(coordinates, chunk), codes, marks, _valid(chunk, leave_out), some is None
            done += len(chunk)
            progress.set_fraction(done / total)
    if done < total:
        raise CloudError(f"{path.name} is cut off: it holds {done} of the {total} points stated in its header.")


def _valid(chunk: laspy.ScaleAwarePointRecord, leave_out: Sequence[str]) -> np.ndarray:
    """Return which points are neither withheld nor of a kind that is to be left out, (n,) bool."""
    valid = np.asarray(chunk.withheld) == 0
    if SYNTHETIC in leave_out:
        valid &= np.asarray(chunk.synthetic) == 0
    if OVERLAP in leave_out:
        flagged = "overlap" in chunk.point_format.dimension_names
        valid &= np.asarray(chunk.overlap) == 0 if flagged else np.asarray(chunk.classification) != OVERLAP_CLASS
    return valid


def read_blocks(
    path: Path,
    reader: laspy.LasReader,
    fields: laspy.DecompressionSelection,
    chunks: Sequence[laz.Chunk] | None = None,
) -> Iterator[laspy.ScaleAwarePointRecord]:
    """Read the points of a file block by block: the fields given, of all compressed chunks or of those given."""
    header = reader.header
    most = max(1, min(CHUNK, MAX_READ // header.point_format.size))
    if not header.are_points_compressed:
        return reader.chunk_iterator(most)
    return laz.read_chunks(path, header, laz.read_chunk_table(path, header) if chunks is None else chunks, fields, most)


def coordinates(chunk: laspy.ScaleAwarePointRecord, keep: np.ndarray | slice) -> np.ndarray:
    """Return the coordinates of some points of a chunk, (n, 3) in units of the CRS."""
    axes = (chunk.X, chunk.Y, chunk.Z)
    return np.column_stack(
        [raw[keep] * scale + offset for raw, scale, offset in zip(axes, chunk.scales, chunk.offsets)]
    )


def shows_scanner(path: Path) -> bool:
    """Return whether the first points have what only a scanner measures; see `readers.shows_scanner`."""
    with _open(path, FIELDS | _PARTS.INTENSITY) as reader:
        points = reader.read_points(FIRST_POINTS)
    measured = [points.intensity, *([points.gps_time] if "gps_time" in points.array.dtype.names else [])]
    return any(np.ptp(values) > 0 for values in measured) or bool(np.max(points.number_of_returns) > 1)


@contextmanager
def _open(path: Path, fields: laspy.DecompressionSelection = FIELDS) -> Iterator[laspy.LasReader]:
    """Open a file and check it; what laspy and lazrs raise on a damaged file is left to `readers`."""
    _check_start(path)
    with laspy.open(path, read_evlrs=False, decompression_selection=fields) as reader:
        _check_header(path, reader.header)
        yield reader


def _check_start(path: Path) -> None:
    """Refuse files that are not LAS, or are damaged, by their first bytes, before laspy relies on the numbers there."""
    size = path.stat().st_size
    if size == 0:
        raise CloudError(f"{path.name} is empty (0 bytes): copy or export it again.")
    with path.open("rb") as file:
        start = file.read(HEADER_14)
    if start[:4] != b"LASF":
        raise CloudError(
            f'{path.name} is not a LAS or LAZ file (it does not begin with "LASF"): export the cloud as LAS or LAZ.'
        )
    if len(start) < (HEADER_14 if start[25:26] == b"\x04" else MIN_HEADER):
        raise CloudError(f"{path.name} is cut off within its header: copy or export it again.")
    if start[24] != 1 or start[25] > 4:
        raise CloudError(f"{path.name} is LAS {start[24]}.{start[25]}: export it as LAS 1.2 to 1.4.")
    if start[104] & FORMAT_BITS > MAX_POINT_FORMAT:
        raise CloudError(
            f"{path.name} has a damaged header (point format {start[104] & FORMAT_BITS}): export it with a format from "
            f"0 to {MAX_POINT_FORMAT}."
        )
    header_size, points_at, records = struct.unpack("<HII", start[94:104])
    if points_at > size:
        raise CloudError(f"{path.name} is cut off before its first point: copy or export it again.")
    if header_size + records * VLR_HEADER > points_at:
        raise CloudError(
            f"{path.name} has a damaged header ({header_size} bytes and {records} records stated before the points): "
            "export it again."
        )
    legacy, count = struct.unpack("<I", start[107:111])[0], int.from_bytes(start[247:255], "little")
    if start[25] == 4 and legacy not in (0, count):
        raise CloudError(
            f"{path.name} has a damaged header (it states both {legacy} and {count} points): export it again."
        )


def _check_header(path: Path, header: laspy.LasHeader) -> None:
    """Refuse impossible counts and scales, and compressed files that can't be read."""
    if header.point_count == 0:
        end = header.start_of_first_evlr if header.number_of_evlrs else path.stat().st_size
        if end - header.offset_to_point_data > MAX_EMPTY:
            raise CloudError(
                f"{path.name} was not finished: it has points, but its header states none; copy or export it again."
            )
        raise EmptyCloudError(f"{path.name} has no points: leave it out, or export it again.")
    scales_fit = np.isfinite(header.scales).all() and (header.scales > 0).all()
    offsets_fit = (np.abs(header.offsets) <= MAX_COORDINATE).all()
    if not scales_fit or (header.scales > MAX_SCALE).any() or not offsets_fit:
        raise CloudError(f"{path.name} has a damaged header (coordinate scale or offset): export it again.")
    if header.are_points_compressed:
        laz.read_chunk_table(path, header)
        return
    held = (path.stat().st_size - header.offset_to_point_data) // header.point_format.size
    if held < header.point_count:
        raise CloudError(
            f"{path.name} is cut off: it has room for {held} of the {header.point_count} points stated in its header; "
            "copy or export it again."
        )


def late_records(path: Path, header: laspy.LasHeader) -> Iterator[tuple[int, int, bytes]]:
    """Yield start, end and user of each record after the points, some of which hold gigabytes of waveforms."""
    at, size = header.start_of_first_evlr, path.stat().st_size
    with path.open("rb") as file:
        for _ in range(header.number_of_evlrs):
            file.seek(min(at, size))
            start = file.read(EVLR_HEADER)
            end = at + EVLR_HEADER + int.from_bytes(start[20:28], "little")
            if len(start) < EVLR_HEADER or end > size:
                raise CloudError(
                    f"{path.name} is cut off: the records after its points are missing; copy or export it again."
                )
            yield at, end, start[2:18].rstrip(b"\0")
            at = end


def _late_projection_records(path: Path, header: laspy.LasHeader) -> VLRList:
    """Read the records after the points that state the coordinate system."""
    records = VLRList()
    with path.open("rb") as file:
        for start, _, user in late_records(path, header):
            if user == PROJECTION_USER:
                file.seek(start)
                records += VLRList.read_from(file, 1, extended=True)
    return records


def _crs_wkt(header: laspy.LasHeader) -> str | None:
    """Return the coordinate system of a header as WKT 2; None if there is none or PROJ does not understand it."""
    if not header.vlrs.get_by_id(PROJECTION_USER.decode()) and not header.evlrs:
        return None
    pyproj = import_pyproj()
    try:
        crs = header.parse_crs()
        if crs is not None and not header.global_encoding.wkt:
            crs = crs_of_geokeys(crs, _geo_keys(header))
        return None if crs is None else crs.to_wkt()
    except (pyproj.exceptions.ProjError, ValueError):  # a ValueError where the text is not UTF-8, or holds a zero byte
        return None


def _geo_keys(header: laspy.LasHeader) -> dict[int, int]:
    """Return the GeoTIFF keys of a header that hold their value themselves, not in another tag."""
    return {
        key.id: key.value_offset
        for record in header.vlrs.get(GEO_KEYS_RECORD)
        for key in record.geo_keys
        if key.tiff_tag_location == 0
    }
