"""Convert the user guide, pages of `docs`, to the web pages of the plugin that the Help buttons open."""

from __future__ import annotations

import re
from html import escape
from pathlib import Path
from posixpath import normpath

import markdown
from rail_extract.rail_extract_plugin.dialog.guide import on_the_web

ROOT = Path(__file__).resolve().parent.parent
DOCS = ROOT / "docs"
FOLDER = "resources/guide"
"""Folder of the pages in the plugin."""

PAGES = (
    *("README", "tutorial", "parameters", "reference", "limits", "troubleshooting", "faults", "accuracy", "scaling"),
    *("stationing", "comparison", "alignment", "alignment_tutorial", "alignment_files", "airborne", "clearance"),
)
"""Pages for users; the other pages of the folder are for developers."""

EXTENSIONS = ("fenced_code", "sane_lists", "tables", "toc")

PAGE = """<!doctype html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width">
<title>{title} - Rail Extract</title>
<style>
body {{ max-width: 52em; margin: 2em auto; padding: 0 1em; font: 16px/1.5 sans-serif; color: #222; background: #fff }}
table {{ border-collapse: collapse }}
th, td {{ border: 1px solid #ccc; padding: 0.2em 0.6em; text-align: left; vertical-align: top }}
img {{ max-width: 100% }}
pre, code {{ background: #f3f3f3 }}
pre {{ padding: 0.6em; overflow-x: auto }}
blockquote {{ margin-left: 0; padding-left: 1em; border-left: 3px solid #999 }}
</style>
</head>
<body>
<p><a href="README.html">The guide</a></p>
{body}
</body>
</html>
"""


def guide_files() -> dict[str, bytes]:
    """Return the files of the guide, pages and pictures, by their names in the plugin."""
    files = {}
    for name in PAGES:
        text = (DOCS / f"{name}.md").read_text(encoding="utf-8")
        for picture in re.findall(r"!\[[^\]]*\]\(([^)]+)\)", text):
            files[f"{FOLDER}/{picture}"] = (DOCS / picture).read_bytes()
        files[f"{FOLDER}/{name}.html"] = _page(text).encode()
    return files


def _page(text: str) -> str:
    title = re.search(r"^# (.+)", text)[1]
    body = markdown.markdown(text, extensions=EXTENSIONS, output_format="html")
    body = re.sub(r'(?<=href=")(?!\w+:|#)[^"]+', _target, body)
    # Files of the repository have no address until the owner fills it in: their names remain, without a link.
    return PAGE.format(title=escape(title), body=re.sub(r'<a href="">(.*?)</a>', r"\1", body))


def _target(link: re.Match) -> str:
    """Return the target of a link: the page in the plugin, or the file in the repository if there is no such page."""
    path, mark, place = link[0].partition("#")
    if path.removesuffix(".md") in PAGES:
        return path.removesuffix(".md") + ".html" + mark + place
    address = on_the_web(normpath(f"docs/{path}"))
    return address + mark + place if address else ""
