"""Refuse phrases that no native technical writer would use, in documents, docstrings, comments and messages.

The list holds patterns that this project once used by habit. It is not a style guide: a sentence that passes may still
be a bad one.
"""

from __future__ import annotations

import io
import re
import subprocess
import sys
import tokenize
from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent

PHRASES = {
    r"(?<!there )\b(?:is|are|was|were) no (?!longer|more|less|fewer|better|nearer|further|farther)": "is not a",
    r"\bhangs? on\b": "depends on",
    r"\bso (?:far|many|long|much)\b(?! as)": "name the quantity",
    r"\b(?:points|cells|hits|lines?|rails?|one|once|mm|seconds|millimetres) an? "
    r"(?:metre|kilometre|second|rail|track|line|class|cell|core|station)\b": "per",
    r", for (?:it|they|there|this|these|those|nothing|otherwise|else|only|then|what|points|lines|files|rails)\b"
    r"(?! (?:gauge|example))": "because, since",
    r"\b(?:suffices?|sufficed)\b": "is enough",
    r"\banew\b": "again",
    r"\bsuch a one\b|\bdoes so\b|\bdo so\b": "name it",
    r"\b[Tt]ells? (?:whether|which|where|what|how|why)\b": "return, state, show",
    r"\bis to be done\b|\bare to be done\b": "there is nothing to do",
    r"\bput up with\b": "accept, tolerate",
    r"\bgo(?:es|ing)? on on\b": "continues on",
    r"\b(?:whereof|thereof|therein|wherein|thereby|whom)\b": "split the sentence",
    r"\bstretch(?:es)?\b": "square, section, length or scale factor",
    r"\bcan be used without\b": "works without",
    r"\bby nobody\b": "cannot be",
    r"\bthe former\b|\bthe latter\b": "repeat the name",
}
"""Pattern, and what to write instead."""

ELSEWHERE = ("tools/words.py", "tests/tools/test_words.py")
"""This list and its tests."""


def texts(name: str, source: str) -> Iterator[tuple[int, str]]:
    """Yield the lines of prose of a file with their numbers: all of a document, comments and strings of a module."""
    if not name.endswith(".py"):
        yield from enumerate(source.splitlines(), start=1)
        return
    for token in tokenize.generate_tokens(io.StringIO(source).readline):
        if token.type in (tokenize.COMMENT, tokenize.STRING) or tokenize.tok_name[token.type] == "FSTRING_MIDDLE":
            yield from enumerate(token.string.splitlines(), start=token.start[0])


def findings(name: str, source: str) -> list[str]:
    """List the phrases in a file as ``name:line phrase: what to write``."""
    found = []
    for line, text in texts(name, source):
        for pattern, better in PHRASES.items():
            found += [f"{name}:{line} {match[0]!r}: {better}" for match in re.finditer(pattern, text, re.IGNORECASE)]
    return found


def main() -> int:
    """Print the findings; return 1 if there are any."""
    listing = ["git", "-c", f"safe.directory={ROOT}", "ls-files", "-z", "*.py", "*.md", "*.txt", "Makefile"]
    names = subprocess.run(listing, cwd=ROOT, check=True, capture_output=True, text=True).stdout.split("\0")
    found = [
        finding
        for name in filter(None, names)
        if name not in ELSEWHERE and (ROOT / name).is_file()
        for finding in findings(name, (ROOT / name).read_text(encoding="utf-8"))
    ]
    print(*found, sep="\n", end="\n" if found else "")
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
