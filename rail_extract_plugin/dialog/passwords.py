"""Passwords of databases, which belong in no report, log or message."""

from __future__ import annotations

import re

NEXT_KEYS = (
    *("application_name", "authcfg", "checkPrimaryKeyUnicity", "connect_timeout", "dbname", "estimatedmetadata"),
    *("host", "hostaddr", "key", "options", "port", "selectatid", "service", "sql", "srid", "sslcert", "sslkey"),
    *("sslmode", "sslrootcert", "table", "tables", "type", "user", "username"),
)
"""Keys that may follow a password in a connection."""

IN_CONNECTION = re.compile(rf"(?i)\b(password|passwd|pwd)\s*=.*?(?=\s(?:{'|'.join(NEXT_KEYS)})\s*=|\n|\Z)")
"""From a password's key to the next key, or to the end of the line: a password may contain any character."""

IN_ADDRESS = re.compile(r"(://[^:/@\s]+):[^\s]*@")
"""The user in an address such as postgresql://user:password@host."""


def masked(text: str) -> str:
    """Return a text without the passwords in it.

    Examples
    --------
    >>> masked("host=h user=me password=secret sslmode=disable")
    'host=h user=me password=*** sslmode=disable'
    >>> masked("postgresql://me:s@c/rt@host/base")
    'postgresql://me:***@host/base'
    """
    return IN_ADDRESS.sub(r"\1:***@", IN_CONNECTION.sub(r"\1=***", text))
