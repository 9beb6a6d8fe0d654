import pytest
from rail_extract.rail_extract_plugin.dialog.passwords import masked

SECRET = "se cr'e,t)@=/"


@pytest.mark.parametrize(
    "text",
    [
        f"dbname='x' user='me' password='{SECRET}' sslmode=disable key='id' table=\"public\".\"rails\" (geom)",
        f"dbname='x' PASSWORD='{SECRET}'",
        f"PG:host=h passwd={SECRET} dbname=x",
        f"{{'RAILS':'postgres://dbname=\\'x\\' password=\\'{SECRET}\\' host=h','CENTERLINES':'a.gpkg'}}",
        "postgresql://me:secrt@x@host:5432/base",
    ],
)
def test_no_part_of_a_password_stays(text):
    shown = masked(text)
    assert "***" in shown
    assert not [part for part in ("se cr", "cr'e", "t)@", "secrt") if part in shown]


def test_the_rest_of_a_connection_stays():
    shown = masked("dbname='x' user='me' password='secret' sslmode=disable table=\"rails\"")
    assert shown == "dbname='x' user='me' password=*** sslmode=disable table=\"rails\""
    assert masked("postgresql://me:secret@host/base") == "postgresql://me:***@host/base"


@pytest.mark.parametrize("text", ["service='survey' authcfg=abc1234", "/data/password file.gpkg", "https://a.b/c:d"])
def test_texts_without_passwords_stay(text):
    assert masked(text) == text


def test_report_and_messages_show_no_password(run, write_cloud, track, tmp_path, new_feedback):
    database = (
        "postgres://dbname='none' host=127.0.0.1 port=1 user='me' password='secret7' table=\"public\".\"rails\" (geom)"
    )
    feedback = new_feedback()
    outputs = {"CENTERLINES": tmp_path / "tracks.gpkg", "REPORT": tmp_path / "report.html"}
    outcome = run({"INPUT": write_cloud(track()), "ITERATIONS": 1, "RAILS": database, **outputs}, feedback)
    assert not outcome.ok
    assert "secret7" not in outcome.error + feedback.said()
    if outputs["REPORT"].exists():
        page = outputs["REPORT"].read_text(encoding="utf-8")
        assert "password=***" in page
        assert "secret7" not in page
