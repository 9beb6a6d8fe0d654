"""The account of the method: every section that is cited exists, and every constant and file that it names."""

import ast
import re
import subprocess
from functools import lru_cache
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
METHOD = "docs/method.md"

ABSENT = [f"{name}.md" for name in ("ALGORITHMS", "DESIGN", "INTERFACE", "HOUSE", "CLASSIFY")]
"""Papers that were written before the project and are not part of it."""

NUMBERS = r"((?:\d+(?:\.\d+)?(?:,? (?:and|to) |, )?)+)"
CITATION = re.compile(r"docs/method\.md\s+sections?\s+" + NUMBERS)
OWN_REFERENCE = re.compile(r"(?<!Chang, )\b[Ss]ections? " + NUMBERS)
CONSTANT_ROW = re.compile(r"^\| `(\w+)\.([A-Z_]\w*)` \| ([^|]*) \|", re.MULTILINE)
NUMBER = re.compile(r"(?<![\w.])-?\d+(?:\.\d+)?(?:e-?\d+)?")


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


def constants(source):
    """Names and values of the constants of a module; None for a value that is computed."""
    found = {}
    for node in ast.parse(source).body:
        if isinstance(node, ast.Assign):
            target, value = node.targets[0], node.value
            both = isinstance(target, ast.Tuple) and isinstance(value, ast.Tuple)
            for name, one in zip(target.elts, value.elts) if both else [(target, value)]:
                found[ast.unparse(name)] = literal(one)
    return found


def literal(node):
    try:
        return ast.literal_eval(node)
    except ValueError:
        return None


def flat(value):
    if isinstance(value, (tuple, list)):
        return [number for one in value for number in flat(one)]
    return [float(value)]


@lru_cache(maxsize=1)
def modules():
    """Constants of every module of the product and the laboratory, in lists by the module's name."""
    found = {}
    for name, text in tracked().items():
        if name.startswith(("core/", "laboratory/")) and name.endswith(".py"):
            path = Path(name)
            stem = path.parent.name if path.stem == "__init__" else path.stem
            found.setdefault(stem, []).append(constants(text))
    return found


def test_every_section_that_is_cited_exists():
    known = sections(tracked()[METHOD])
    citations = [(name, number) for name, text in tracked().items() for number in cited(CITATION, text)]
    assert len(citations) > 20
    assert [one for one in citations if one[1] not in known] == []


def test_the_method_refers_to_sections_of_its_own():
    text = tracked()[METHOD]
    assert [number for number in cited(OWN_REFERENCE, text) if number not in sections(text)] == []


def test_sections_are_numbered_in_order():
    text = tracked()[METHOD]
    numbers = [tuple(map(int, one.split("."))) for one in re.findall(r"^#{2,3} (\d+(?:\.\d+)?) ", text, re.MULTILINE)]
    assert numbers == sorted(set(numbers))


@pytest.mark.parametrize("paper", ABSENT)
def test_no_file_cites_what_is_not_in_the_repository(paper):
    assert [name for name, text in tracked().items() if paper in text] == []


def test_constants_have_the_values_that_the_method_states():
    rows = CONSTANT_ROW.findall(tracked()[METHOD])
    assert len(rows) > 50
    wrong = []
    for module, constant, stated in rows:
        values = [one[constant] for one in modules().get(module, []) if constant in one]
        numbers = [float(number) for number in NUMBER.findall(stated)]
        if not values or all(value is not None and flat(value) != numbers for value in values):
            wrong.append((f"{module}.{constant}", stated, values))
    assert wrong == []


def test_files_that_the_method_names_exist():
    named = re.findall(r"`((?:core|laboratory|tests|benchmarks|models)/[\w/.]+)`", tracked()[METHOD])
    assert len(named) > 30
    assert [name for name in named if not (ROOT / name).exists()] == []
