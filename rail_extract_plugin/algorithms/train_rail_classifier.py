"""Train Rail Classifier: a network that learns rail points from labelled clouds."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ...core.disk import Destination
from ...core.jobs.clouds import CloudSource, request_points
from ...core.jobs.train_rail_classifier import JOB
from ...core.progress import Estimating, Progress
from ...core.standards import SEARCHED_CLASSES, RailStandard
from ..dialog.parameter_values import ParameterValues
from ..writing.reports import write_page
from .base import RailAlgorithm

if TYPE_CHECKING:
    from ...core.labelling.training import Plan


@dataclass(frozen=True)
class Job:
    """The values of the parameters."""

    cloud: CloudSource
    standard: RailStandard
    plan: Plan


class TrainRailClassifier(RailAlgorithm):
    """The algorithm ``railextract:trainrailclassifier``."""

    JOB = JOB

    def read(self, values: ParameterValues) -> Job:
        """Read and check the parameters, in the main thread."""
        from ...core.labelling.training import Plan, check_training

        epochs, seed = int(values.number("EPOCHS")), int(values.number("SEED"))
        plan = Plan(values.class_codes(), epochs, seed, values.choice("DEVICE"), values.file("START"))
        check_training(Path(values.output_file("WEIGHTS")), plan)
        return Job(values.cloud("INPUT"), values.standard(), plan)

    def compute(self, job: Job, values: ParameterValues, progress: Progress) -> dict[str, Any]:
        """Train, and write the weights and the card."""
        from ...core.classify.settings import Settings
        from ...core.labelling.training import train_classifier
        from ...core.report.training_card import build_card, facts_of

        progress = Estimating(progress)
        request = request_points(job.cloud, SEARCHED_CLASSES, values.extent, progress)
        settings = Settings((job.standard.gauge_m,), job.standard.head_width_m)
        # QGIS chooses the names of temporary files during the run.
        weights, card = map(values.output_file, ("WEIGHTS", "CARD"))
        destination = self.destinations.get("WEIGHTS") or Destination.at(Path(weights))
        trained = train_classifier(request, settings, job.plan, destination, progress)
        results = {"WEIGHTS": weights}
        if card:
            names = [header.path.name for header in request.headers]
            page = build_card(trained, names, facts_of(trained, job.plan, job.standard))
            results.update(write_page(values, "CARD", card, page))
        total = trained.total
        return {**results, "RECALL": total.recall, "PRECISION": total.precision, "STEPS": trained.steps}
