"""The report: a page that says in ten seconds whether the result is good, and where it is not."""

from .page import build_page

__all__ = ["build_page"]
