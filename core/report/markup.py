"""HTML and SVG as text, with the style sheet of all pages, and all escaping in one place; numbers in words."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from html import escape
from itertools import compress

import numpy as np

from ..progress import written

STYLE = """
:root { --ink: #1d2733; --soft: #5d6b7a; --line: #dfe5ec; --paper: #ffffff; --wash: #f5f7fa; --track: #1565c0;
        --unsupported: #f28e2b; --offgauge: #d62839; --unsure: #8e5bb5; --good: #2e7d4f; --fair: #b26a00; }
* { box-sizing: border-box; }
body { margin: 0; background: var(--wash); color: var(--ink); font: 15px/1.5 system-ui, "Segoe UI", Roboto,
       "Helvetica Neue", "Noto Sans", Arial, sans-serif; }
main { padding: 28px 20px 60px; }
h1 { font-size: 26px; margin: 0; }
h2 { font-size: 18px; margin: 0 0 10px; }
p { margin: 6px 0; max-width: 1080px; }
.source { color: var(--soft); margin: 2px 0 18px; overflow-wrap: anywhere; }
section, .verdict { background: var(--paper); border: 1px solid var(--line); border-radius: 10px; padding: 18px 20px;
          margin: 0 0 16px; }
.verdict { border-left: 8px solid var(--good); }
.verdict.fair { border-left-color: var(--fair); }
.verdict.poor { border-left-color: var(--offgauge); }
.verdict strong { display: block; font-size: 21px; line-height: 1.3; }
.verdict ul { margin: 8px 0 0; padding-left: 20px; }
.tiles { display: grid; grid-template-columns: repeat(auto-fit, minmax(150px, 1fr)); gap: 12px; margin: 0 0 16px; }
.tile { background: var(--paper); border: 1px solid var(--line); border-radius: 10px; padding: 12px 16px; }
.tile b { display: block; font-size: 23px; line-height: 1.25; font-variant-numeric: tabular-nums; }
.tile span { color: var(--soft); font-size: 13px; }
.scroll { overflow-x: auto; }
.tall { max-height: 420px; overflow-y: auto; }
.tall th { position: sticky; top: 0; background: var(--paper); }
table { border-collapse: collapse; width: 100%; font-variant-numeric: tabular-nums; font-size: 14px; }
th, td { padding: 5px 10px; text-align: right; border-bottom: 1px solid var(--line); white-space: nowrap; }
th { color: var(--soft); font-weight: 600; }
th:first-child, td:first-child { text-align: left; }
table.words td, table.words th { text-align: left; }
svg { display: block; width: 100%; max-width: 1400px; height: auto; margin: 0 auto; }
svg text { font-size: 12px; fill: var(--soft); font-variant-numeric: tabular-nums; }
svg .end { text-anchor: end; }
svg .middle { text-anchor: middle; }
svg .heading { font-size: 12px; }
svg .name { font-weight: 600; fill: var(--ink); }
svg .panel { fill: #fbfcfd; stroke: var(--line); }
svg .band { fill: #e3f2e8; }
svg .grid { stroke: var(--line); stroke-width: 0.7; }
svg .curve { fill: none; stroke: var(--track); stroke-width: 1.4; stroke-linejoin: round; }
svg .track { fill: none; stroke: var(--track); stroke-width: 2.6; stroke-linejoin: round; stroke-linecap: round; }
svg .mark { fill: none; stroke-width: 6; stroke-linecap: round; }
svg rect.unsupported { fill: var(--unsupported); opacity: 0.3; }
svg rect.offgauge { fill: var(--offgauge); opacity: 0.3; }
svg rect.unsure { fill: var(--unsure); opacity: 0.25; }
svg path.unsupported { stroke: var(--unsupported); }
svg path.offgauge { stroke: var(--offgauge); }
svg path.unsure { stroke: var(--unsure); }
svg .arrow { fill: var(--ink); stroke: var(--paper); stroke-width: 1; }
svg .number { fill: var(--ink); font-weight: 700; font-size: 14px; paint-order: stroke; stroke: var(--paper);
              stroke-width: 4px; }
svg .bar { fill: none; stroke: var(--ink); stroke-width: 1.5; }
.legend { display: flex; flex-wrap: wrap; gap: 4px 20px; margin: 10px 0 0; color: var(--soft); font-size: 13px; }
.legend i { display: inline-block; width: 22px; height: 6px; border-radius: 3px; margin-right: 7px;
            vertical-align: middle; }
i.fine { background: var(--track); }
i.unsupported { background: var(--unsupported); }
i.offgauge { background: var(--offgauge); }
i.unsure { background: var(--unsure); }
i.band { background: #e3f2e8; border: 1px solid #b9ddc6; height: 10px; }
.limits { margin: 0 0 10px; font-size: 14px; }
.limits label { display: inline-block; margin: 0 28px 4px 0; }
table.quantities th:nth-child(2), table.quantities td:nth-child(2) { text-align: left; }
.limits input { width: 70px; font: inherit; text-align: right; padding: 2px 4px; border: 1px solid var(--line);
                border-radius: 4px; }
.notes { color: var(--soft); font-size: 13px; }
dl { display: grid; grid-template-columns: max-content 1fr; gap: 2px 18px; margin: 0 0 12px; font-size: 14px; }
dt { color: var(--soft); }
dd { margin: 0; overflow-wrap: anywhere; }
@page { size: A4; margin: 12mm; }
@media print { body { background: none; } main { padding: 0; } .scroll { overflow: visible; }
               .tall { max-height: none; } .tall th { position: static; }
               table { font-size: 11px; } th, td { white-space: normal; padding: 3px 6px; }
               section, .verdict, .tile, tr, svg { break-inside: avoid; } h2 { break-after: avoid; }
               * { print-color-adjust: exact; -webkit-print-color-adjust: exact; } }
"""
"""Style sheet of all pages. They are as wide as the window, and on paper every column of a table is seen."""


def tag(name: str, *content: str, **attributes: object) -> str:
    """Return an element as markup.

    Content is markup; escape plain text with `text`. In the names of attributes, write an underscore for a hyphen, and
    append one to names that Python reserves. Floats are written with two decimals, and attributes that are None are
    left out.

    Examples
    --------
    >>> tag("line", x1=0.5, stroke_width=2, class_="grid", y1=None)
    '<line x1="0.50" stroke-width="2" class="grid"></line>'
    """
    written = "".join(
        f' {key.rstrip("_").replace("_", "-")}="{escape(_value(value), quote=True)}"'
        for key, value in attributes.items()
        if value is not None
    )
    return f"<{name}{written}>{''.join(content)}</{name}>"


def text(content: object) -> str:
    """Escape text for use in markup."""
    return escape(str(content))


def page(title: str, heading: str, source: str, *content: str, style: str = "") -> str:
    """Return a complete HTML document that needs no network and no other file.

    Title of the window, heading and the line below it, `source`, are plain texts; the content is markup, and `style`
    has rules besides those of all pages.
    """
    head = (
        '<meta charset="utf-8">',
        '<meta name="viewport" content="width=device-width, initial-scale=1">',
        tag("title", text(title)),
        f"<style>{STYLE}{style}</style>",
    )
    body = tag("main", tag("h1", text(heading)), tag("p", text(source), class_="source"), *content)
    return f"<!DOCTYPE html>\n{tag('html', tag('head', *head), tag('body', body), lang='en')}\n"


def verdict_box(kind: str, words: str, reasons: Iterable[str] = ()) -> str:
    """Return a verdict, "good", "fair" or "poor", and what it rests on."""
    listed = "".join(tag("li", text(reason)) for reason in reasons)
    return tag("div", tag("strong", text(words)), tag("ul", listed) if listed else "", class_=f"verdict {kind}")


def tiles(figures: Iterable[tuple[str, str]]) -> str:
    """Return figures, each with what it says below it."""
    shown = (tag("div", tag("b", text(figure)), tag("span", text(what)), class_="tile") for figure, what in figures)
    return tag("div", *shown, class_="tiles")


def section(heading: str, *content: str) -> str:
    """Return a part of the page under a heading."""
    return tag("section", tag("h2", text(heading)), *content)


def made(facts: Mapping[str, str], notes: Iterable[str] = ()) -> str:
    """Return the last section: the facts that are known, by name, and notes."""
    listed = (tag("dt", text(name)) + tag("dd", text(value)) for name, value in facts.items() if value)
    return section("How it was made", tag("dl", *listed), *map(note, notes))


def note(sentence: str) -> str:
    """Return a paragraph in small type."""
    return tag("p", text(sentence), class_="notes")


def legend(keys: Iterable[tuple[str, Mapping[str, str]]]) -> str:
    """Return a legend: for each key a text, and the attributes of the mark before it."""
    return tag("div", *(tag("span", tag("i", **mark), text(what)) for what, mark in keys), class_="legend")


def table(headings: Iterable[str], rows: Iterable[Iterable[object]], class_: str = "scroll", kind: str = "") -> str:
    """Return a table of escaped texts in a box of a class; of the `kind` "words", its cells begin on the left.

    Columns without a text in any row are left out.
    """
    cells = [[str(cell) for cell in row] for row in rows]
    used = [any(column) for column in zip(*cells)]
    head = tag("tr", *(tag("th", text(heading)) for heading in compress(headings, used)))
    body = (tag("tr", *(tag("td", text(cell)) for cell in compress(row, used))) for row in cells)
    return tag("div", tag("table", tag("thead", head), tag("tbody", *body), class_=kind or None), class_=class_)


def figure(value: float, form: str = ".1f", unit: str = "mm", unknown: str = "unknown") -> str:
    """Format a number with its unit; another word stands for NaN."""
    return f"{written(value, form)} {unit}" if np.isfinite(value) else unknown


def _value(value: object) -> str:
    return f"{value:.2f}" if isinstance(value, float) else str(value)
