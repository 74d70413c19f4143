"""The thermo-hygrometer's driver on a simulated line, in order and out of order."""

from __future__ import annotations

import math

import pytest

from dearig.drivers.instruments.registered import INSTRUMENTS
from dearig.drivers.instruments.serial_line import POLL
from dearig.drivers.instruments.thermohygrometer import (
    ThermohygrometerDriver,
    ThermohygrometerError,
)
from dearig.drivers.instruments.vaisala import TIMEOUT, VaisalaDriver, VaisalaProbe
from dearig.drivers.settings import ThermohygrometerSettings
from dearig.sim_backend.serial_line import SimulatedLine
from dearig.sim_backend.serial_port import serve_on_socket
from dearig.sim_backend.vaisala import SimulatedProbe

SETTINGS = ThermohygrometerSettings(port="COM4")


class Script:
    """A port that answers every SEND with the next of ``answers``; time passes while it waits."""

    def __init__(self, *answers: bytes) -> None:
        self.answers = list(answers)
        self.sent: list[bytes] = []
        self.held = b""
        self.now = 0.0
        self.closed = False

    @property
    def in_waiting(self) -> int:
        return len(self.held)

    def read(self, size: int = 1, /) -> bytes:
        if not self.held:
            self.now += POLL
        data, self.held = self.held[:size], self.held[size:]
        return data

    def write(self, data: bytes, /) -> object:
        self.sent.append(data)
        if data.startswith(b"SEND") and self.answers:
            self.held += self.answers.pop(0)
        return len(data)

    def close(self) -> None:
        self.closed = True


def probe(*answers: bytes, settings: ThermohygrometerSettings = SETTINGS) -> VaisalaProbe:
    port = Script(*answers)
    return VaisalaProbe(port, settings, lambda: port.now)


@pytest.mark.parametrize(
    ("line", "celsius", "percent"),
    [
        (b"T= 22.6 'C RH= 22.8 %RH Td= 0.3 'C \r\n", 22.6, 22.8),  # HMP60, HMP110
        (b"RH= 43.0 %RH T= 21.0 'C Tdp= 8.0 'C x= 6.7 g/kg Tw= 13.7 'C\r\n", 21.0, 43.0),  # HMP230
        (b"RH 43.0 %RH T 21.0 'C Tdp 8.0 'C\r\n", 21.0, 43.0),  # HMM213
        (b"RH= 54.4 %RH Ta= -6.8 'C\r\n", -6.8, 54.4),
        (b"RH= 39.3%RH T= 77.0 'F\r\n", 25.0, 39.3),
        (b"T= 22.6 'C\r\n", 22.6, math.nan),  # HMP110T has no humidity
        (b"T=***.* 'C RH=***.* %RH Td=***.* 'C\r\n", math.nan, math.nan),
        (b">send\r\nT= 22.6 'C RH= 22.8 %RH\r\n", 22.6, 22.8),  # with its echo
        (b"T= 22.6 'C RH= 22.8 %RH Td= 0.3 'C\r", 22.6, 22.8),
    ],
)
def test_the_lines_of_several_probes_are_read(line: bytes, celsius: float, percent: float) -> None:
    reading = probe(line).read()
    assert reading.temperature == pytest.approx(celsius, nan_ok=True)
    assert reading.humidity == pytest.approx(percent, nan_ok=True)


@pytest.mark.parametrize(
    "garbage",
    [b"", b"\xfe\x00\x81\r\n", b"T= 2", b"T= 922.6 'C RH= 22.8 %RH\r\n", b"RH= 228 %RH\r\n"],
)
def test_a_garbled_line_is_asked_for_again_and_never_taken(garbage: bytes) -> None:
    assert probe(garbage, b"T= 22.6 'C RH= 22.8 %RH\r\n").read().temperature == 22.6
    with pytest.raises(ThermohygrometerError):
        probe(garbage, garbage).read()


def test_a_silent_probe_is_an_error_in_bounded_time() -> None:
    port = Script()
    with pytest.raises(ThermohygrometerError, match=r"no reading from COM4 at 19200 Bd within 1 s"):
        VaisalaProbe(port, SETTINGS, lambda: port.now).read()
    assert port.now <= 2.0 * TIMEOUT + 4.0 * POLL


def test_a_wrong_baud_rate_is_named_with_what_came() -> None:
    with pytest.raises(ThermohygrometerError, match=r"is '\\xfe\\x81', which is not a reading"):
        probe(b"\xfe\x81\r\n", b"\xfe\x81\r\n").read()


def test_a_lost_port_is_an_error_with_advice() -> None:
    class Gone(Script):
        def write(self, data: bytes, /) -> object:  # noqa: ARG002
            raise OSError("device disconnected")

    with pytest.raises(ThermohygrometerError, match="COM4 fails: device disconnected; check the"):
        VaisalaProbe(Gone(), SETTINGS).read()


def test_a_probe_that_sends_unasked_is_stopped_first() -> None:
    simulated = SimulatedProbe(SETTINGS, lambda: (21.0, 40.0), running=True)
    line = SimulatedLine(simulated, 19200)
    reading = VaisalaDriver(lambda _: line, line.now).open(SETTINGS).read()
    assert (reading.temperature, reading.humidity) == (21.0, 40.0)


def test_a_probe_on_a_shared_line_is_asked_by_its_address() -> None:
    settings = SETTINGS.model_copy(update={"address": 3})
    simulated = SimulatedProbe(settings, lambda: (21.0, 40.0))
    line = SimulatedLine(simulated, 19200)
    driver = VaisalaDriver(lambda _: line, line.now)
    assert driver.open(settings).read().humidity == 40.0
    with pytest.raises(ThermohygrometerError, match="no reading"):
        driver.open(settings.model_copy(update={"address": 4})).read()


def test_an_inspection_says_what_is_read_and_what_is_out_of_limits() -> None:
    line = SimulatedLine(SimulatedProbe(SETTINGS, lambda: (21.0, 40.0)), 19200)
    driver = VaisalaDriver(lambda _: line, line.now)
    assert [f.verdict for f in driver.inspect(SETTINGS)] == ["ok", "ok"]
    strict = SETTINGS.model_copy(update={"humidity_max_percent": 35.0})
    answers, reading = driver.inspect(strict)
    assert "COM4 at 19200 Bd" in answers.found
    assert reading.verdict == "wrong"
    assert "21.0 °C, 40.0 %, expected relative humidity 35 % or less" in reading.sentence


@pytest.mark.parametrize(("on_loss", "verdict"), [("go on", "warning"), ("ramp", "wrong")])
def test_a_missing_sensor_prevents_a_run_only_if_its_loss_ends_one(
    on_loss: str, verdict: str
) -> None:
    settings = SETTINGS.model_copy(update={"on_loss": on_loss, "port": ""})
    (finding,) = VaisalaDriver().inspect(settings)
    assert finding.verdict == verdict
    assert "set thermohygrometer.port" in finding.sentence


def test_the_driver_speaks_through_a_real_port() -> None:
    with serve_on_socket(SimulatedProbe(SETTINGS, lambda: (21.0, 40.0))) as port:
        sensor = VaisalaDriver().open(SETTINGS.model_copy(update={"port": port}))
        try:
            assert sensor.read().humidity == 40.0
        finally:
            sensor.close()


def test_it_is_registered() -> None:
    assert isinstance(INSTRUMENTS["vaisala"], ThermohygrometerDriver)
