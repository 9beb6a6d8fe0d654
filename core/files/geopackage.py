"""GeoPackages read without GDAL: the names of their tables, and geometries."""

from __future__ import annotations

import sqlite3
from collections.abc import Iterator
from contextlib import closing, contextmanager
from pathlib import Path

ENVELOPES = (0, 32, 48, 48, 64)
"""Bytes of the envelope before a geometry, by its kind."""


HEAD = 8
"""Bytes before the envelope."""


def tables_in(path: Path) -> set[str]:
    """List the tables that a GeoPackage declares; none if there is no such file, or it is not a GeoPackage."""
    try:
        with _opened(path) as database:
            return {name for (name,) in database.execute("SELECT table_name FROM gpkg_contents")}
    except sqlite3.Error:
        return set()


def geometries_in(path: Path, table: str) -> dict[int, bytes]:
    """Return the geometries of a table as well-known binary by the number of their feature, with M values."""
    with _opened(path) as database:
        column = "SELECT column_name FROM gpkg_geometry_columns WHERE table_name = ?"
        ((name,),) = database.execute(column, (table,))
        quoted = (one.replace('"', '""') for one in (name, table))
        rows = database.execute('SELECT rowid, "{}" FROM "{}"'.format(*quoted))  # nosec B608 - names are quoted
        return {number: _without_head(blob) for number, blob in rows if blob is not None}


def _without_head(blob: bytes) -> bytes:
    """Return the well-known binary of a geometry as it is stored."""
    return blob[HEAD + ENVELOPES[(blob[3] >> 1) & 7] :]


@contextmanager
def _opened(path: Path) -> Iterator[sqlite3.Connection]:
    """Provide a GeoPackage for reading."""
    # Immutable: without locks and logs, which another program may hold; `disk.check_closed` looks at the logs.
    with closing(sqlite3.connect(f"{path.absolute().as_uri()}?mode=ro&immutable=1", uri=True)) as database:
        yield database
