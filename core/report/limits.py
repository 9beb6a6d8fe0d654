"""Table of lengths beyond limits, which the reader of the report can change in the page.

The page counts again by itself: each row holds the length beyond every whole limit, so that no station has to be stored
and nothing is sent anywhere. Without scripts, as in mail programs, the table shows the limits of the run.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..checks.findings import GAUGE_OFF_MM, GAUGE_SIGMAS, UNSUPPORTED, UNSURE_MM, TrackFindings, gauge_off
from ..progress import metres
from ..tracks.geometry import TWIST_BASE_M
from .markup import note, tag, text

MAX_LIMIT_MM = 500
"""Largest limit for which lengths are held: more than the cant of any track."""

SCRIPT = """
(function () {
  function metres(length) {
    if (length >= 10000) { return (length / 1000).toFixed(1) + " km"; }
    return length.toFixed(length < 10 ? 1 : 0) + " m";
  }
  function count(input) {
    var limit = Math.round(Number(input.value)), given = input.value !== "" && limit >= 0;
    var rows = document.querySelectorAll('tr[data-quantity="' + input.getAttribute("data-limit") + '"]');
    for (var i = 0; i < rows.length; i++) {
      var lengths = rows[i].getAttribute("data-beyond").split(" "), of = Number(rows[i].getAttribute("data-length"));
      var beyond = Number(lengths[limit] || 0), cells = rows[i].cells;
      cells[4].textContent = given ? metres(beyond) : "";
      cells[5].textContent = given && of > 0 ? (100 * beyond / of).toFixed(1) + " %" : "";
    }
  }
  var inputs = document.querySelectorAll("input[data-limit]");
  for (var i = 0; i < inputs.length; i++) {
    inputs[i].oninput = inputs[i].onchange = function () { count(this); };
    count(inputs[i]);  // browsers keep what was entered when a page is loaded again
  }
})();
"""

NOTE = (
    "Change a limit, in whole millimetres, and the lengths beyond it are counted again, in this page only. Deviations "
    f"count to either side, those of the gauge only where they exceed {GAUGE_SIGMAS:g} standard errors: smaller ones "
    "may be errors of the measurement. Stations where a rail has no points are left out. Limits of cant and twist "
    "depend on line, speed and standard: enter yours."
)


@dataclass(frozen=True)
class Quantity:
    """A measured quantity that may have a limit in this run; `name` connects its input with its rows in the page."""

    name: str
    label: str
    limit_mm: float | None = None

    def of(self, track: TrackFindings) -> np.ndarray:
        """Return the values that are compared with the limit at the stations of a track, (n,) mm, none below 0."""
        geometry = track.geometry
        values = {
            "gauge": np.abs(geometry.gauge_mm - track.nominal_mm),
            "cant": np.abs(geometry.cant_mm),
            "twist": np.abs(geometry.twist_mm),
            "sigma": np.fmax(geometry.sigma_mm, geometry.sigmaz_mm),
        }
        return np.where(track.doubtful[UNSUPPORTED], np.nan, values[self.name])

    def sure(self, track: TrackFindings) -> np.ndarray:
        """Return those values, (n,) mm, but 0 where a deviation of the gauge may be an error."""
        values = self.of(track)
        return np.minimum(values, gauge_off(track.geometry, track.nominal_mm)) if self.name == "gauge" else values


QUANTITIES = (
    Quantity("gauge", "Gauge, off nominal", GAUGE_OFF_MM),
    Quantity("cant", "Cant"),
    Quantity("twist", f"Twist over {TWIST_BASE_M:g} m"),
    Quantity("sigma", "Standard error, across or in height", UNSURE_MM),
)


def limits_table(tracks: Sequence[TrackFindings]) -> str:
    """Return inputs for the limits and the table of what is beyond them, with the script that counts again."""
    headings = ("Track", "Quantity", "Largest", "at", "Beyond the limit", "of the length")
    head = tag("tr", *(tag("th", text(heading)) for heading in headings))
    rows = [_row(quantity, track) for quantity in QUANTITIES for track in tracks]
    written = tag("table", tag("thead", head), tag("tbody", *rows), class_="quantities")
    inputs = tag("p", *map(_input, QUANTITIES), class_="limits")
    return inputs + tag("div", written, class_="scroll tall") + note(NOTE) + f"<script>{SCRIPT}</script>"


def lengths_beyond(values_mm: np.ndarray, length_m: np.ndarray) -> np.ndarray:
    """Return the lengths with values above 0, 1, 2 mm and so on up to the largest value, (k,) metres.

    Examples
    --------
    >>> lengths_beyond(np.array([0.5, 2.0, 2.1, np.nan]), np.array([1.0, 1.0, 2.0, 1.0])).tolist()
    [4.0, 3.0, 2.0]
    """
    known = np.isfinite(values_mm)
    highest = np.ceil(np.minimum(values_mm[known], MAX_LIMIT_MM + 1)).astype(int)  # above all limits smaller than this
    held = np.bincount(highest, length_m[known], minlength=1)
    return np.cumsum(held[:0:-1])[::-1]


def _input(quantity: Quantity) -> str:
    """Write the input for a limit."""
    value = "" if quantity.limit_mm is None else f"{quantity.limit_mm:g}"
    settings = {"type": "number", "min": 0, "max": MAX_LIMIT_MM, "step": 1, "value": value}
    entry = tag("input", **settings, data_limit=quantity.name).replace("</input>", "")  # an element without an end
    return tag("label", text(f"{quantity.label} "), entry, text(" mm"))


def _row(quantity: Quantity, track: TrackFindings) -> str:
    """Write how much of a track is beyond the limit, with the lengths beyond every other one."""
    values, cells_m = quantity.of(track), track.geometry.cells_m
    beyond_m = lengths_beyond(quantity.sure(track), cells_m)
    length_m = float(cells_m[np.isfinite(values)].sum())
    largest = at = over = share = ""
    if length_m:
        worst = int(np.nanargmax(values))
        largest, at = f"{values[worst]:.1f} mm", f"{track.geometry.chainage_m[worst]:,.1f} m"
    if quantity.limit_mm is not None:
        over_m = float(beyond_m[int(quantity.limit_mm)]) if len(beyond_m) > quantity.limit_mm else 0.0
        over, share = metres(over_m), f"{100 * over_m / length_m:.1f} %" if length_m else ""
    cells = (str(track.line.track_id), quantity.label, largest, at, over, share)
    lengths = " ".join(f"{one:.1f}" for one in beyond_m)
    content = (tag("td", text(cell)) for cell in cells)
    return tag("tr", *content, data_quantity=quantity.name, data_length=f"{length_m:.1f}", data_beyond=lengths)
