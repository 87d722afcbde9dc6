"""Whoever reaches a port of a cluster on this computer gets nothing without its keys and name."""

import http.client
import socket
import ssl
from collections.abc import Iterator
from dataclasses import dataclass
from urllib.parse import urlsplit

import psutil
import pytest
from distributed import Client
from host.fleet.tasks.dashboard_guard import is_ours
from host.fleet.tasks.task_cluster import ClusterOptions, _local


@dataclass(frozen=True)
class Local:
    """What a local cluster listens at."""

    scheduler: str
    http_ports: dict[str, int]
    listening: set[tuple[str, int]]


def listening() -> set[tuple[str, int]]:
    """Return every address and port that this process and its children listen at."""
    us = psutil.Process()
    return {
        (at.laddr.ip, at.laddr.port)
        for process in (us, *us.children(recursive=True))
        for at in process.net_connections("inet")
        if at.status == psutil.CONN_LISTEN
    }


@pytest.fixture(scope="module")
def local() -> Iterator[Local]:
    before = listening()  # of other tests in this process
    with _local(ClusterOptions(workers=1), lambda line: None) as client:
        assert client.cluster is not None
        scheduler = client.cluster.scheduler
        ports = {"scheduler": scheduler.http_server.port} | client.run(
            lambda dask_worker: dask_worker.http_server.port
        )
        yield Local(scheduler.address, ports, listening() - before)


def asked(port: int, path: str, headers: list[tuple[str, str]]) -> int:
    """Return the status of a request with exactly these headers."""
    connection = http.client.HTTPConnection("127.0.0.1", port, timeout=30)
    try:
        connection.putrequest("GET", path, skip_host=True)
        for name, value in headers:
            connection.putheader(name, value)
        connection.endheaders()
        return connection.getresponse().status
    finally:
        connection.close()


@pytest.mark.parametrize("path", ["/status", "/health", "/sitemap.json", "/nothing", "/status/ws"])
def test_a_request_by_another_name_or_from_another_site_is_refused(local: Local, path: str) -> None:
    assert len(local.http_ports) == 2
    for port in local.http_ports.values():
        name = f"localhost:{port}"
        for headers in (
            [("Host", f"evil.example:{port}")],
            [("Host", "evil.example")],
            [("Host", name), ("Origin", "http://evil.example")],
            [("Host", name), ("Origin", "null")],
        ):
            assert asked(port, path, headers) == 403, headers


def test_the_dashboard_answers_its_user(local: Local) -> None:
    for port in local.http_ports.values():
        for name in (f"127.0.0.1:{port}", f"localhost:{port}"):
            assert asked(port, "/health", [("Host", name), ("Origin", f"http://{name}")]) == 200
    port = local.http_ports["scheduler"]
    assert asked(port, "/status", [("Host", f"127.0.0.1:{port}")]) == 200


@pytest.mark.parametrize(
    ("host", "ours"),
    [
        ("[::1]:8787", True), ("LOCALHOST:1", True), ("127.0.0.1", True), ("", False),
        ("127.0.0.1.evil.example", False), ("[::1", False), ("localhost@evil.example", False),
    ],
)  # fmt: skip
def test_names_of_this_computer(host: str, ours: bool) -> None:
    assert is_ours(host, None) is ours


def test_nothing_listens_beyond_this_computer(local: Local) -> None:
    assert {port for _, port in local.listening} >= set(local.http_ports.values())
    assert {address for address, _ in local.listening} == {"127.0.0.1"}


def test_who_has_no_key_reaches_no_scheduler(local: Local) -> None:
    assert local.scheduler.startswith("tls://")
    with pytest.raises(OSError, match=r"Timed out|reset|closed"):
        Client(local.scheduler.replace("tls://", "tcp://"), timeout="2s")
    # One who asks the scheduler for no proof, and has none.
    careless = ssl.create_default_context()
    careless.check_hostname, careless.verify_mode = False, ssl.CERT_NONE
    at = urlsplit(local.scheduler)
    with (
        pytest.raises(ssl.SSLError, match="CERTIFICATE_REQUIRED"),
        socket.create_connection((str(at.hostname), int(at.port or 0)), timeout=30) as plain,
        careless.wrap_socket(plain) as line,
    ):
        line.recv(1)
