"""Faults of labels, weights and trainings."""

import numpy as np
import pytest
from faults import cancelled, faults
from rail_extract.core.frpdf.models import FOLDER
from rail_extract.laboratory.scenes.raw_shapes import flat, rough, with_track

pytest.importorskip("torch")


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
        if content is not None:
            path.write_bytes(content)
        return {**labelled()(bench), "METHOD": "LEARNED", "WEIGHTS": path, **parameters}

    return prepare


FAULTS = {
    "trainrailclassifier": {
        "training without labels": labelled(RAIL_CLASSES="11"),
        "training with labels of one class only": labelled(lambda xyz, codes: (xyz[codes == 10], codes[codes == 10])),
        "training with labels on the ground": labelled(lambda xyz, codes: (xyz * [1, 1, 0.05], codes)),
        "training with labels in one place": labelled(lambda xyz, codes: (xyz[xyz[:, 0] < 17], codes[xyz[:, 0] < 17])),
        "training cancelled while the cloud is read": cancelled(labelled(), 1),
    },
    "classifyrailpoints": {
        "classification with METHOD LEARNED and no weights: those shipped are used": labelled(METHOD="LEARNED"),
        "classification with weights and METHOD GEOMETRY": weights(b"", METHOD="GEOMETRY"),
        "classification with weights that are missing": weights(None),
        "classification with damaged weights": weights(b"PK\x03\x04 cut"),
        "classification with weights of the network that cleans rasters": labelled(
            METHOD="LEARNED", WEIGHTS=FOLDER / "frpdf_fast.npz"
        ),
    },
    "extractrails": {
        "extraction with METHOD LEARNED from a classified cloud": labelled(METHOD="LEARNED"),
    },
}


@pytest.mark.parametrize("fault", faults("Trained classifiers", FAULTS), ids=str)
def test_fault(meet, fault):
    meet(fault)
