"""Rail points found in raw clouds and sorted into squares: what is said where there are none."""

from dataclasses import replace

import numpy as np
import pytest
from rail_extract.core.clouds.points import ask
from rail_extract.core.errors import NoRailPointsError, RailExtractError
from rail_extract.core.parameters import Parameters
from rail_extract.core.pipeline import extract_files
from rail_extract.core.pipeline.sources import Raw
from rail_extract.core.progress import SILENT
from rail_extract.core.run.tasks import Answer, InTurn, Runner
from rail_extract.core.standards import SEARCHED_CLASSES
from rail_extract.laboratory.ruler.worlds import run
from rail_extract.laboratory.scenes.las import write_las
from rail_extract.laboratory.scenes.mixed import mixed
from rail_extract.laboratory.scenes.write import write_raw
from rail_extract.laboratory.worlds.world import make

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


def test_blunt_sources_of_a_raw_cloud_are_searched_and_drawn_apart(tmp_path):
    """A scanner and images in files without ids: only the scanner has times."""
    scene = mixed(3, scanned=0.5)
    files = []
    for number in (0, 1):
        own = scene.passes == number
        part = replace(
            scene, xyz=scene.xyz[own], kind=scene.kind[own], strips=None, times=1000 + np.arange(own.sum()) / 5e5
        )
        files.append(tmp_path / f"{number}.laz")
        write_raw(replace(part, classification=np.ones(own.sum(), np.uint8) if number else None), files[-1])
    scanner, both = (extract_files(asked(*some), tmp_path, PARAMETERS, Runner()) for some in (files[:1], files))
    sharp, blunt = ([rail for rail in both.rails if rail.fills == fills] for fills in (False, True))
    shift = both.frame.shift_to(scanner.frame)
    for one, other in zip(sharp, scanner.rails):
        np.testing.assert_allclose(one.xyz + shift, other.xyz, rtol=0, atol=1e-5)
    assert len(sharp) == len(scanner.rails) == len(blunt) == 4
    assert sum(rail.length_m for rail in blunt) == pytest.approx(119, abs=2)
    assert both.search.paired_m == scanner.search.paired_m
    assert both.search.blunt_m == pytest.approx(240, abs=2)


def test_heads_in_a_raw_cloud_from_the_air_have_no_edges():
    """The points that are found on heads are cut at both sides: they look sharp, and their lines were 9 mm off."""
    judged = run(make(9212))
    assert judged.network.heads.blunt
    assert judged.figures["across mm"] < 4


def test_rails_that_are_no_ridges_need_no_partner(tmp_path):
    """From the air, heads are blunt, but bars as narrow as heads were looked for, and 60 m of rail were dropped."""
    world = make(9212)
    world.write(tmp_path / "world.laz")
    standard = world.scene.standard
    parameters = Parameters(standard.gauge_m, standard.head_width_m)
    with asked(tmp_path / "world.laz").sort(tmp_path, parameters, Runner(), SILENT) as points:
        assert [source.blunt for source in points.classes] == [True]
        assert not points.only_pairs


def asked(*files):
    return Raw(ask(files, SEARCHED_CLASSES, None, None, SILENT))
