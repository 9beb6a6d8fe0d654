"""Random designs of tracks, a short cloud in several files and workers of a cluster, for tests of several folders."""

from dataclasses import replace

import numpy as np
import pytest
from rail_extract.core.alignment.elements import Alignment, CantElement, Figures, VerticalElement, chained
from rail_extract.core.frame import LocalFrame

FRAME = LocalFrame(np.array([578_200.0, 5_804_300.0, 0.0]), crs_wkt="EPSG:25832")


@pytest.fixture(scope="session")
def tiles(tmp_path_factory):
    """A track of 50 m, in two squares and three files."""
    from rail_extract.core.standards import STANDARDS
    from rail_extract.laboratory.curves import Element, trace
    from rail_extract.laboratory.scenes.plain import spacing
    from rail_extract.laboratory.scenes.scanner import Scanner
    from rail_extract.laboratory.scenes.scene import Plan, build
    from rail_extract.laboratory.scenes.tracks import Track
    from rail_extract.laboratory.scenes.write import write_cloud

    folder = tmp_path_factory.mktemp("tiles")
    standard, curve = STANDARDS["EN_60E1_1435"], trace([Element(50.0)], heading=0.05)
    plan = Plan([Track(curve, spacing(standard), np.zeros(len(curve.xy)))], standard, Scanner(profile_step_m=0.08))
    scene = build("short", plan, np.random.RandomState(4))
    for number, part in enumerate(np.array_split(np.argsort(scene.xyz[:, 0]), 3)):
        part = replace(scene, xyz=scene.xyz[part], classification=scene.classification[part])
        write_cloud(part, folder / f"tile{number}.laz")
    return folder


@pytest.fixture(scope="session")
def client():
    """Two local workers."""
    from rail_extract.core.run.cluster import started

    with started(2) as client:
        yield client


@pytest.fixture(scope="session")
def scheduler(client, tmp_path_factory):
    """Options that name the scheduler of these workers, with its certificates in files."""
    folder, words = tmp_path_factory.mktemp("certificates"), ["--scheduler", client.scheduler.address]
    security = client.security
    texts = {"ca": security.tls_ca_file, "cert": security.tls_client_cert, "key": security.tls_client_key}
    for name, text in texts.items():
        (folder / f"{name}.pem").write_text(text)
        words += [f"--tls-{name}", str(folder / f"{name}.pem")]
    return words


@pytest.fixture(scope="session")
def difference():
    """Return where two results differ by a bit or a type; None if they do not.

    Names that begin with an underscore are caches, which one result may have filled and another not.
    """

    def find(one, other, where="differs"):
        if type(one) is not type(other):
            return where
        if isinstance(one, np.ndarray):
            same = (one.dtype, one.shape, one.tobytes()) == (other.dtype, other.shape, other.tobytes())
            return None if same else where
        if isinstance(one, dict) or hasattr(one, "__dict__"):
            one, other = (
                {
                    name: value
                    for name, value in (fact if isinstance(fact, dict) else vars(fact)).items()
                    if str(name)[:1] != "_"
                }
                for fact in (one, other)
            )
            if one.keys() != other.keys():
                return where
            parts = [(f".{name}", one[name], other[name]) for name in one]
        elif isinstance(one, (tuple, list)):
            parts = [(f"[{number}]", *pair) for number, pair in enumerate(zip(one, other))]
            if len(one) != len(other):
                return where
        else:
            return None if one == other or one != one else where
        return next(filter(None, (find(*pair, where + name) for name, *pair in parts)), None)

    return find


@pytest.fixture(scope="session")
def random_design():
    """A function of a seed: lines, arcs, jumps, clothoids (also between reverse curves), a profile and cant."""
    return design_of


def design_of(seed, track_id=7):
    random = np.random.default_rng(seed)
    bends = [0.0, *(random.choice([-1, 0, 1], 6) / random.uniform(150, 5000, 6)), 0.0]
    shapes = [(random.uniform(20, 200), 0.0, 0.0)]
    for before, after in zip(bends, bends[1:]):
        if random.random() < 0.7 and before != after:
            shapes.append((random.uniform(15, 90), before, after))
        shapes.append((random.uniform(5, 150), after, after))
    plan = chained(tuple(random.uniform(-50, 50, 2)), random.uniform(-3, 3), shapes)
    return Alignment(track_id, FRAME, plan, _profile(random, plan[-1].s_to), _cant(random, plan))


def _profile(random, length_m):
    """Grades and parabolas that continue each other."""
    edges = np.sort(random.uniform(0, length_m, 7))
    edges = np.concatenate([[0.0], edges[np.diff(edges, prepend=0) > 5], [length_m]])
    made, z, grade = [], random.uniform(0, 500), 0.0
    for number, (start, end) in enumerate(zip(edges, edges[1:])):
        after = grade if number % 2 == 0 else random.uniform(-0.03, 0.03)
        made.append(VerticalElement(start, end - start, z, grade, after))
        z, grade = z + 0.5 * (end - start) * (grade + after), after
    return tuple(made)


def _cant(random, plan):
    """Cant in curves, ramps on clothoids; one curve in five has it the wrong way."""
    made, end = [], 0.0
    for one in plan:
        sign = -np.sign(one.k_to) * (1 if random.random() < 0.8 else -1)
        after = end if one.type != "clothoid" else float(sign * random.uniform(0, 0.15))
        made.append(CantElement(one.s_from, one.length_m, end, after))
        end = after
    return tuple(made)


@pytest.fixture(scope="session")
def with_km():
    """A function that states kilometres: those of the ends of each plan element, with a jump at the start of some."""

    def stated(alignment, start_km=12.0, rises=True, jumps=None):
        km, plan = start_km, []
        for number, one in enumerate(alignment.plan):
            km += (jumps or {}).get(number, 0.0)
            after = km + (1 if rises else -1) * one.length_m / 1000
            plan.append(replace(one, figures=Figures(km_from=km, km_to=after)))
            km = after
        return replace(alignment, plan=tuple(plan))

    return stated
