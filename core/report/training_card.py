"""The card of a trained classifier: what it learned from, and how well it labels what was kept back."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np

from .markup import made, note, page, section, table, verdict_box
from .plots import Curve, Panel, draw_panels

if TYPE_CHECKING:
    from ..learned.blocks import Plan
    from ..learned.training import LabelFigures, Trained
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
    """Return the card of a training, a complete HTML document, with the names of the cloud's files and more facts."""
    total = trained.total
    rows = [_row(tiles[number], figures) for number, figures in trained.by_tile.items()]
    return page(
        "Rail classifier",
        "Rail classifier",
        f"Learned from {len(tiles)} files",
        _verdict(total),
        section(
            "Kept back, by tile",
            table(("Tile", "Rail points", "Recall", "Precision", "F1"), [*rows, _row("all", total)]),
            note(NOTE),
        ),
        section("Course of the training", _curves(trained)),
        made(facts),
    )


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


def _verdict(total: LabelFigures) -> str:
    words = f"Recall {total.recall:.3f}, precision {total.precision:.3f} on places that were kept back."
    return verdict_box("good" if total.recall >= GOOD_RECALL else "fair", words)


def _row(name: str, figures: LabelFigures) -> tuple[object, ...]:
    shares = (figures.recall, figures.precision, figures.f1)
    return (name, f"{figures.right + figures.missed:,}", *(f"{one:.3f}" if np.isfinite(one) else "" for one in shares))


def _curves(trained: Trained) -> str:
    """Draw loss, recall and precision by step."""
    steps = np.array([check.step for check in trained.checks], dtype=float)
    columns = {
        "Loss of the blocks learned from": [check.loss for check in trained.checks],
        "Recall of blocks kept back, before the output was calibrated": [c.figures.recall for c in trained.checks],
        "Precision of blocks kept back": [c.figures.precision for c in trained.checks],
    }
    along = float(steps[0]), float(max(steps[-1], steps[0] + 1))
    panels = [
        Panel(name, "", [Curve(steps, np.array(values, dtype=float))], 1e-3, floor=0.0, ceiling=ceiling)
        for (name, values), ceiling in zip(columns.items(), (None, 1.0, 1.0))
    ]
    return draw_panels("Course of the training", panels, along, "step")
