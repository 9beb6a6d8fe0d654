"""A short cloud in several files and the workers of a cluster, for tests of several folders."""

from dataclasses import replace

import numpy as np
import pytest


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
    from rail_extract.core.cluster.workers import connect

    with connect(None, 2) as client:
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
