"""Train Rail Classifier: a network that learns rail points from labelled clouds."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from ..parameters import DEFAULT_EPOCHS
from ..progress import Estimating, Progress, Until
from ..standards import SEARCHED_CLASSES
from . import inputs, methods, outputs
from .declaration import CLOUD_NEEDS, CLOUD_WORDS, RAIL_WORDS, RAW_CLOUDS, Figure, FileInput, FileOutput, Number
from .result import Result
from .values import Job, Values

if TYPE_CHECKING:
    from ..learned.blocks import Plan

MAX_EPOCHS, MAX_SEED = 10_000, 2**31 - 1
"""Weeks on any computer, and the largest seed of a random generator."""


def _plan(values: Values) -> Plan:
    """Return what the training is given, besides the cloud."""
    from ..learned.blocks import Plan

    return Plan(values.class_codes(), values["EPOCHS"], values["SEED"], values["DEVICE"], values["START"])


def _check(values: Values) -> None:
    """Check the plan, the weights and the rail."""
    from ..labelling.training import check_training

    check_training(values.path("WEIGHTS"), _plan(values))
    values.standard()


def _run(values: Values, progress: Progress) -> Result:
    """Train and write the weights."""
    from ..classify.settings import Settings
    from ..labelling.training import train_classifier
    from ..report.training_card import build_card, facts_of

    if values["MINUTES"] is not None:
        progress = Until(progress, 60 * values["MINUTES"])
    progress, standard, plan = Estimating(progress), values.standard(), _plan(values)
    request = values.request(SEARCHED_CLASSES, progress)
    settings = Settings((standard.gauge_m,), standard.head_width_m)
    weights = values.destination("WEIGHTS")
    trained = train_classifier(request, settings, plan, weights, progress)
    names, total = [header.path.name for header in request.headers], trained.total
    return Result(
        {
            "WEIGHTS": str(weights.path),
            "RECALL": total.recall,
            "PRECISION": total.precision,
            "STEPS": trained.steps,
        },
        request.zero,
        pages={"CARD": lambda: build_card(trained, names, facts_of(trained, plan, standard))},
        sentences=(
            f"recall {total.recall:.3f}, precision {total.precision:.3f}, F1 {total.f1:.3f} of blocks kept back",
        ),
    )


JOB = Job(
    "trainrailclassifier",
    "Train rail classifier",
    "Trains a network on clouds whose rail points have a class, so that it classifies other clouds.",
    "Choose clouds with labelled rail points, the classes of these points and a file for the weights, then run. "
    "All other points are examples of what is not on rails: the clouds must contain them. A training takes minutes "
    "on a GPU and hours on a CPU.\n\n"
    "Classify rail points and Extract rails use the weights if a trained classifier finds rail points there. "
    "A classifier knows the scanner that it learned from; for other scanners, geometry is often better. A fifth "
    "of the places is kept back, and the card states how well the classifier labels them.\n\n"
    "A cancelled run keeps what it has learned in a folder next to the weights. The same run continues it.",
    (*RAIL_WORDS, *CLOUD_WORDS, "classification", "training", "RandLA-Net", "deep learning", "neural network"),
    (*CLOUD_NEEDS, ("torch",)),
    (
        inputs.CLOUD,
        inputs.RAIL_CLASSES,
        *inputs.RAIL,
        *inputs.AREA,
        Number(
            "EPOCHS",
            "Epochs",
            "How many times each block of 4 m with rails is learned from. More take longer and may find more.",
            default=DEFAULT_EPOCHS,
            low=1,
            high=MAX_EPOCHS,
            whole=True,
        ),
        FileInput(
            "START",
            "Weights to start from",
            "Weights that have learned from other clouds, such as rail_classifier.npz in the folder models of the "
            "plugin: fewer labels and epochs do. Leave empty to start from random weights.",
            advanced=True,
            optional=True,
            kinds=methods.WEIGHT_FILES,
        ),
        Number(
            "SEED",
            "Seed",
            "Of the random numbers. It also chooses the places that are kept back.",
            advanced=True,
            default=0,
            high=MAX_SEED,
            whole=True,
        ),
        Number(
            "MINUTES",
            "Longest time [min]",
            "The training is cancelled after this time and keeps what it has learned. Leave empty for no limit.",
            advanced=True,
            optional=True,
        ),
        replace(
            methods.DEVICE,
            label="Device of the training",
            help="CPU, or CUDA for an Nvidia GPU. AUTO uses the GPU if there is one.",
        ),
    ),
    (
        FileOutput(
            "WEIGHTS",
            "Weights of the classifier",
            "The trained classifier. Until the training is complete, a folder next to it keeps what was learned, and a "
            "run with the same name continues.",
            kinds=methods.WEIGHT_FILES,
        ),
        FileOutput(
            "CARD",
            "Card",
            "A web page with recall and precision by tile, the course of the training, and its settings.",
            optional=True,
            kinds=outputs.WEB_PAGES,
        ),
    ),
    (
        Figure("RECALL", "Share of the rail points kept back that are found"),
        Figure("PRECISION", "Share of the points found that are rail points"),
        Figure("STEPS", "Steps of the training"),
    ),
    RAW_CLOUDS,
    picture="gauge.svg",
    call="train_classifier",
    check=_check,
    run=_run,
)
