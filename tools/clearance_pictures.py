"""Draw the pictures of docs/clearance.md: the frame, the profiles, and a cross-section.

Run `python tools/clearance_pictures.py`; it needs matplotlib.
"""

from __future__ import annotations

from pathlib import Path

import matplotlib

matplotlib.use("Agg")

import matplotlib.pyplot as plt
import numpy as np
from rail_extract.core.clearance.intrusions import surface_of
from rail_extract.core.clearance.profiles import named
from rail_extract.laboratory.scenes import clearance as scenes

PICTURES = Path(__file__).resolve().parent.parent / "docs" / "pictures"


def main() -> None:
    """Draw all pictures."""
    for name, draw in (("frame", draw_frame), ("profiles", draw_profiles), ("section", draw_section)):
        figure = draw()
        figure.savefig(PICTURES / f"clearance_{name}.png", dpi=110, bbox_inches="tight", metadata={"Software": None})
        plt.close(figure)


def outline(name: str) -> np.ndarray:
    """Return the closed ring of a profile, (n, 2)."""
    points = np.array(named()[name].points)
    return np.vstack([points, points[:1]])


def draw_frame() -> plt.Figure:
    """Draw the plane of both rail tops, turned by the cant, with v and w."""
    figure, axis = plt.subplots(figsize=(6, 5))
    roll = np.arcsin(0.16 / 1.5)
    turn = np.array([[np.cos(roll), -np.sin(roll)], [np.sin(roll), np.cos(roll)]])
    ring = outline("EBO_G1") @ turn.T
    axis.plot(-ring[:, 0], ring[:, 1], color="#2e7d4f")
    for v in (0.75, -0.75):
        x, y = turn @ [v, 0.0]
        axis.add_patch(plt.Rectangle((-x - 0.035, y - 0.15), 0.07, 0.15, color="#1d2733"))
    for end, name in (((1.3, 0.0), "v"), ((0.0, 1.6), "w")):
        x, y = turn @ end
        axis.annotate("", (-x, y), (0, 0), arrowprops={"arrowstyle": "->", "color": "#d62839", "lw": 1.8})
        axis.text(-x * 1.08, y * 1.04, name, color="#d62839", fontsize=14)
    axis.plot([-2.2, 2.2], [0, 0], color="#5d6b7a", lw=0.8, ls="--")
    axis.set(
        aspect="equal", xlabel="left of the track [m]: left is drawn on the left", ylabel="above the rail tops [m]"
    )
    axis.set_xticks([])
    return figure


def draw_profiles() -> plt.Figure:
    """Draw all profiles that ship."""
    figure, axes = plt.subplots(1, 3, figsize=(11, 5), sharey=True)
    groups = ("EBO_G1", "EBO_G2", "EBO_LIMIT_LARGE", "EBO_LIMIT_SMALL"), ("EBO_MAIN", "EBO_OTHER", "EBO_MAIN_15KV")
    for axis, names in zip(axes, (*groups, ("EBO_MAIN_25KV", "US_WA", "US_WA_TUNNEL"))):
        for name in names:
            axis.plot(*outline(name).T, label=name)
        axis.set(aspect="equal", xlabel="v [m]")
        axis.legend(fontsize=7, loc="lower center")
    axes[0].set_ylabel("w [m]")
    return figure


def draw_section() -> plt.Figure:
    """Draw the points of a pole inside a profile, and its fitted surface."""
    scene = scenes.double_track(1, 800.0)
    rng = scene.rng
    angle, w = rng.uniform(-np.pi / 2, np.pi / 2, 150), rng.uniform(1.4, 2.1, 150)
    place = np.column_stack([0.055 * np.sin(angle), 1.615 + 0.055 * (1 - np.cos(angle)), w])
    place += 0.005 * rng.standard_normal(place.shape)
    depth = 1.645 - place[:, 1]
    centre = np.median(place[np.argsort(-depth)[:6]], axis=0)
    found = surface_of(place, depth, centre, np.array([-1.0, 0.0]), 0.005, lambda one: 1.645 - one[:, 1])
    figure, axis = plt.subplots(figsize=(6, 5))
    axis.plot(place[:, 0] * 1000, place[:, 1] * 1000, ".", color="#1565c0", label="points, from above")
    axis.axhline(1645, color="#2e7d4f", label="profile")
    axis.axhline(1645 - 1000 * found.depth_m, color="#d62839", label=f"surface: {1000 * found.depth_m:.1f} mm inside")
    deepest = 1000 * depth.max()
    axis.axhline(1645 - deepest, color="#f28e2b", ls=":", label=f"deepest point: {deepest:.1f} mm; truth: 30 mm")
    axis.set(xlabel="along the track [mm]", ylabel="v [mm]", aspect="equal")
    axis.invert_yaxis()
    axis.legend(fontsize=8)
    return figure


if __name__ == "__main__":
    main()
