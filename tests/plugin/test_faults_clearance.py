"""Faults of tracks, profiles and clouds in Measure Clearance."""

import numpy as np
import pytest
from faults import faults
from memory_layers import layer_of

LINE = np.array([[500_000.0 + x, 3_000_000.0, 100.0] for x in range(81)])
IDS = "&field=track_id:integer&field=left_ids:string&field=right_ids:string&field=cantmax_mm:double"
NUMBERS = "&field=v_m:double&field=w_m:double"
HALF = [(1.6, 0.4), (1.6, 3.0), (0.0, 4.3)]


def track(line=LINE, left="2", right="1", crs="EPSG:32643", kind="LineStringZ", cant_mm=0.0):
    return lambda: layer_of(line, kind=kind, crs=crs, fields=IDS, values=[(1, left, right, cant_mm)])


def rails(spacing_m=1.507, shift_m=0.0):
    def made():
        lines = [LINE + [0.0, side * spacing_m / 2 + shift_m, 0.0] for side in (-1, 1)]
        return layer_of(*lines, fields="&field=rail_id:integer", values=[(1,), (2,)])

    return made


def cloud(bench, shift=(0.0, 0.0, 0.0), class_code=1):
    """The bed, and a plate 100 mm inside EBO_G1 on the left."""
    rng = np.random.RandomState(1)
    bed = rng.uniform((0, -3, -0.3), (80, 3, -0.2), (40_000, 3))
    plate = np.column_stack([rng.uniform(39.8, 40.2, 200), np.full(200, 1.545), rng.uniform(1.5, 2.5, 200)])
    xyz = np.concatenate([bed, plate + 0.003 * rng.standard_normal(plate.shape)])
    return bench.cloud(xyz + LINE[0] + shift, class_code=class_code)


def profile(points, fields=NUMBERS):
    return lambda: layer_of(kind="None", fields=fields, values=points)


def given(shift=(0.0, 0.0, 0.0), class_code=1, **parameters):
    """Inputs without a fault, and those that replace them."""

    def prepare(bench):
        chosen = {"INPUT": track(), "RAILS": rails(), **parameters}
        made = {name: value() if callable(value) else value for name, value in chosen.items()}
        return {"POINTS": cloud(bench, shift, class_code), **made}

    return prepare


def own(points, **more):
    return given(PROFILE="CUSTOM", PROFILE_FILE=profile(points), **more)


FAULTS = {
    "measureclearance": {
        "a plate inside the profile": given(),
        "CUSTOM without a profile": given(PROFILE="CUSTOM"),
        "profile without its columns": given(
            PROFILE="CUSTOM", PROFILE_FILE=profile(HALF, "&field=x:double&field=y:double")
        ),
        "profile of two points": own(HALF[:2]),
        "profile in millimetres": own([(1600, 400), (1600, 3000), (0, 4300)]),
        "profile that crosses itself": own([(1, 0.4), (-1, 2), (1, 2), (-1, 0.4)]),
        "profile that is open at its top": own([(1.6, 0.4), (1.6, 3.0), (0.5, 4.3)]),
        "profile with an empty number": own([*HALF[:2], (0.0, None)]),
        "profile beside a named one": given(PROFILE_FILE=profile(HALF)),
        "widening without a rule": given(PROFILE="US_WA", WIDENING="EBO"),
        "centerlines without heights": given(INPUT=track(LINE[:, :2], kind="LineString")),
        "rails in place of centerlines": given(INPUT=rails()),
        "centerlines without rails": given(INPUT=track(left="", right="", cant_mm=100.0)),
        "rails that RAILS lacks": given(INPUT=track(left="7", right="8", cant_mm=100.0)),
        "canted track without RAILS": given(INPUT=track(cant_mm=100.0), RAILS=None),
        "rails of another run": given(RAILS=rails(shift_m=0.2)),
        "tracks of another place": given(shift=(0.0, 5000.0, 0.0)),
        "cloud with other heights": given(shift=(0.0, 0.0, -46.0)),
        "cloud with heights from the ground": given(shift=(0.0, 0.0, -5.0)),
        "class that the cloud lacks": given(CLASSES_OUT="5"),
        "classes in words": given(CLASSES_OUT="trees"),
        "cloud of rail points": given(class_code=10),
    },
}


@pytest.mark.parametrize("fault", faults("Clearance", FAULTS), ids=str)
def test_fault(meet, fault):
    meet(fault)
