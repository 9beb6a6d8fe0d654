"""The model for a rail standard."""

import numpy as np
import pytest
from rail_extract.core.errors import ModelError
from rail_extract.core.frpdf.models import AUTOMATIC, MODELS, choose


@pytest.mark.parametrize("standard", [(1.435, 0.0762), (1.0, 0.06191), (1.676, 0.0667)])
def test_a_standard_gets_the_model_with_the_nearest_ratio(standard):
    automatic = [model for model in MODELS if model.name in AUTOMATIC]
    assert choose(*standard) == min(automatic, key=lambda model: abs(np.log(model.ratio * standard[1] / standard[0])))


@pytest.mark.parametrize("model", MODELS, ids=lambda model: model.name)
def test_a_model_is_chosen_by_its_name(model):
    assert choose(1.0, 0.06191, model.name) == model
    assert model.path.exists()


def test_a_ratio_that_no_model_covers_is_refused():
    with pytest.raises(ModelError, match="GAUGE and HEAD_WIDTH"):
        choose(1.435, 0.150)
