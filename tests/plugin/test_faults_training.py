"""Faults of labels, weights and trainings."""

import numpy as np
import pytest
from faults import Fault, refused
from rail_extract.core.frpdf.models import FOLDER
from rail_extract.laboratory.scenes.raw_shapes import flat, rough, with_track

pytest.importorskip("torch")

TITLE = "Trained classifiers"

CORNER = np.array([500_000.0, 3_000_000.0, 100.0])


def labelled(change=lambda xyz, codes: (xyz, codes), **parameters):
    """A cloud of 8 m of track whose rail points are labelled, changed, and these parameters."""

    def prepare(bench):
        rng = np.random.RandomState(3)
        xyz, on = with_track(flat(8.0, rng=rng, per_m2=300), 1.435, 0.072, 0.3)
        xyz, codes = change(rough(xyz, rng), np.where(on, 10, 2))
        return {"INPUT": bench.cloud(xyz + CORNER, "labelled.laz", codes), **parameters}

    return prepare


def weights(content, **parameters):
    """Weights in a file with this content."""

    def prepare(bench):
        path = bench.folder / "weights.npz"
        if content == "something else":
            np.savez_compressed(path, kernel=np.zeros((5, 2), np.float32))
        elif content is not None:
            path.write_bytes(content)
        return {**labelled()(bench), "METHOD": "LEARNED", "WEIGHTS": path, **parameters}

    return prepare


def cancelled(percent):
    def prepare(bench):
        bench.feedback.progressChanged.connect(lambda done: bench.feedback.cancel() if done >= percent else None)
        return labelled()(bench)

    return prepare


FAULTS = [
    refused(
        "training without labels",
        labelled(RAIL_CLASSES="11"),
        "The cloud has no points of class 11 to learn from: classify its rails, or set the rail classes.",
    ),
    refused(
        "training with labels of one class only",
        labelled(lambda xyz, codes: (xyz[codes == 10], codes[codes == 10])),
        "All points of the cloud are of class 10: give the whole cloud, with the points around the rails.",
    ),
    refused(
        "training with labels on the ground",
        labelled(lambda xyz, codes: (xyz * [1, 1, 0.05], codes)),
        "No point of class 10 is 0.055 to 0.4 m above the bed, where railheads are: check the labels and the unit of "
        "the coordinates.",
    ),
    refused(
        "training with labels in one place",
        labelled(lambda xyz, codes: (xyz[xyz[:, 0] < 17], codes[xyz[:, 0] < 17])),
        "The labelled rails all lie in one place of 20 m: give a longer labelled cloud, so that a part can be kept "
        "back for validation.",
    ),
    refused("training cancelled while the cloud is read", cancelled(1), "Cancelled; nothing was written."),
    refused(
        "training from weights of the network that cleans rasters",
        labelled(START=FOLDER / "frpdf_fast.npz"),
        "frpdf_fast.npz holds the weights of something else: choose a file that Train rail classifier has written.",
    ),
    Fault(
        "classification with METHOD LEARNED and no weights: those shipped are used",
        labelled(METHOD="LEARNED"),
        run="classifyrailpoints",
    ),
    refused(
        "classification with weights and METHOD GEOMETRY",
        weights(b"", METHOD="GEOMETRY"),
        "WEIGHTS are for METHOD LEARNED: choose this method, or leave WEIGHTS empty.",
        run="classifyrailpoints",
    ),
    refused(
        "classification with weights that are missing",
        weights(None),
        "The weights file …weights.npz is missing: choose one that Train rail classifier has written.",
        run="classifyrailpoints",
    ),
    refused(
        "classification with damaged weights",
        weights(b"PK\x03\x04 cut"),
        "The weights file weights.npz cannot be read: choose one that Train rail classifier has written.",
        run="classifyrailpoints",
    ),
    refused(
        "classification with weights of something else",
        weights("something else"),
        "weights.npz holds the weights of something else: choose a file that Train rail classifier has written.",
        run="classifyrailpoints",
    ),
    refused(
        "classification with weights of the network that cleans rasters",
        labelled(METHOD="LEARNED", WEIGHTS=FOLDER / "frpdf_fast.npz"),
        "frpdf_fast.npz holds the weights of something else: choose a file that Train rail classifier has written.",
        run="classifyrailpoints",
    ),
    refused(
        "extraction with METHOD LEARNED from a classified cloud",
        labelled(METHOD="LEARNED"),
        "METHOD LEARNED is for raw clouds: set CLASSIFY, or set METHOD to GEOMETRY.",
        run="extractrails",
    ),
]


@pytest.mark.parametrize("fault", FAULTS, ids=lambda fault: fault.name)
def test_fault(meet, fault):
    meet(fault, "trainrailclassifier")
