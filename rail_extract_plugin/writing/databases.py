"""Checks of outputs that are tables on a PostgreSQL server."""

from __future__ import annotations

import re

from qgis.core import QgsAbstractDatabaseProviderConnection, QgsDataSourceUri, QgsException, QgsProviderRegistry

from ...core.errors import RailExtractError

POSTGIS = "postgis"
"""QGIS's other name for its provider of tables on a PostgreSQL server."""

POSTGRES = re.compile(f"(?:{POSTGIS}|postgres):(?://)?(.*)", re.DOTALL)
"""Outputs on a PostgreSQL server, as QGIS writes them."""

DEFAULT_SCHEMA = "public"


def check_database(name: str, text: str) -> None:
    """Check before the run that a table can be written, if the output is one on a PostgreSQL server.

    Raises RailExtractError if the server does not answer or refuses the user, there is no such schema, the user may not
    create tables in it, the database has no PostGIS, or the output does not name a table.
    """
    found = POSTGRES.fullmatch(text)
    if found is None:
        return
    uri = QgsDataSourceUri(found[1])
    database = f"the database {uri.service() or uri.database()}"
    schema = uri.schema() or DEFAULT_SCHEMA
    if not uri.table():
        raise RailExtractError(f'{name} names no table of {database}: add one, such as table="rails" (geom).')
    try:
        connection = QgsProviderRegistry.instance().providerMetadata("postgres").createConnection(found[1], {})
        has_schema = schema in connection.schemas()
    except QgsException:  # its text has the password, but no reason
        raise RailExtractError(
            f"{name} can't be written, because {database} does not answer or refuses the user {uri.username()}: check "
            "host, port, user and password."
        ) from None
    if not has_schema:
        raise RailExtractError(f"{name} can't be written, because {database} has no schema {schema}: choose another.")
    if schema not in _names(connection, "SELECT nspname FROM pg_namespace WHERE has_schema_privilege(oid, 'CREATE')"):
        raise RailExtractError(
            f"{name} can't be written, because the user may not create tables in the schema {schema} of {database}: "
            "choose another schema, or ask its owner for this right."
        )
    if "postgis" not in _names(connection, "SELECT extname FROM pg_extension"):
        raise RailExtractError(
            f"{name} can't be written, because {database} has no PostGIS: run CREATE EXTENSION postgis there."
        )


def _names(connection: QgsAbstractDatabaseProviderConnection, query: str) -> list[str]:
    """Return the first column of a query's result."""
    return [row[0] for row in connection.executeSql(query)]
