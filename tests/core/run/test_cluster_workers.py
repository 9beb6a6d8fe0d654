"""Who may talk to the workers: nobody without the certificate, and only from this computer."""

import os
import socket
import ssl
from http.client import HTTPConnection, HTTPException

import psutil
import pytest
from distributed import Client, LocalCluster
from distributed.comm.addressing import parse_host_port
from distributed.security import Security
from rail_extract.core.errors import ParameterError, RailExtractError
from rail_extract.core.run.cluster import Certificates, running, started


def listening():
    """Addresses at which this process and those it has started wait for connections."""
    me = psutil.Process()
    processes = [me, *me.children(recursive=True)]
    return {
        (one.laddr.ip, one.laddr.port)
        for process in processes
        for one in process.net_connections("inet")
        if one.status == psutil.CONN_LISTEN
    }


def plain(connection):
    """Talk to a worker without TLS."""
    return connection


def without_certificate(connection):
    """Talk to a worker with TLS, but without a certificate of one's own."""
    context = ssl.create_default_context()
    context.check_hostname, context.verify_mode = False, ssl.CERT_NONE
    return context.wrap_socket(connection)


def answers(talk, connection):
    """Return whether anything comes back."""
    try:
        stream = talk(connection)
        stream.sendall(b"x" * 64)
        return bool(stream.recv(64))
    except (ssl.SSLError, ConnectionError):
        return False


@pytest.fixture
def others():
    """Addresses that are in use without our workers."""
    return listening()


def test_local_workers_accept_only_their_own_certificate(others):
    with started(1) as client:
        address = client.scheduler.address
        assert address.startswith("tls://127.0.0.1:")
        found = listening() - others
        assert {host for host, _ in found} == {"127.0.0.1"}
        workers = list(client.scheduler_info()["workers"])
        for target in (address, *workers):
            for stranger in (plain, without_certificate):
                with socket.create_connection(parse_host_port(target.split("://")[1]), timeout=10) as connection:
                    assert not answers(stranger, connection)
        for security in (None, Security.temporary()):
            with pytest.raises((OSError, TypeError)):
                Client(address if security else address.replace("tls", "tcp"), timeout="3s", security=security)
        assert client.submit(os.getpid).result() != os.getpid()


def pages(ports):
    """Pages about the run that anyone on this computer can read."""
    found = set()
    for port in ports:
        for page in ("status", "health", "metrics", "json/counts.json", "info/main/workers.html"):
            connection = HTTPConnection("127.0.0.1", port, timeout=10)
            try:
                connection.request("GET", f"/{page}")
                if connection.getresponse().status == 200:
                    found.add(page)
            except (OSError, HTTPException):
                pass
            finally:
                connection.close()
    return found


def test_the_dashboard_is_for_this_computer_only(others):
    with started(1) as client:
        port = client.scheduler_info()["services"]["dashboard"]
        assert ("127.0.0.1", port) in listening()
        assert {host for host, _ in listening() - others} == {"127.0.0.1"}
        assert pages([port])


def test_a_scheduler_with_certificates(client, scheduler):
    files = dict(zip(scheduler[2::2], scheduler[3::2]))
    certificates = Certificates(files["--tls-ca"], files["--tls-cert"], files["--tls-key"])
    with running(client.scheduler.address, certificates) as other:
        assert other.submit(os.getpid).result() != os.getpid()


def test_wrong_certificates_are_refused(client, scheduler, tmp_path, monkeypatch):
    files = [tmp_path / name for name in ("ca", "cert", "key")]
    for file in files:
        file.write_text("not a certificate")
    with pytest.raises(ParameterError, match=r"The certificates \(.*ca, .*cert, .*key\) can't be used"):
        next(running(client.scheduler.address, Certificates(*files)).gen)
    security = Security.temporary()
    for file, text in zip(files, (security.tls_ca_file, security.tls_client_cert, security.tls_client_key)):
        file.write_text(text)
    monkeypatch.setattr("rail_extract.core.run.cluster.TIMEOUT_S", 3)
    with pytest.raises(RailExtractError, match="check the address and the certificates"):
        next(running(client.scheduler.address, Certificates(*files)).gen)


def test_a_scheduler_without_workers_is_named(monkeypatch):
    monkeypatch.setattr("rail_extract.core.run.cluster.TIMEOUT_S", 1)
    sentence = r"^The Dask scheduler at tcp://.* has no workers: start some"
    with (
        LocalCluster(n_workers=0, host="127.0.0.1", dashboard_address=None) as cluster,
        pytest.raises(RailExtractError, match=sentence),
    ):
        next(running(cluster.scheduler_address).gen)


def test_nothing_is_left_in_the_temporary_folder(tmp_path, monkeypatch):
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    with started(1) as client:
        client.submit(os.getpid).result()
        assert len(list(tmp_path.iterdir())) == 1
    assert list(tmp_path.iterdir()) == []
