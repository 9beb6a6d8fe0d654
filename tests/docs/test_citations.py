"""The account of the method: every section that is cited exists, and every file that it names."""

import re
import subprocess
from functools import lru_cache
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
METHOD = "docs/method.md"

NUMBERS = r"((?:\d+(?:\.\d+)?(?:,? (?:and|to) |, )?)+)"
CITATION = re.compile(r"docs/method\.md\s+sections?\s+" + NUMBERS)
OWN_REFERENCE = re.compile(r"(?<!Chang, )\b[Ss]ections? " + NUMBERS)


@lru_cache(maxsize=1)
def tracked():
    """Text of every tracked file that is text, by path."""
    names = subprocess.run(["git", "ls-files", "-z"], cwd=ROOT, capture_output=True, check=True).stdout
    texts = {}
    for name in names.decode().split("\0"):
        path = ROOT / name
        if path.is_file() and path.suffix in {".py", ".md", ".toml", ".txt", ".cff", ".qml", ".model3", ""}:
            texts[name] = path.read_text(encoding="utf-8")
    return texts


def sections(text):
    return {number.rstrip(".") for number in re.findall(r"^#{2,3} (\d+(?:\.\d+)?) ", text, re.MULTILINE)}


def cited(pattern, text):
    return [number for group in pattern.findall(text) for number in re.findall(r"\d+(?:\.\d+)?", group)]


def test_every_section_that_is_cited_exists():
    known = sections(tracked()[METHOD])
    citations = [(name, number) for name, text in tracked().items() for number in cited(CITATION, text)]
    assert len(citations) > 20
    assert [one for one in citations if one[1] not in known] == []


def test_the_method_refers_to_sections_of_its_own():
    text = tracked()[METHOD]
    assert [number for number in cited(OWN_REFERENCE, text) if number not in sections(text)] == []


def test_sections_are_numbered_without_holes():
    numbers = re.findall(r"^#{2,3} (\d+(?:\.\d+)?) ", tracked()[METHOD], re.MULTILINE)
    chapter, section, expected = 0, 0, []
    for number in numbers:
        chapter, section = (chapter, section + 1) if "." in number else (chapter + 1, 0)
        expected.append(f"{chapter}.{section}" if section else str(chapter))
    assert numbers == expected


def test_files_that_the_method_names_exist():
    named = re.findall(r"`((?:core|laboratory|tests|benchmarks|models)/[\w/.]+)`", tracked()[METHOD])
    assert len(named) > 30
    assert [name for name in named if not (ROOT / name).exists()] == []
