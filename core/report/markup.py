"""HTML and SVG as text, with all escaping in one place."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from html import escape

from .style import STYLE


def tag(name: str, *content: str, **attributes: object) -> str:
    """Return an element as markup.

    Parameters
    ----------
    name : str
    *content : str
        Markup; escape plain text with `text`.
    **attributes : object
        Values by name. Write an underscore for a hyphen, and append one to names that Python reserves. Floats are
        written with two decimals, and attributes that are None are left out.

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

    Parameters
    ----------
    title, heading, source : str
        Plain texts: the title of the window, the heading, and the line below it.
    *content : str
        Markup.
    style : str
        Rules besides those of all pages.
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
    """Return a table of escaped texts in a box of a class; of the `kind` "words", its cells begin on the left."""
    head = tag("tr", *(tag("th", text(heading)) for heading in headings))
    body = (tag("tr", *(tag("td", text(cell)) for cell in row)) for row in rows)
    return tag("div", tag("table", tag("thead", head), tag("tbody", *body), class_=kind or None), class_=class_)


def metres(length_m: float) -> str:
    """Format a length for reading: 0.4 m, 39 m, 1,234 m, 12.3 km."""
    if length_m >= 10_000:
        return f"{length_m / 1000:,.1f} km"
    return f"{length_m:.1f} m" if length_m < 10 else f"{length_m:,.0f} m"


def _value(value: object) -> str:
    return f"{value:.2f}" if isinstance(value, float) else str(value)
