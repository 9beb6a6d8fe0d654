"""The layer of findings, as the dock reads and writes it."""

from __future__ import annotations

from dataclasses import dataclass

from qgis.core import NULL, QgsFeature, QgsProject, QgsVectorLayer

from ...core.fields import FINDING_FIELDS

ACCEPTED, REJECTED, OPEN = "accepted", "rejected", ""
"""Values of the field `review`."""

NEEDED = {"finding", "reason", "review"}, {"intrusion", "pen_mm", "review"}
"""Fields by which layers of findings and of intrusions are recognized; shapefiles keep their names, too."""


def findings_layers() -> list[QgsVectorLayer]:
    """Return the layers of findings in the project, in the order of their names."""
    layers = QgsProject.instance().mapLayers().values()
    return sorted(filter(is_findings, layers), key=lambda layer: layer.name())


def is_findings(layer) -> bool:
    """Return whether a layer has the fields of findings, or of intrusions."""
    if not isinstance(layer, QgsVectorLayer) or not layer.isValid():
        return False
    names = set(layer.fields().names())
    return any(names >= needed for needed in NEEDED)


@dataclass(frozen=True)
class Review:
    """A finding in the dock."""

    feature: QgsFeature

    def value(self, name: str):
        """Return the value of a field; None if it is empty or missing."""
        index = self.feature.fields().lookupField(name)
        value = self.feature.attribute(index) if index >= 0 else NULL
        return None if value == NULL else value

    @property
    def decision(self) -> str:
        """The user's decision."""
        return self.value("review") or OPEN

    @property
    def is_intrusion(self) -> bool:
        """Whether it is an object inside a profile."""
        return self.value("pen_mm") is not None

    @property
    def number(self) -> int | None:
        """Number in the layer."""
        return self.value("intrusion") if self.is_intrusion else self.value("finding")

    @property
    def reason(self) -> str:
        """Why to look there."""
        if not self.is_intrusion:
            return self.value("reason") or ""
        doubt = "" if self.value("sure") else ", in doubt"
        return ", ".join(filter(None, (f"{self.value('pen_mm'):.1f} mm inside{doubt}", self.value("what"))))

    @property
    def at_m(self) -> float | None:
        """Chainage of the worst place."""
        return self.value("chainage_m") if self.is_intrusion else self.value("worst_m")

    @property
    def where(self) -> str:
        """Track or rail and chainages."""
        rail, track = self.value("rail_id"), self.value("track_id")
        what = f"Rail {rail}" if rail is not None else f"Track {track}"
        start, end = self.value("from_m"), self.value("to_m")
        return what if start is None or end is None else f"{what}, {start:,.1f} to {end:,.1f} m"

    @property
    def figures(self) -> str:
        """Length in doubt, and the figures at the worst place."""
        written = {"doubt_m": "{:,.1f} m in doubt", "gauge_mm": "gauge {:.1f} mm", "cant_mm": "cant {:.1f} mm"}
        written |= {"sigma_mm": "standard error {:.1f} mm across", "sigmaz_mm": "{:.1f} mm in height"}
        written |= {"points": "{:,} points"}
        if self.is_intrusion:
            written = {"sigma_mm": "standard error {:.1f} mm", "side": "on the {}", "w_mm": "{:.0f} mm above the rails"}
            written |= {"points": "{:,} points", "class_code": "class {}"}
        known = {name: self.value(name) for name in written}
        return ", ".join(written[name].format(known[name]) for name in written if known[name] is not None)

    @property
    def worst_share(self) -> float:
        """Share of the section's length at which the worst place lies."""
        start, end, worst = (self.value(name) for name in ("from_m", "to_m", "worst_m"))
        if None in (start, end, worst) or end <= start:
            return 0.5
        return min(max((worst - start) / (end - start), 0.0), 1.0)


def reviews(layer: QgsVectorLayer) -> list[Review]:
    """Return the findings of a layer that have a place, in their order."""
    found = [Review(feature) for feature in layer.getFeatures() if feature.hasGeometry()]
    last = len(FINDING_FIELDS) + len(found)
    return sorted(found, key=lambda one: (one.number or last, one.feature.id()))


def decide(layer: QgsVectorLayer, review: Review, decision: str) -> str:
    """Write a decision; returns what went wrong, if anything, and leaves a running edit session open."""
    index, editing = layer.fields().lookupField("review"), layer.isEditable()
    if not editing and not layer.startEditing():
        return f'The layer "{layer.name()}" can\'t be edited: save it as a GeoPackage.'
    changed = layer.changeAttributeValue(review.feature.id(), index, decision)
    if not editing and not (changed and layer.commitChanges()):
        reason = " ".join(layer.commitErrors())
        layer.rollBack()
        return f'The layer "{layer.name()}" can\'t be changed ({reason}): save it as a GeoPackage.'
    return "" if changed else f'The layer "{layer.name()}" can\'t be changed: save it as a GeoPackage.'
