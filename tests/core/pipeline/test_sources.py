"""Rail points found in raw clouds and sorted into squares: what is said where there are none."""

import numpy as np
import pytest
from rail_extract.core.clouds.points import ask
from rail_extract.core.errors import NoRailPointsError, RailExtractError
from rail_extract.core.parameters import Parameters
from rail_extract.core.pipeline.sources import Raw
from rail_extract.core.progress import SILENT
from rail_extract.core.run.loop import Answer, InTurn, Runner
from rail_extract.core.standards import SEARCHED_CLASSES
from rail_extract.laboratory.scenes.las import write_las

PARAMETERS = Parameters(1.435, 0.072)


class Failing(InTurn):
    """Searches no square."""

    def wait(self, progress, advance):
        is_search = self._started[0][1].label.startswith("Searching")
        name, answer = super().wait(progress, advance)
        return name, Answer(error=ValueError("reason")) if is_search else answer


@pytest.mark.parametrize(
    ("executor", "kind", "words"),
    [
        (InTurn, NoRailPointsError, "No rail was found in the raw cloud: check the rail standard"),
        (Failing, RailExtractError, r"No rail was found, and a part .* the last error was: Searching .* failed"),
    ],
)
def test_a_cloud_that_could_not_be_searched_is_not_called_empty(tmp_path, executor, kind, words):
    ground = np.random.RandomState(1).uniform(0, 5, (2000, 3)) * [1, 1, 0.01]
    request = ask([write_las(tmp_path / "raw.las", ground)], SEARCHED_CLASSES, None, None, SILENT)
    runner = Runner(executor(), tolerant=True)
    with pytest.raises(kind, match=words) as error, Raw(request).sort(tmp_path, PARAMETERS, runner, SILENT):
        pass
    assert [one.name for one in tmp_path.iterdir()] == ["raw.las"]
    assert (type(error.value) is NoRailPointsError) == (kind is NoRailPointsError)
