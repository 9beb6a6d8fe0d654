"""The card of a trained classifier: what it learned from, and how well it labels what was kept back."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np

from .markup import table, tag, text
from .plots import AXIS, LEFT, PANEL, RIGHT, SPACE, WIDTH, curve, ticks
from .style import STYLE

if TYPE_CHECKING:
    from ..labelling.training import Plan
    from ..learned.training import Figures, Trained
    from ..standards import RailStandard

GOOD_RECALL = 0.99
"""Recall that Gribov and Chang reached with their data, for comparison."""

NOTE = (
    "Recall is the share of the labelled rail points that the classifier finds, precision the share of the points it "
    "finds that are labelled, and F1 their harmonic mean. They count points in the zone of railheads, in places of "
    "some 20 m that were kept back: the classifier has not learned from them. They are in the same cloud, though. In "
    "clouds of another scanner it may find much less; compare with METHOD GEOMETRY there."
)


def build_card(trained: Trained, tiles: Sequence[str], facts: Mapping[str, str]) -> str:
    """Return the card of a training.

    Parameters
    ----------
    trained : Trained
    tiles : sequence of str
        Names of the files of the cloud, by number.
    facts : mapping of str to str
        Further facts to state, such as settings, by name.

    Returns
    -------
    str
        A complete HTML document.
    """
    total = trained.total
    rows = [_row(tiles[number], figures) for number, figures in trained.by_tile.items()]
    body = [
        tag("h1", text("Rail classifier")),
        tag("p", text(f"Learned from {len(tiles)} files"), class_="source"),
        _verdict(total),
        tag(
            "section",
            tag("h2", text("Kept back, by tile")),
            table(("Tile", "Rail points", "Recall", "Precision", "F1"), [*rows, _row("all", total)]),
            tag("p", text(NOTE), class_="notes"),
        ),
        tag("section", tag("h2", text("Course of the training")), _curves(trained)),
        tag("section", tag("h2", text("Settings")), _facts(facts)),
    ]
    head = (
        '<meta charset="utf-8">',
        '<meta name="viewport" content="width=device-width, initial-scale=1">',
        tag("title", text("Rail classifier")),
        f"<style>{STYLE}</style>",
    )
    return f"<!DOCTYPE html>\n{tag('html', tag('head', *head), tag('body', tag('main', *body)), lang='en')}\n"


def facts_of(trained: Trained, plan: Plan, standard: RailStandard) -> dict[str, str]:
    """Return the settings of a training by name, as text."""
    return {
        "Rail classes": ", ".join(map(str, plan.rail_classes)),
        "Rail standard": f"gauge {1000 * standard.gauge_m:g} mm, railhead {1000 * standard.head_width_m:g} mm",
        "Blocks learned from": f"{trained.blocks:,}",
        "Blocks kept back": f"{trained.kept_back:,}, in places of some 20 m that the seed chooses",
        "Epochs": f"{plan.epochs}, {trained.steps:,} steps",
        "Seed": str(plan.seed),
        "Started from": plan.start.name if plan.start else "random weights",
        "Network": f"RandLA-Net, {trained.parameters:,} weights",
    }


def _verdict(total: Figures) -> str:
    words = f"Recall {total.recall:.3f}, precision {total.precision:.3f} on places that were kept back."
    return tag("div", tag("strong", text(words)), class_=f"verdict {'' if total.recall >= GOOD_RECALL else 'fair'}")


def _row(name: str, figures: Figures) -> tuple[object, ...]:
    rails = figures.right + figures.missed
    return (name, f"{rails:,}", *(_number(value) for value in (figures.recall, figures.precision, figures.f1)))


def _number(value: float) -> str:
    return f"{value:.3f}" if np.isfinite(value) else ""


def _curves(trained: Trained) -> str:
    """Draw loss, recall and precision by step."""
    steps = np.array([check.step for check in trained.checks], dtype=float)
    columns = {
        "Loss of the blocks learned from": [check.loss for check in trained.checks],
        "Recall of blocks kept back, before the output was calibrated": [c.figures.recall for c in trained.checks],
        "Precision of blocks kept back": [c.figures.precision for c in trained.checks],
    }
    parts = []
    for number, (name, values) in enumerate(columns.items()):
        top = number * (PANEL + SPACE) + SPACE
        parts.append(_panel(name, steps, np.array(values, dtype=float), top, None if number == 0 else 1.0))
    bottom = len(columns) * (PANEL + SPACE)
    for step in ticks(0.0, float(steps[-1]), 10):
        x = _across(np.array([step]), steps)[0]
        parts.append(tag("text", text(f"{step:,g}"), x=float(x), y=bottom + 16, class_="tick middle"))
    parts.append(tag("text", text("step"), x=WIDTH - RIGHT, y=bottom + 32, class_="tick end"))
    box = f"0 0 {WIDTH:g} {bottom + AXIS:g}"
    return tag("svg", *parts, viewBox=box, role="img", aria_label="Course of the training")


def _panel(name: str, steps: np.ndarray, values: np.ndarray, top: float, high: float | None) -> str:
    """Draw one quantity from 0 to `high`, or to its largest value."""
    known = values[np.isfinite(values)]
    high = high or (float(known.max()) if len(known) else 1.0)
    scale = PANEL / high
    parts = [tag("rect", x=LEFT, y=top, width=WIDTH - LEFT - RIGHT, height=PANEL, class_="panel")]
    for value in ticks(0.0, high, 4):
        y = float(top + PANEL - value * scale)
        parts.append(tag("line", x1=LEFT, x2=WIDTH - RIGHT, y1=y, y2=y, class_="grid"))
        parts.append(tag("text", text(f"{value:g}"), x=LEFT - 8, y=y + 4, class_="tick end"))
    parts.append(tag("path", d=curve(_across(steps, steps), top + PANEL - values * scale), class_="curve"))
    parts.append(tag("text", tag("tspan", text(name), class_="name"), x=LEFT, y=top - 8, class_="heading"))
    return "".join(parts)


def _across(step: np.ndarray, steps: np.ndarray) -> np.ndarray:
    return LEFT + step / steps[-1] * (WIDTH - LEFT - RIGHT)


def _facts(facts: Mapping[str, str]) -> str:
    return tag("dl", *(tag("dt", text(name)) + tag("dd", text(value)) for name, value in facts.items()))
