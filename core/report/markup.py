"""HTML and SVG as text, with everything escaped in one place."""

from __future__ import annotations

from collections.abc import Iterable
from html import escape


def tag(name: str, *content: str, **attributes: object) -> str:
    """Make an element.

    Parameters
    ----------
    name : str
    *content : str
        Markup; make text safe with `text` before.
    **attributes : object
        Values by name; a hyphen is written as an underscore, and a name that Python keeps has one at its end. Numbers
        get two decimals, None leaves an attribute out.
    """
    written = "".join(
        f' {key.rstrip("_").replace("_", "-")}="{escape(_value(value), quote=True)}"'
        for key, value in attributes.items()
        if value is not None
    )
    return f"<{name}{written}>{''.join(content)}</{name}>"


def text(content: object) -> str:
    """Make text safe to stand in markup."""
    return escape(str(content))


def table(headings: Iterable[str], rows: Iterable[Iterable[object]]) -> str:
    """Make a table of texts."""
    head = tag("tr", *(tag("th", text(heading)) for heading in headings))
    body = (tag("tr", *(tag("td", text(cell)) for cell in row)) for row in rows)
    return tag("table", tag("thead", head), tag("tbody", *body))


def metres(length_m: float) -> str:
    """Write a length for a person: 0.4 m, 39 m, 1,234 m, 12.3 km."""
    if length_m >= 10_000:
        return f"{length_m / 1000:,.1f} km"
    return f"{length_m:.1f} m" if length_m < 10 else f"{length_m:,.0f} m"


def _value(value: object) -> str:
    return f"{value:.2f}" if isinstance(value, float) else str(value)
