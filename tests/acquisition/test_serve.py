"""What ``serve-daqmx`` may listen on, and with which certificates."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.tools.certificates import make_certificates, needs_openssl
from tests.tools.command import dearig, refused, write

EVERYWHERE = ("--host", "0.0.0.0", "--anywhere")  # noqa: S104


@pytest.fixture(scope="module")
def certificates(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return make_certificates(tmp_path_factory.mktemp("certificates"))


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (("--host", "0.0.0.0"), "--anywhere"),  # noqa: S104
        (EVERYWHERE, "needs a certificate, its key and the CA of the clients"),
        (("--host", "rig-server.example", "--anywhere"), "needs a certificate"),
        (("--tls-cert", "a.pem"), "belong together"),
        (("--tls-key", "a.key"), "belong together"),
        (("--tls-client-ca", "a.pem"), "needs the server's own certificate and key"),
        (("--tls-cert", "a.pem", "--tls-key", "a.key"), "certificate = a.pem cannot be read"),
    ],
)
def test_what_others_can_reach_needs_certificates_of_both_sides(
    options: tuple[str, ...], words: str
) -> None:
    refused(dearig("serve-daqmx", *options), words)


@needs_openssl
def test_a_server_that_asks_nobody_for_a_certificate_stays_on_the_loopback(
    certificates: Path,
) -> None:
    own = ("--tls-cert", certificates / "server.pem", "--tls-key", certificates / "server.key")
    refused(dearig("serve-daqmx", *EVERYWHERE, *own), "--tls-client-ca", "only clients with a")


@needs_openssl
def test_files_that_are_no_certificates_are_named(certificates: Path, tmp_path: Path) -> None:
    ca = write(tmp_path / "ca.pem", "no certificate")
    own = ("--tls-cert", certificates / "server.pem", "--tls-key", certificates / "server.key")
    refused(dearig("serve-daqmx", *own, "--tls-client-ca", ca), "--tls-client-ca", "ca.pem")
    mixed = ("--tls-cert", certificates / "server.pem", "--tls-key", certificates / "client.key")
    refused(dearig("serve-daqmx", *mixed), "not a certificate and its private key")
