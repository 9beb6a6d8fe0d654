"""The shipped weights find more from the air than geometry does, which is why they are shipped."""

import pytest
from rail_extract.core.learned.model import SHIPPED
from rail_extract.laboratory.ruler.classification import score
from rail_extract.laboratory.scenes.raw_catalogue import AIR

pytest.importorskip("torch")


def test_the_weights_find_more_than_geometry_in_a_cloud_from_the_air():
    scene = AIR["air 150"](5)
    geometry, learned = (score(scene, True, weights)[0] for weights in (None, SHIPPED))
    assert learned.recall > max(geometry.recall, 0.97)
    assert learned.precision > max(geometry.precision, 0.96)
