"""The link to a server: TLS where it is another computer, and no other host is contacted."""

from __future__ import annotations

import re
import shutil
import socket
import subprocess
import sys
from pathlib import Path

import pytest

from dearig.acquisition.check import check_rig
from dearig.config.rigfile import RigFile, load_rig_file
from dearig.config.rigform import parse_rig_file
from dearig.drivers.daqmx.address import Address
from dearig.drivers.daqmx.certificates import read_certificates
from dearig.drivers.daqmx.guardian import GuardianProcess
from dearig.drivers.daqmx.link import Link, is_loopback
from dearig.drivers.errors import AddressError, LinkRefused
from dearig.errors import InputError
from tests.tools.certificates import make_certificates, needs_openssl
from tests.tools.command import write
from tests.tools.daqmx import served

REMOTE = "daqmx:Dev1@rig-server.example:31763"
#: Of the documentation's network (RFC 5737): no one is there.
REMOTE_SERVER = "192.0.2.7:31763"
NAMES = ("card.tls_ca", "card.tls_cert", "card.tls_key")


def rig_of(tmp_path: Path, *keys: str) -> RigFile:
    return load_rig_file(write(tmp_path / "rig.toml", "[card]\n" + "".join(f"{k}\n" for k in keys)))


@pytest.fixture(scope="module")
def certificates(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return make_certificates(tmp_path_factory.mktemp("certificates"))


def tls_rig(certificates: Path, *, ca: str = "ca", client: bool = True) -> RigFile:
    keys = [f'tls_ca = "{ca}.pem"']
    if client:
        keys += ['tls_cert = "client.pem"', 'tls_key = "client.key"']
    return rig_of(certificates, *keys)


def verdict(rig: RigFile, port: int, host: str = "127.0.0.1") -> dict[str, str]:
    return {f.item: f.verdict for f in check_rig(f"daqmx:Dev1@{host}:{port}", rig).findings}


def fault(rig: RigFile, port: int) -> str:
    """What is said of a server that does not let this client in."""
    findings = check_rig(f"daqmx:Dev1@127.0.0.1:{port}", rig).findings
    return next(f.found for f in findings if f.item == "state" and f.verdict == "wrong")


# who needs TLS


@pytest.mark.parametrize(
    ("host", "loopback"),
    [
        ("localhost", True), ("LOCALHOST", True), ("127.0.0.1", True), ("127.9.9.9", True),
        ("[::1]", True), ("::1", True), ("192.0.2.7", False), ("0.0.0.0", False),  # noqa: S104
        ("rig-server", False), ("localhost.example", False), ("127.0.0.1.example", False),
        ("", False), ("[2001:db8::1]", False),
    ],
)  # fmt: skip
def test_only_this_computer_is_the_loopback(host: str, loopback: bool) -> None:
    assert is_loopback(host) is loopback


@pytest.mark.parametrize("address", [REMOTE, f"daqmx:Dev1@{REMOTE_SERVER}"])
def test_another_computers_server_without_tls_is_refused_in_words(address: str) -> None:
    with pytest.raises(InputError, match="is on another computer and no TLS is set") as caught:
        check_rig(address, RigFile())
    assert "tls_ca" in str(caught.value)
    assert "server_without_tls = true" in str(caught.value)


def test_a_server_without_tls_can_be_declared_and_check_says_what_that_means() -> None:
    rig = RigFile.model_validate({"card": {"server_without_tls": True}})
    link = Link(REMOTE_SERVER, rig)
    link.close()
    assert link.security is not None
    assert link.security.verdict == "warning"
    assert "everybody on the network between can read and drive the card" in link.security.found


@pytest.mark.parametrize(
    ("keys", "words"),
    [
        (('tls_cert = "a.pem"',), "card.tls_cert is set, but not card.tls_key"),
        (('tls_ca = "a.pem"', 'tls_key = "k.pem"'), "but not card.tls_cert"),
        (('tls_cert = "a.pem"', 'tls_key = "k.pem"'), "but not card.tls_ca"),
        (('tls_ca = "a.pem"', "server_without_tls = true"), "remove one of the two"),
    ],
)
def test_tls_settings_that_contradict_each_other(
    tmp_path: Path, keys: tuple[str, ...], words: str
) -> None:
    with pytest.raises(InputError) as caught:
        rig_of(tmp_path, *keys)
    assert words in str(caught.value)


def test_the_files_are_relative_to_the_rig_file(tmp_path: Path) -> None:
    rig = rig_of(tmp_path, 'tls_ca = "certs/ca.pem"')
    assert Path(rig.card.tls_ca) == tmp_path.resolve() / "certs" / "ca.pem"
    text = '[card]\ntls_ca = "certs/ca.pem"\n'
    assert Path(parse_rig_file(text, tmp_path).card.tls_ca) == tmp_path / "certs" / "ca.pem"
    assert rig_of(tmp_path, f"tls_ca = '{tmp_path / 'x.pem'}'").card.tls_ca == str(
        tmp_path / "x.pem"
    )


def test_files_that_cannot_be_used_are_named(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"card.tls_ca = .*nowhere.pem cannot be read"):
        check_rig("daqmx:Dev1@127.0.0.1:9", rig_of(tmp_path, 'tls_ca = "nowhere.pem"'))
    write(tmp_path / "empty.pem", "")
    with pytest.raises(InputError, match=r"holds no certificate"):
        check_rig("daqmx:Dev1@127.0.0.1:9", rig_of(tmp_path, 'tls_ca = "empty.pem"'))


@needs_openssl
def test_a_key_of_another_certificate_is_refused(certificates: Path) -> None:
    with pytest.raises(LinkRefused, match="are not a certificate and its private key"):
        read_certificates(
            certificates / "ca.pem", certificates / "client.pem", certificates / "server.key", NAMES
        )


# addresses


@pytest.mark.parametrize(
    "address",
    [
        "daqmx:Dev1@unix:/tmp/socket:80", "daqmx:Dev1@dns:host:80", "daqmx:Dev1@xds:host:80",
        "daqmx:Dev1@ipv4:127.0.0.1,192.0.2.7:80", "daqmx:Dev1@127.0.0.1,192.0.2.7:80",
        "daqmx:Dev1@::1:80", "daqmx:Dev1@host%20x:80", "daqmx:Dev1@[host]:80",
    ],
)  # fmt: skip
def test_an_address_names_one_host(address: str) -> None:
    with pytest.raises(AddressError):
        Address.parse(address)


@pytest.mark.parametrize("server", ["[::1]:80", "127.0.0.1:80", "rig-server.example:80"])
def test_hosts_that_an_address_can_name(server: str) -> None:
    assert Address.parse(f"daqmx:Dev1@{server}").server == server


# connections


@needs_openssl
def test_mutual_tls_lets_in_who_has_a_certificate_and_nobody_else(certificates: Path) -> None:
    files = read_certificates(
        certificates / "ca.pem", certificates / "server.pem", certificates / "server.key", NAMES
    )
    with served(certificates=files) as card:
        port = card.server.port
        good = verdict(tls_rig(certificates), port)
        assert good["connection"] == "ok"
        assert "state" not in good
        assert verdict(tls_rig(certificates), port, "localhost")["connection"] == "ok"
        # without a certificate, without TLS, and with the server's authority unknown
        assert "card.tls_cert and card.tls_key" in fault(tls_rig(certificates, client=False), port)
        assert "a server with TLS, set card.tls_ca" in fault(RigFile(), port)
        assert "is not trusted" in fault(tls_rig(certificates, ca="client"), port)
    with served() as card:
        assert "a server without TLS" in fault(tls_rig(certificates), card.server.port)


@needs_openssl
def test_a_server_with_another_name_is_not_trusted(certificates: Path, tmp_path: Path) -> None:
    other = make_certificates(tmp_path / "other", names="DNS:elsewhere.example")
    files = read_certificates("", other / "server.pem", other / "server.key", NAMES)
    rig = rig_of(other, 'tls_ca = "ca.pem"')
    with served(certificates=files) as card:
        assert "is for another name" in fault(rig, card.server.port)


@needs_openssl
def test_a_client_with_another_authoritys_certificate_is_refused(
    certificates: Path, tmp_path: Path
) -> None:
    other = make_certificates(tmp_path / "other")
    files = read_certificates(
        certificates / "ca.pem", certificates / "server.pem", certificates / "server.key", NAMES
    )
    keys = (f"tls_ca = '{certificates / 'ca.pem'}'", 'tls_cert = "client.pem"',
            'tls_key = "client.key"')  # fmt: skip
    with served(certificates=files) as card:
        assert "card.tls_cert and card.tls_key" in fault(rig_of(other, *keys), card.server.port)


@needs_openssl
def test_the_guardian_uses_the_same_certificates(certificates: Path) -> None:
    files = read_certificates(
        certificates / "ca.pem", certificates / "server.pem", certificates / "server.key", NAMES
    )
    rig = tls_rig(certificates)
    with served(certificates=files) as card:
        guardian = GuardianProcess(Address("Dev1", f"127.0.0.1:{card.server.port}"), rig)
        try:
            guardian.arm()
            guardian.take_over()  # raises unless it has set 0 V
        finally:
            guardian.close()
        assert card.device.history()[-1].wire == 0.0


_TRACED = """
import sys
from dearig.acquisition.check import check_rig
from dearig.config.rigfile import RigFile
outcome = check_rig(sys.argv[1], RigFile())
print(sorted(f.item for f in outcome.wrong))
"""


def test_check_ignores_the_proxies_of_the_environment(monkeypatch: pytest.MonkeyPatch) -> None:
    with socket.socket() as proxy, served() as card:
        proxy.bind(("127.0.0.1", 0))
        proxy.listen()
        proxy.setblocking(False)
        url = f"http://127.0.0.1:{proxy.getsockname()[1]}"
        for name in ("http_proxy", "https_proxy", "grpc_proxy", "all_proxy"):
            monkeypatch.setenv(name, url)
            monkeypatch.setenv(name.upper(), url)
        outcome = check_rig(f"daqmx:Dev1@127.0.0.1:{card.server.port}", RigFile())
        assert "state" not in {finding.item for finding in outcome.wrong}
        with pytest.raises(BlockingIOError):
            proxy.accept()


_CONNECTION = re.compile(r"sa_family=(AF_INET6?), .*?port=htons\((\d+)\).*?\"(.+?)\"")


@pytest.mark.deep
@pytest.mark.skipif(shutil.which("strace") is None, reason="strace is missing")
def test_check_contacts_only_the_host_that_was_named(tmp_path: Path) -> None:
    trace = tmp_path / "trace"
    with served() as card:
        port = card.server.port
        command = [sys.executable, "-c", _TRACED, f"daqmx:Dev1@127.0.0.1:{port}"]
        strace = ["strace", "-f", "-qq", "-e", "trace=connect,sendto,sendmsg", "-o", str(trace)]
        done = subprocess.run([*strace, *command], capture_output=True, text=True, timeout=300.0)
    if "Operation not permitted" in done.stderr:
        pytest.skip("tracing is not permitted here")
    assert done.returncode == 0, done.stderr
    contacted = {(found[3], int(found[2])) for found in _CONNECTION.finditer(trace.read_text())}
    assert contacted
    # gRPC writes an IPv4 address as an IPv6 one
    assert contacted <= {("127.0.0.1", port), ("::ffff:127.0.0.1", port)}
