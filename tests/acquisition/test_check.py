"""``dearig check``: what is there, what is wrong, and how it is told."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

from dearig.acquisition.check import CheckOutcome, check_rig
from dearig.config.rigfile import RigFile
from dearig.drivers.daqmx.inspection import Inspection
from dearig.drivers.instruments.amplifier import Monitors
from dearig.drivers.instruments.findings import Finding
from dearig.drivers.settings import LaserSettings
from dearig.errors import InputError
from dearig.sim_backend.faults import FaultPlan
from dearig.sim_backend.keyence import Behaviour, SimulatedController
from dearig.sim_backend.serial_port import serve_on_socket
from tests.tools.command import dearig, done, strict_json, write

#: 6.4 mm at 4 mm/V.
CARD = Inspection((Finding("card Dev1", "driver", "NI-DAQmx 23.5.0"),), Monitors(2.0, 1e-6), 1.6)


def rig_file(**laser: object) -> RigFile:
    return RigFile.model_validate({"laser": laser, "film": {"name": "A7"}})


def verdicts(outcome: CheckOutcome, *also: str) -> dict[str, str]:
    """Verdict of each item that is not ok, and of those named."""
    return {f.item: f.verdict for f in outcome.findings if f.verdict != "ok" or f.item in also}


def told(outcome: CheckOutcome, item: str) -> str:
    (finding,) = (f for f in outcome.findings if f.item == item)
    return finding.sentence


@pytest.fixture
def card(monkeypatch: pytest.MonkeyPatch) -> list[tuple[str, str | None]]:
    """A card that is well; gives the addresses that were asked for."""
    asked: list[tuple[str, str | None]] = []

    def inspect(device: str, server: str | None, settings: object) -> Inspection:
        assert isinstance(settings, RigFile)
        asked.append((device, server))
        return CARD

    monkeypatch.setattr("dearig.drivers.daqmx.inspection.inspect", inspect)
    return asked


# ---------------------------------------------------------------- simulated


def test_a_simulated_rig_is_well() -> None:
    answer = done("check", "--rig", "sim")
    for words in (
        "voltage monitor at 0 V: 0.000 kV", "analog output: 6.4 mm (1.6 V)", "1000 V/V",
        "voltage: 0 to 8.5 kV", "pyserial 3.5", "2 not wired", "simulated, at sim",
    ):  # fmt: skip
        assert words in answer.out
    assert "wrong" not in answer.out


def test_json_says_the_same(tmp_path: Path) -> None:
    path = tmp_path / "check.json"
    done("check", "--rig", "sim:7", "--json", path)
    found = strict_json(path.read_text("utf-8"))
    assert found["format"] == "dearig-check/1"
    assert found["rig"] == "sim:7"
    assert found["simulated"] is True
    assert found["well"] is True
    keys = {"instrument", "item", "found", "wanted", "verdict", "advice"}
    assert all(set(finding) == keys for finding in found["findings"])
    assert len({(f["instrument"], f["item"]) for f in found["findings"]}) == len(found["findings"])
    assert dearig("check", "--json", path).code == 2  # it is not overwritten


def test_a_simulated_controller_is_asked_where_there_is_a_port() -> None:
    outcome = check_rig("sim", rig_file(port="COM3", averaging=1024, direction=-1, mm_per_V=5.0))
    assert verdicts(outcome, "averaging", "analog scaling") == {
        "averaging": "ok", "analog scaling": "ok", "high-voltage enable": "not wired",
    }  # fmt: skip
    assert "COM3 (simulated)" in told(outcome, "serial port")
    assert "6.4 mm" in told(outcome, "reading of OUT1")
    assert "0.000 mm apart" in told(outcome, "analog output against serial port")


@pytest.mark.parametrize(
    ("fault", "item", "said"),
    [
        ("sensor-out-of-range@0", "analog output", "check that the laser is on"),
        ("serial-garbage@0", "serial port", "not text"),
    ],
)
def test_faults_of_a_simulated_rig_are_found(fault: str, item: str, said: str) -> None:
    outcome = check_rig("sim", rig_file(port="COM3"), FaultPlan.parse([fault]))
    assert item in {f.item for f in outcome.wrong}
    assert said in told(outcome, item)


# ---------------------------------------------------------------- real


def test_a_real_rig_that_is_well(card: list[tuple[str, str | None]]) -> None:
    controller = SimulatedController(LaserSettings(), lambda _: 6.4e-3, mode_change=0.0)
    with serve_on_socket(controller) as port:
        outcome = check_rig("daqmx:Dev1@host:31763", rig_file(port=port))
    assert card == [("Dev1", "host:31763")]
    assert verdicts(outcome) == {}
    assert outcome.summary.endswith(": all OK")
    assert not outcome.simulated
    assert "NI-DAQmx 23.5.0" in told(outcome, "driver")


@pytest.mark.parametrize(
    ("instrument", "behaviour", "wrong"),
    [
        ({"mm_per_V": 5.0}, Behaviour.CONTROLLER,
         ["analog scaling", "analog output against serial port"]),
        ({"averaging": 64}, Behaviour.CONTROLLER, ["averaging"]),
        ({"sampling_us": 50.0}, Behaviour.CONTROLLER, ["sampling"]),
        ({"output": 2}, Behaviour.CONTROLLER, ["settings"]),
        ({}, Behaviour.SILENT, ["serial port"]),
        ({}, Behaviour.OTHER, ["serial port"]),
    ],
)  # fmt: skip
def test_a_rig_file_that_contradicts_the_laser(
    card: list[tuple[str, str | None]],
    instrument: dict[str, object],
    behaviour: Behaviour,
    wrong: list[str],
) -> None:
    there = LaserSettings.model_validate(instrument)
    controller = SimulatedController(there, lambda _: 6.4e-3, behaviour=behaviour, mode_change=0.0)
    with serve_on_socket(controller) as port:
        outcome = check_rig("daqmx:Dev1", rig_file(port=port))
    assert [f.item for f in outcome.wrong] == wrong
    assert all(f.advice for f in outcome.wrong)


def test_another_output_wired_to_the_card_is_noticed(card: list[tuple[str, str | None]]) -> None:
    controller = SimulatedController(LaserSettings(), lambda _: 9e-3, mode_change=0.0)
    with serve_on_socket(controller) as port:
        outcome = check_rig("daqmx:Dev1", rig_file(port=port))
    assert [f.item for f in outcome.wrong] == ["analog output against serial port"]
    assert "2.600 mm apart" in outcome.wrong[0].found


def test_a_command_that_finds_something_wrong(
    card: list[tuple[str, str | None]], tmp_path: Path
) -> None:
    path = write(tmp_path / "rig.toml", '[laser]\nport = "/dev/ttyNOWHERE"\n[film]\nname = "A7"\n')
    answer = dearig("check", "--rig", "daqmx:Dev1", "--rig-file", path, "--json", "-")
    assert answer.code == 4
    last = answer.err.splitlines()[-1]
    assert "serial port: there is no serial port /dev/ttyNOWHERE; set laser.port" in last
    assert answer.json["well"] is False
    assert answer.json["simulated"] is False


def test_a_voltage_that_stands_is_wrong(monkeypatch: pytest.MonkeyPatch) -> None:
    high = Inspection((), Monitors(5e3, 0.0), 1.6)
    monkeypatch.setattr("dearig.drivers.daqmx.inspection.inspect", lambda *_: high)
    outcome = check_rig("daqmx:Dev1", rig_file())
    assert "5.000 kV" in told(outcome, "voltage monitor at 0 V")
    assert "keep away from the film" in outcome.wrong[0].advice


def test_what_could_not_be_read_is_not_called_well(monkeypatch: pytest.MonkeyPatch) -> None:
    lost = Inspection((Finding("card Dev1", "driver", "not there", verdict="wrong"),))
    monkeypatch.setattr("dearig.drivers.daqmx.inspection.inspect", lambda *_: lost)
    outcome = check_rig("daqmx:Dev1", rig_file())
    assert [f.found for f in outcome.wrong] == ["not there"]
    assert verdicts(outcome)["monitors at 0 V"] == "warning"
    assert verdicts(outcome)["analog output"] == "warning"


def test_a_film_without_a_name_is_for_simulations_only(
    card: list[tuple[str, str | None]],
) -> None:
    assert "none is named" in told(check_rig("daqmx:Dev1", RigFile()), "film")
    assert "any" in told(check_rig("sim", RigFile()), "film")


def test_without_nidaqmx_it_is_said_where_to_get_it(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "nidaqmx", None)
    answer = dearig("check", "--rig", "daqmx:Dev1")
    assert answer.code == 4
    assert "nidaqmx is not installed" in answer.err
    assert 'pip install "dearig[rig]"' in answer.err


@pytest.mark.parametrize("address", ["dev1", "sim:x", "daqmx:", "daqmx:Dev1@host", ""])
def test_an_address_that_names_no_rig(address: str) -> None:
    with pytest.raises(InputError, match="write "):
        check_rig(address, RigFile())
    assert dearig("check", "--rig", address).code == 2


def test_faults_that_a_rig_cannot_have_are_bad_input() -> None:
    with pytest.raises(InputError, match="server-gone"):
        check_rig("sim", RigFile(), FaultPlan.parse(["server-gone@0"]))
