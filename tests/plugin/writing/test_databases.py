"""Outputs on a real PostgreSQL server: refused before the run if they cannot be written, and without passwords."""

import os
import shutil
import socket
import subprocess
import tempfile
from pathlib import Path

import pytest
from qgis.core import QgsFeature, QgsGeometry, QgsVectorLayer
from rail_extract.core.errors import RailExtractError
from rail_extract.rail_extract_plugin.writing.destinations import destinations

PROGRAMS = sorted(Path("/usr/lib/postgresql").glob("*/bin/initdb"))
ACCOUNT = "postgres"
"""The server refuses to run as root."""

PASSWORD = "s'e c\\ret/@x"


@pytest.fixture(scope="module")
def server():
    """A server with a database that has PostGIS and one that has not; returns its port."""
    if not PROGRAMS:
        pytest.skip("PostgreSQL is not installed")
    as_account = {"user": ACCOUNT, "group": ACCOUNT} if os.getuid() == 0 else {}
    folder = Path(tempfile.mkdtemp(dir="/tmp"))  # where its account may read
    if as_account:
        shutil.chown(folder, ACCOUNT, ACCOUNT)
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    (folder / "password").write_text(PASSWORD)
    (folder / "password").chmod(0o644)
    data, programs = folder / "data", PROGRAMS[-1].parent

    def call(program, *words):
        quiet = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
        subprocess.run([programs / program, *words], check=True, cwd=folder, **as_account, **quiet)

    call("initdb", "-D", data, "-U", "owner", f"--pwfile={folder / 'password'}", "-A", "scram-sha-256")
    listen = f"-p {port} -k {folder} -c listen_addresses=127.0.0.1 -c fsync=off"
    call("pg_ctl", "-D", data, "-o", listen, "-w", "-l", folder / "log", "start")
    try:
        sql(port, "postgres", "CREATE DATABASE rails")
        sql(port, "postgres", f"CREATE USER guest PASSWORD '{PASSWORD.replace(chr(39), chr(39) * 2)}'")
        sql(port, "rails", 'CREATE SCHEMA "o\'dd"')
        try:
            sql(port, "rails", "CREATE EXTENSION postgis")
        except subprocess.CalledProcessError:
            pytest.skip("PostGIS is not installed")
        yield port
    finally:
        call("pg_ctl", "-D", data, "-m", "immediate", "stop")
        shutil.rmtree(folder, ignore_errors=True)


def sql(port, database, command):
    """Run SQL and return what it prints."""
    call = ["psql", "-h", "127.0.0.1", "-p", str(port), "-U", "owner", "-d", database, "-tA", "-c", command]
    environment = {**os.environ, "PGPASSWORD": PASSWORD}
    return subprocess.run(call, check=True, env=environment, capture_output=True, text=True).stdout.strip()


def table(port, database="rails", user="owner", password=PASSWORD, place='table="public"."rails" (geom)'):
    """The value of an output."""
    quoted = password.replace("\\", "\\\\").replace("'", "\\'")
    where = f"dbname='{database}' host=127.0.0.1 port={port} user='{user}' password='{quoted}'"
    return f"postgis:{where} sslmode=disable {place}"


@pytest.mark.parametrize(
    ("changes", "sentence"),
    [
        ({"password": "wrong secret"}, "the database rails does not answer or refuses the user owner: check host"),
        ({"user": "nobody"}, "refuses the user nobody"),
        ({"database": "none"}, "the database none does not answer"),
        ({"port": 1}, "the database rails does not answer"),
        ({"place": 'table="gone"."rails" (geom)'}, "the database rails has no schema gone"),
        ({"place": ""}, "RAILS names no table of the database rails"),
        ({"user": "guest"}, "may not create tables in the schema public of the database rails"),
        ({"database": "postgres"}, "the database postgres has no PostGIS: run CREATE EXTENSION postgis there"),
    ],
)
def test_a_table_that_cannot_be_written_is_refused_before_the_run(server, context, changes, sentence):
    with pytest.raises(RailExtractError, match=sentence) as caught:
        destinations({"RAILS": table(**{"port": server, **changes})}, context)
    assert PASSWORD not in str(caught.value)
    assert "wrong secret" not in str(caught.value)


def rails():
    layer = QgsVectorLayer("LineStringZ?crs=EPSG:32643", "rails", "memory")
    for y in (3000000, 3000001.507):
        feature = QgsFeature()
        feature.setGeometry(QgsGeometry.fromWkt(f"LINESTRING Z (500000 {y} 100, 500020 {y} 100)"))
        assert layer.dataProvider().addFeature(feature)
    return layer


@pytest.mark.parametrize(
    "place", ['table="public"."tracks" (geom)', 'table="tracks" (geom)', 'table="o\'dd"."tracks" (geom)']
)
def test_a_table_is_written_and_replaced(server, run_step, place):
    for _ in range(2):
        outcome = run_step("buildtrackcenterlines", {"INPUT": rails(), "OUTPUT": table(server, place=place)})
        assert outcome.ok, outcome.error
    schema = '"o\'dd".' if "dd" in place else ""
    found = sql(server, "rails", f"SELECT gauge_mm, ST_AsText(geom), ST_SRID(geom) FROM {schema}tracks")
    assert found == "1435|LINESTRING Z (500000 3000000.7535 100,500020 3000000.7535 100)|32643"


def test_no_report_and_no_message_has_the_password(server, run_step, bench, tmp_path):
    path = tmp_path / "report.html"
    outputs = {"RAILS": table(server), "CENTERLINES": table(server, place='table="tracks" (geom)'), "REPORT": path}
    cloud = bench.cloud(bench.track(length_m=6.0))
    outcome = run_step("extractrails", {"INPUT": cloud, "ITERATIONS": 1, **outputs}, bench.feedback)
    assert outcome.ok, outcome.error
    page = path.read_text(encoding="utf-8")
    assert "postgis:" in page and "127.0.0.1" in page
    for text in (page, bench.feedback.said()):
        assert "c\\ret" not in text and "ret/@x" not in text
    assert sql(server, "rails", "SELECT count(*) FROM rails") == "2"
