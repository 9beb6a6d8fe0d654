"""Measures a scene as a user's run does."""

from __future__ import annotations

import numpy as np
import pytest
from rail_extract.core.clearance.measure import measure
from rail_extract.core.clearance.profiles import named
from rail_extract.core.clearance.settings import Settings
from rail_extract.core.clouds.points import ask
from rail_extract.core.run.tasks import Runner
from rail_extract.laboratory.scenes.clearance import courses_of, write_points


@pytest.fixture
def swept(tmp_path):
    """Return a function that measures a scene; its points may be divided and mixed before."""

    def swept(scene, profile="EBO_G1", parts=None, with_rails=True, courses=None, **settings):
        folder = tmp_path / str(len(list(tmp_path.iterdir())))
        (folder / "cloud").mkdir(parents=True)
        xyz, code = scene.points, scene.codes
        for number, part in enumerate(parts(xyz) if parts else [np.arange(len(xyz))]):
            write_points(folder / "cloud" / f"{number}.laz", xyz[part], code[part])
        request = ask(folder / "cloud", range(256))
        chosen = named()[profile] if isinstance(profile, str) else profile
        courses = courses_of(scene, with_rails) if courses is None else courses
        return measure(request, courses, Settings(chosen, **settings), folder / "work", Runner())

    return swept
