"""Draw synthetic training pairs, each family of layouts at increasing severity: `docs/contact_sheet.png`."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import matplotlib
import numpy as np
from rail_extract.laboratory.rasters.layouts import FAMILIES
from rail_extract.laboratory.rasters.pairs import BASE_RATIO, random_pair

matplotlib.use("Agg")
import matplotlib.pyplot as plt  # noqa: E402

PATH = Path(__file__).resolve().parents[1] / "docs" / "contact_sheet.png"
SEVERITIES = (0.1, 0.4, 0.7, 0.95)
SEED, STEP, THUMBNAIL = 6, 3, 170
"""A pixel has `STEP` cells per side: a raster of 20 m has `THUMBNAIL` pixels."""
SIDE, CELL = STEP * THUMBNAIL, THUMBNAIL + 3
DPI, HEAD, MARGIN = 100, 24, 24
RAIL, DISTRACTOR, PAPER, FRAME = (20, 20, 20), (210, 40, 40), (255, 255, 255), (150, 150, 150)


def main() -> None:
    """Write the sheet."""
    sheet = np.concatenate([np.concatenate(list(row), axis=1) for row in rasters()])
    height, width = sheet.shape[0] + HEAD, sheet.shape[1] + MARGIN
    figure = plt.figure(figsize=(width / DPI, height / DPI), dpi=DPI)
    figure.figimage(sheet, xo=MARGIN, yo=0)
    for number, family in enumerate(FAMILIES):
        x = MARGIN + (number + 0.5) * CELL
        figure.text(x / width, 1 - 0.5 * HEAD / height, family, ha="center", va="center", fontsize=11)
    for number, severity in enumerate(SEVERITIES):
        y = 1 - (HEAD + (2 * number + 1) * CELL) / height
        text = f"severity {severity:g}"
        figure.text(0.5 * MARGIN / width, y, text, ha="center", va="center", rotation=90, fontsize=11)
    PATH.parent.mkdir(exist_ok=True)
    figure.savefig(PATH, pil_kwargs={"optimize": True})
    print(f"{PATH}: {PATH.stat().st_size / 1000:.0f} kB")


def rasters() -> Iterator[Iterator[np.ndarray]]:
    """Yield the rows of the sheet: the labels at a severity, then the corrupted rasters."""
    for number, severity in enumerate(SEVERITIES):
        pairs = [random_pair(np.random.default_rng([SEED, number]), SIDE, severity, BASE_RATIO, f) for f in FAMILIES]
        yield (thumbnail(pair.label, np.zeros_like(pair.label)) for pair in pairs)
        yield (thumbnail(pair.observed, pair.distractor) for pair in pairs)


def thumbnail(cells: np.ndarray, distractor: np.ndarray) -> np.ndarray:
    """Shrink a raster without losing thin lines, with distractors in colour and a frame."""
    image = np.full((CELL, CELL, 3), FRAME, dtype=np.uint8)
    inner = image[1 : 1 + THUMBNAIL, 1 : 1 + THUMBNAIL]
    inner[:] = PAPER
    for mask, colour in ((cells, RAIL), (distractor, DISTRACTOR)):
        inner[mask.reshape(THUMBNAIL, STEP, THUMBNAIL, STEP).any(axis=(1, 3))] = colour
    return image


if __name__ == "__main__":
    main()
