"""HTML and SVG as text, with all escaping in one place."""

from __future__ import annotations

from collections.abc import Iterable
from html import escape


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


def table(headings: Iterable[str], rows: Iterable[Iterable[object]]) -> str:
    """Return a table of escaped texts."""
    head = tag("tr", *(tag("th", text(heading)) for heading in headings))
    body = (tag("tr", *(tag("td", text(cell)) for cell in row)) for row in rows)
    return tag("table", tag("thead", head), tag("tbody", *body))


def metres(length_m: float) -> str:
    """Format a length for reading: 0.4 m, 39 m, 1,234 m, 12.3 km."""
    if length_m >= 10_000:
        return f"{length_m / 1000:,.1f} km"
    return f"{length_m:.1f} m" if length_m < 10 else f"{length_m:,.0f} m"


def _value(value: object) -> str:
    return f"{value:.2f}" if isinstance(value, float) else str(value)
