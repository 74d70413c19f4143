"""What other distributions bring: found, used, or left out with a sentence."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

from dearig.acquisition.check import check_rig
from dearig.acquisition.rigs import RIGS, kind_of
from dearig.config.rigfile import RigFile
from dearig.drivers.instruments.registered import INSTRUMENTS
from dearig.errors import InputError

#: A distribution with a rig, a laser and an amplifier, all made of this program's own parts.
ACME = """
from dearig.drivers.keyence.driver import KeyenceDriver
from dearig.drivers.instruments.findings import Finding
from dearig.drivers.instruments.laser import LaserInspection
from dearig.drivers.instruments.trek import TrekDriver
from dearig.sim_backend.kind import SimulatedKind


class AcmeKind:
    addresses = ("acme:1",)
    simulated = False

    def open(self, address, settings, options):
        if address == "acme:none":
            return object()
        return SimulatedKind().open("sim", settings, options)

    def inspect(self, address, settings, options):
        return SimulatedKind().inspect("sim", settings, options)


class AcmeLaser:
    role = "laser"

    def inspect(self, settings):
        return LaserInspection((Finding(settings.model, "head", "here is the Acme laser"),))


RIG, LASER, AMPLIFIER = AcmeKind(), AcmeLaser(), TrekDriver()
"""
POINTS = """
[dearig.rigs]
acme = acme_rigs:RIG
broken = acme_broken:RIG
absent = acme_absent:RIG
shapeless = acme_rigs:ACME
wrong = acme_rigs:LASER
daqmx = acme_rigs:RIG
[dearig.instruments]
acme-laser = acme_rigs:LASER
acme-amplifier = acme_rigs:AMPLIFIER
camera = acme_rigs:RIG
"""
RIG_FILE = """
[film]
name = "film 3"
[laser]
driver = "acme-laser"
averaging = 10
[amplifier]
driver = "acme-amplifier"
"""
SEQUENCE = """
name = "rest"
lead_in_s = 0.1
tail_s = 0.1
[[segment]]
kind = "hold"
voltage_kV = 0.0
duration_s = 0.1
"""


@pytest.fixture(scope="module")
def installed(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder in which the distribution is installed."""
    folder = tmp_path_factory.mktemp("site")
    (folder / "acme_rigs.py").write_text(ACME, encoding="utf-8")
    (folder / "acme_broken.py").write_text("1 / 0\n", encoding="utf-8")
    about = folder / "acme_rigs-1.2.dist-info"
    about.mkdir()
    (about / "METADATA").write_text("Metadata-Version: 2.1\nName: acme-rigs\nVersion: 1.2\n")
    (about / "entry_points.txt").write_text(POINTS)
    return folder


def command(installed: Path, *arguments: str | Path) -> subprocess.CompletedProcess[str]:
    return python(installed, "-m", "dearig", *arguments)


def python(installed: Path, *arguments: str | Path) -> subprocess.CompletedProcess[str]:
    path = os.pathsep.join((str(installed), *sys.path))
    return subprocess.run(
        [sys.executable, "-P", *map(str, arguments)],
        env={**os.environ, "PYTHONPATH": path, "COLUMNS": "200"},
        capture_output=True, text=True, check=False,
    )  # fmt: skip


def test_own_rigs_and_instruments_are_found():
    assert list(RIGS)[:2] == ["sim", "daqmx"]
    assert [RIGS[name].simulated for name in ("sim", "daqmx")] == [True, False]
    assert list(INSTRUMENTS)[:2] == ["keyence", "trek"]


def test_address_of_no_rig_is_told_what_there_is():
    with pytest.raises(InputError, match=r"'dev1' is not known: write sim, .* or daqmx:Dev1@HOST"):
        kind_of("dev1")


def test_what_cannot_be_used_is_left_out_with_a_sentence(installed):
    code = (
        "from dearig.acquisition.rigs import RIGS\n"
        "from dearig.drivers.instruments.registered import INSTRUMENTS\n"
        "print(*RIGS, *INSTRUMENTS)\nprint(*RIGS.left_out, *INSTRUMENTS.left_out, sep='\\n')"
    )
    names, *left_out = python(installed, "-c", code).stdout.splitlines()
    assert names.split()[:3] == ["sim", "daqmx", "acme"]
    assert {"keyence", "trek", "acme-laser", "acme-amplifier"} <= set(names.split())
    found = {re.search("plug-in ([a-z]+) ", sentence)[1]: sentence for sentence in left_out}
    assert set(found) == {"broken", "absent", "shapeless", "wrong", "daqmx", "camera"}
    assert "division by zero" in found["broken"]
    assert "No module named 'acme_absent'" in found["absent"]
    assert "is not a kind of rig: it needs addresses" in found["wrong"]
    assert "already taken" in found["daqmx"]
    assert "is not a driver: it needs a role" in found["camera"]


@pytest.mark.deep
def test_a_rig_that_another_distribution_brings_records(installed, tmp_path):
    (tmp_path / "rig.toml").write_text(RIG_FILE, encoding="utf-8")
    (tmp_path / "rest.toml").write_text(SEQUENCE, encoding="utf-8")
    given = ("--rig", "acme:1", "--rig-file", tmp_path / "rig.toml")
    answer = command(installed, "record", tmp_path / "rest.toml", *given, "--out",
                     tmp_path / "run.h5")  # fmt: skip
    assert answer.returncode == 0, answer.stderr
    assert (tmp_path / "run.h5").exists()
    assert "here is the Acme laser" in command(installed, "check", *given).stdout
    # a simulated rig never opens the port of a real laser
    text = RIG_FILE.replace("averaging = 10", 'averaging = 10\nport = "COM3"')
    (tmp_path / "rig.toml").write_text(text, encoding="utf-8")
    checked = command(installed, "check", "--rig", "sim", *given[2:]).stdout
    assert "here is the Acme laser" not in checked
    assert "not asked: acme-laser is not simulated" in checked


@pytest.mark.deep
def test_what_fails_is_a_sentence_at_the_command_line(installed, tmp_path):
    (tmp_path / "rest.toml").write_text(SEQUENCE, encoding="utf-8")
    (tmp_path / "rig.toml").write_text('[film]\nname = "film 3"\n', encoding="utf-8")
    for address, code, words in (
        ("broken:1", 2, "the plug-in broken (dearig.rigs) of acme-rigs is left out"),
        ("acme:none", 4, "its driver returned a object, which is not a rig"),
    ):
        given = ("--rig", address, "--rig-file", tmp_path / "rig.toml")
        answer = command(
            installed, "record", tmp_path / "rest.toml", *given, "--out", tmp_path / "n.h5"
        )
        assert answer.returncode == code, answer.stderr
        assert words in " ".join(answer.stderr.split())
        assert "Traceback" not in answer.stderr


def test_driver_that_is_not_there_keeps_a_run_from_starting(tmp_path):
    rig_file = RigFile.model_validate(
        {"laser": {"driver": "nowhere"}, "amplifier": {"driver": "keyence"}}
    )
    wrong = {finding.instrument: finding for finding in check_rig("sim", rig_file).wrong}
    assert wrong["Keyence LK-H152 / LK-G5000"].found == "there is no laser driver 'nowhere'"
    assert wrong["TREK 10/40A-HS"].wanted == "trek"


def test_simulated_rig_needs_no_library_of_a_card_or_a_serial_port(installed):
    code = (
        "import sys\n"
        "sys.modules.update(dict.fromkeys(('nidaqmx', 'grpc', 'serial'), None))\n"
        "from dearig.cli.main import main\n"
        "sys.argv[1:] = ['check', '--rig', 'sim']\n"
        "main()"
    )
    answer = python(installed, "-c", code)
    assert answer.returncode == 0, answer.stderr
    assert "simulated, at sim" in answer.stdout
