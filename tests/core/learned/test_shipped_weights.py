"""The shipped weights find rails in clouds from a scanner that they have not learned."""

import pytest
from rail_extract.core.learned.model import SHIPPED
from rail_extract.laboratory.ruler.classification import score
from rail_extract.laboratory.scenes.raw_catalogue import AIR

pytest.importorskip("torch")


def test_the_weights_find_the_rails_in_a_cloud_from_the_air():
    scene = AIR["air 150"](5)
    learned, _ = score(scene, True, SHIPPED)
    assert learned.recall > 0.97
    assert learned.precision > 0.96
