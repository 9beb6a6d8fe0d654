"""Tables of a GeoPackage, read without GDAL."""

from __future__ import annotations

import sqlite3
from contextlib import closing
from pathlib import Path


def tables_in(path: Path) -> set[str]:
    """List the tables that a GeoPackage declares; none if there is no such file, or it is not a GeoPackage."""
    try:
        # Immutable: without locks and logs, which another program may hold; `disk.check_closed` looks at the logs.
        with closing(sqlite3.connect(f"{path.absolute().as_uri()}?mode=ro&immutable=1", uri=True)) as database:
            return {name for (name,) in database.execute("SELECT table_name FROM gpkg_contents")}
    except sqlite3.Error:
        return set()
