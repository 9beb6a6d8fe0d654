"""Damage: changes to the bytes of a file, each chosen by a random number generator."""

from __future__ import annotations

import random
import struct
from collections.abc import Callable
from pathlib import Path

BORDERS = (0, 7, 8, 15, 16, 31, 32, 53, 63, 64)
NUMBERS = tuple(2**bits + step for bits in BORDERS for step in (-1, 0))
FLOATS = (0.0, -0.0, 1.0, -1.0, 1e-300, 1e300, -1e300, float("inf"), float("-inf"), float("nan"))

HEAD = 600
"""Bytes at the start and the end of a file, in which headers and tables are; half of all changes are made there."""

WORDS = (
    b"null",
    b"NaN",
    b"-1",
    b"0",
    b"1e309",
    b"[]",
    b"{}",
    b'""',
    b"true",
    b'"\\u0000"',
    b"[" * 2000,
    b"../" * 90,
    b"\xff\xfe",
    b"9" * 400,
    b"-139",
    b"0.001",
    b"1e9",
    b"1e18",
    b"1e200",
    b"-1e308",
    b"INF",
    b'"A&#10;0&#10;EOF"',
)
"""Texts that take the place of a word in JSON, XML, CSV or WKT."""

TEXTS = ("", ".csv", ".geojson", ".json", ".txt", ".vpc", ".xml")
"""Endings of the names of text files, which some files of this program lack."""


def mutate(data: bytes, rng: random.Random) -> bytes:
    """Change a file in one to four places."""
    for _ in range(rng.choice((1, 1, 1, 2, 4))):
        data = rng.choices(MUTATORS, WEIGHTS)[0](data, rng)
    return data


def mutate_text(data: bytes, rng: random.Random) -> bytes:
    """Change a text file, in half of the cases word by word, so that it often stays well-formed."""
    return _replace_word(data, rng) if rng.random() < 0.5 else mutate(data, rng)


def damaged(path: Path, rng: random.Random) -> bytes:
    """Return the bytes of a file with damage, never as they are; a text is damaged word by word as well."""
    mutator, good = mutate_text if path.suffix in TEXTS else mutate, path.read_bytes()
    while (data := mutator(good, rng)) == good:
        pass
    return data


def _place(data: bytes, rng: random.Random) -> int:
    """Choose a place, mostly near the start, sometimes near the end."""
    where = rng.random()
    if where < 0.4:
        return rng.randrange(min(len(data), HEAD) + 1)
    if where < 0.5:
        return rng.randrange(max(len(data) - HEAD, 0), len(data) + 1)
    return rng.randrange(len(data) + 1)


def _flip(data: bytes, rng: random.Random) -> bytes:
    at = min(_place(data, rng), max(len(data) - 1, 0))
    return data[:at] + bytes(byte ^ (1 << rng.randrange(8)) for byte in data[at : at + 1]) + data[at + 1 :]


def _overwrite(data: bytes, rng: random.Random) -> bytes:
    at, value = _place(data, rng), bytes(rng.randrange(256) for _ in range(rng.randint(1, 8)))
    return data[:at] + value + data[at + len(value) :]


def _set_number(data: bytes, rng: random.Random) -> bytes:
    at, size = _place(data, rng), rng.choice((1, 2, 4, 8))
    value = (rng.choice(NUMBERS) % 2 ** (8 * size)).to_bytes(size, rng.choice(("little", "little", "big")))
    return data[:at] + value + data[at + size :]


def _set_float(data: bytes, rng: random.Random) -> bytes:
    at = _place(data, rng)
    return data[:at] + struct.pack("<d", rng.choice(FLOATS)) + data[at + 8 :]


def _fill(data: bytes, rng: random.Random) -> bytes:
    at, length = _place(data, rng), rng.randint(1, 200)
    return data[:at] + bytes([rng.choice((0, 255, 0x41))]) * min(length, len(data) - at) + data[at + length :]


def _cut(data: bytes, rng: random.Random) -> bytes:
    return data[: _place(data, rng)]


def _remove(data: bytes, rng: random.Random) -> bytes:
    at = _place(data, rng)
    return data[:at] + data[at + rng.randint(1, 100) :]


def _insert(data: bytes, rng: random.Random) -> bytes:
    at = _place(data, rng)
    return data[:at] + bytes(rng.randrange(256) for _ in range(rng.randint(1, 30))) + data[at:]


def _repeat(data: bytes, rng: random.Random) -> bytes:
    at, length = _place(data, rng), rng.randint(1, 400)
    return data[: at + length] + data[at : at + length] * rng.randint(1, 5) + data[at + length :]


def _replace_word(data: bytes, rng: random.Random) -> bytes:
    """Replace what is between two separators."""
    cuts = [place for place, byte in enumerate(data) if byte in b',:[]{}()"<>=; \n']
    if len(cuts) < 2:
        return mutate(data, rng)
    first = rng.randrange(len(cuts) - 1)
    last = min(first + rng.choice((1, 1, 1, 2, 5)), len(cuts) - 1)
    return data[: cuts[first] + 1] + rng.choice(WORDS) + data[cuts[last] :]


MUTATORS: tuple[Callable[[bytes, random.Random], bytes], ...] = (
    _flip,
    _overwrite,
    _set_number,
    _set_float,
    _fill,
    _cut,
    _remove,
    _insert,
    _repeat,
)
WEIGHTS = (4, 4, 6, 2, 1, 1, 1, 1, 1)
