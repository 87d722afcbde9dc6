"""One cluster for all tests of fleets, of its own processes and over TLS, and a store like S3."""

import datetime
import ipaddress
import json
import os
import subprocess
import sys
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import pytest

from tests.host.logs import ROOT

BUCKET = "club"


@dataclass(frozen=True)
class Cluster:
    """A scheduler and its workers, each a process that the tests started."""

    address: str
    scheduler: "subprocess.Popen[bytes]"
    workers: "subprocess.Popen[bytes]"

    def close(self) -> None:
        for process in (self.workers, self.scheduler):
            process.terminate()
        for process in (self.workers, self.scheduler):
            try:
                process.wait(timeout=30)
            except subprocess.TimeoutExpired:
                process.kill()
                process.wait()


def started(
    folder: Path, workers: int, *words: str, protocol: str = "tcp", nanny: bool = True
) -> Cluster:
    """Start a scheduler and workers with their own programs, as a user would."""
    told, scheduler = folder / "scheduler.json", "distributed.cli.dask_scheduler"
    every = [*words, "--host", "127.0.0.1", "--protocol", protocol, "--no-dashboard"]
    first = _program(scheduler, *every, "--port", "0", "--scheduler-file", str(told))
    for _ in range(1200):
        if first.poll() is not None or (told.is_file() and told.stat().st_size):
            break
        time.sleep(0.1)
    address = json.loads(told.read_text())["address"]
    more = ["--nworkers", str(workers), "--nthreads", "1", "--memory-limit", "0"]
    more += [] if nanny else ["--no-nanny"]
    return Cluster(address, first, _program("distributed.cli.dask_worker", address, *every, *more))


def _program(module: str, *words: str) -> "subprocess.Popen[bytes]":
    return subprocess.Popen(
        [sys.executable, "-m", module, *words],
        cwd=ROOT,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    )


@pytest.fixture(scope="package")
def cluster(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Cluster]:
    """Two workers that only who has the certificate can reach.

    They end with this folder: five processes that wait take 6 % of a core.
    """
    from dask import config
    from distributed import Client

    folder = tmp_path_factory.mktemp("cluster")
    certificate, key = certified(folder)
    words = ["--tls-ca-file", certificate, "--tls-cert", certificate, "--tls-key", key]
    ours = {"ca-file": certificate, "client.cert": certificate, "client.key": key}
    with config.set({f"distributed.comm.tls.{name}": path for name, path in ours.items()}):
        found = started(folder, 2, *words, protocol="tls")
        try:
            with Client(found.address, timeout="120s") as client:
                client.wait_for_workers(2, timeout=120)
            yield found
        finally:
            found.close()


def certified(folder: Path) -> tuple[str, str]:
    """Write a certificate that vouches for itself, and its key; return their paths."""
    from cryptography import x509
    from cryptography.hazmat.primitives import hashes, serialization
    from cryptography.hazmat.primitives.asymmetric import ec

    key = ec.generate_private_key(ec.SECP256R1())
    name = x509.Name([x509.NameAttribute(x509.NameOID.COMMON_NAME, "fleet")])
    now = datetime.datetime.now(datetime.UTC)
    here = x509.SubjectAlternativeName([x509.IPAddress(ipaddress.IPv4Address("127.0.0.1"))])
    certificate = (
        x509.CertificateBuilder()
        .subject_name(name)
        .issuer_name(name)
        .public_key(key.public_key())
        .serial_number(1)
        .not_valid_before(now - datetime.timedelta(days=1))
        .not_valid_after(now + datetime.timedelta(days=1))
        .add_extension(here, critical=False)
        .add_extension(x509.BasicConstraints(ca=True, path_length=None), critical=True)
        .sign(key, hashes.SHA256())
    )
    paths = folder / "fleet.crt", folder / "fleet.key"
    paths[0].write_bytes(certificate.public_bytes(serialization.Encoding.PEM))
    paths[1].write_bytes(
        key.private_bytes(
            serialization.Encoding.PEM,
            serialization.PrivateFormat.PKCS8,
            serialization.NoEncryption(),
        )
    )
    return str(paths[0]), str(paths[1])


@pytest.fixture(scope="session")
def store() -> Iterator[str]:
    """The address of a bucket in a store that speaks as S3 does (moto), on this computer."""
    from host.fleet.sources.object_store import arrow_s3
    from moto.server import ThreadedMotoServer

    server = ThreadedMotoServer(ip_address="127.0.0.1", port=0, verbose=False)
    server.start()
    host, port = server.get_host_and_port()
    said = {
        "AWS_ENDPOINT_URL": f"http://{host}:{port}",
        "AWS_ACCESS_KEY_ID": "fleet",
        "AWS_SECRET_ACCESS_KEY": "fleet",
        "AWS_REGION": "us-east-1",
        "AWS_EC2_METADATA_DISABLED": "true",
    }
    before = {name: os.environ.get(name) for name in said}
    os.environ.update(said)
    try:
        arrow_s3(allow_bucket_creation=True).create_dir(BUCKET)
        yield f"s3://{BUCKET}"
    finally:
        for name, value in before.items():
            if value is None:
                del os.environ[name]
            else:
                os.environ[name] = value
        server.stop()
