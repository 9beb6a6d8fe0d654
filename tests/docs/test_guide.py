"""The guide: its links lead somewhere, its pictures are there, and the sentences it quotes are those of the code."""

import ast
import re
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
PAGES = sorted((ROOT / "docs").glob("*.md"))
LARGEST_PICTURE, LARGEST_GUIDE = 100_000, 3_000_000
"""Bytes of a picture, and of all of them."""

GAP = "\0"
"""Stands in templates and quotations for what changes from case to case."""


def links(page):
    return [
        target for target in re.findall(r"\]\(([^)\s]+)\)", page.read_text(encoding="utf-8")) if "://" not in target
    ]


def heading_anchors(page):
    titles = re.findall(r"^#+ (.+)$", page.read_text(encoding="utf-8"), re.MULTILINE)
    return {re.sub(r"[^\w\- ]", "", title.lower()).replace(" ", "-") for title in titles}


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_links_lead_to_files_and_headings(page):
    for target in links(page):
        path, _, anchor = target.partition("#")
        other = (page.parent / path) if path else page
        assert other.is_file(), target
        assert not anchor or anchor in heading_anchors(other), target


def test_every_picture_is_shown_and_small():
    pictures = sorted((ROOT / "docs").rglob("*.png"))
    pages = [*PAGES, ROOT / "README.md"]
    shown = {(page.parent / target.partition("#")[0]).resolve() for page in pages for target in links(page)}
    guide = [picture for picture in pictures if picture.is_relative_to(ROOT / "docs" / "pictures")]
    assert guide
    assert not set(guide) - shown
    assert max(picture.stat().st_size for picture in guide) < LARGEST_PICTURE
    assert sum(picture.stat().st_size for picture in guide) < LARGEST_GUIDE


def templates():
    """Texts of the code, with a gap where something is filled in."""
    for folder in ("core", "rail_extract_plugin"):
        for path in (ROOT / folder).rglob("*.py"):
            for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
                if isinstance(node, ast.JoinedStr):
                    yield "".join(str(part.value) if isinstance(part, ast.Constant) else GAP for part in node.values)
                elif isinstance(node, ast.Constant) and isinstance(node.value, str):
                    yield node.value.replace("{}", GAP)


def quotations():
    for page in PAGES:
        yield from re.findall(r"^> (.+)$", page.read_text(encoding="utf-8"), re.MULTILINE)


def says(template, quotation):
    """Whether the code's text, filled in, can read like the quotation."""
    parts = template.split(GAP)
    if not all(part in quotation for part in parts):
        return False
    return re.fullmatch(".+".join(map(re.escape, parts)), quotation) is not None


def is_said(quotation, sentences):
    """Whether the code says it, in one piece or in two."""
    if any(says(text, quotation) for text in sentences):
        return True
    cuts = [cut.start() for cut in re.finditer(r"[,;…]", quotation)]
    starts = [cut for cut in cuts if any(says(text, quotation[:cut]) for text in sentences)]
    return any(quotation[cut:] == "…" or any(says(text, quotation[cut:]) for text in sentences) for cut in starts)


def test_quoted_sentences_are_those_of_the_code():
    sentences = [text for text in templates() if len(text.replace(GAP, "").split()) > 2]
    invented = [one for one in quotations() if not is_said(one, sentences)]
    assert len(list(quotations())) > 20
    assert invented == []


def test_an_invented_sentence_is_noticed():
    assert says(f"{GAP} is cut off: it holds {GAP} points.", "… is cut off: it holds 5 of the 7 points.")
    assert not says(f"{GAP} is cut off: it holds {GAP} points.", "… was cut off: it holds 5 points.")
