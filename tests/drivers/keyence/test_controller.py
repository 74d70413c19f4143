"""The laser controller's driver against a simulated one, and whatever a port may deliver."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager

import pytest
import serial
from hypothesis import given
from hypothesis import strategies as st

from dearig.drivers.contract.laser import LaserContract
from dearig.drivers.errors import RigError
from dearig.drivers.instruments.serial_line import POLL
from dearig.drivers.keyence import (
    Keyence,
    KeyenceDriver,
    LaserError,
    NoReading,
    compare,
    inspect,
    open_port,
)
from dearig.drivers.keyence.commands import AVERAGING, COMMANDS, ERRORS, SAMPLING_US
from dearig.drivers.settings import LaserSettings
from dearig.sim_backend.faults import FaultPlan
from dearig.sim_backend.keyence import Behaviour, SimulatedController
from dearig.sim_backend.serial_line import SimulatedLine
from dearig.sim_backend.serial_port import serve_on_pty, serve_on_socket

SETTINGS = LaserSettings(port="COM3")


def set_to(**changes: object) -> LaserSettings:
    return LaserSettings.model_validate({**SETTINGS.model_dump(), **changes})


def at(metres: float | None) -> Callable[[float], float | None]:
    """A film that stands still."""
    return lambda _: metres


def connected(
    settings: LaserSettings = SETTINGS,
    reading: Callable[[float], float | None] = at(6.4e-3),  # noqa: B008
    **options: object,
) -> tuple[Keyence, SimulatedController, SimulatedLine]:
    controller = SimulatedController(settings, reading, **options)  # type: ignore[arg-type]
    line = SimulatedLine(controller)
    return Keyence(line, SETTINGS, line.now), controller, line


class Scripted:
    """A port that gives the next of ``chunks`` for every read, whatever was written."""

    def __init__(self, chunks: list[bytes]) -> None:
        self.chunks = list(chunks)
        self.time = 0.0
        self.reads = 0
        self.written: list[bytes] = []

    def now(self) -> float:
        return self.time

    @property
    def in_waiting(self) -> int:
        return len(self.chunks[0]) if self.chunks else 0

    def read(self, size: int = 1, /) -> bytes:
        self.reads += 1
        self.time += POLL
        return self.chunks.pop(0)[:size] if self.chunks else b""

    def write(self, data: bytes, /) -> int:
        self.written.append(data)
        return len(data)

    def close(self) -> None:
        pass


class Replying(Scripted):
    """A port that answers each command with the next of ``replies``."""

    def __init__(self, *replies: bytes) -> None:
        super().__init__([])
        self.replies = list(replies)

    def write(self, data: bytes, /) -> int:
        if self.replies:
            self.chunks.append(self.replies.pop(0))
        return super().write(data)


# ---------------------------------------------------------------- reading


@pytest.mark.parametrize("metres", [0.0, 6.4e-3, -39.999e-3, 1e-6])
def test_a_value_is_read_in_metres(metres: float) -> None:
    laser, controller, _ = connected(reading=at(metres))
    assert laser.read() == pytest.approx(metres, abs=1e-12)
    assert not controller.setting_mode


@pytest.mark.parametrize(
    ("seen", "state"),
    [(0.041, NoReading.OVER_RANGE), (-0.041, NoReading.UNDER_RANGE), (None, NoReading.INVALID)],
)
def test_what_is_no_number_has_a_name(seen: float | None, state: NoReading) -> None:
    laser, _, _ = connected(reading=at(seen))
    assert laser.read() is state


def test_a_value_follows_the_film() -> None:
    laser, _, line = connected(reading=lambda now: 1e-3 * round(now))
    first = laser.read()
    assert first == pytest.approx(1e-3 * round(line.now()), abs=1e-9)
    while line.now() < 5.0:
        line.read()
    assert laser.read() == pytest.approx(5e-3, abs=1e-9)


def test_the_unit_is_asked_for_once() -> None:
    port = Replying(
        b"Q0\r", b"SR,OI,01,0\r", b"SR,OG,01,5\r", b"R0\r",
        b"MS,01,+123.456\r", b"MS,01,--------\r",
    )  # fmt: skip
    laser = Keyence(port, SETTINGS, port.now)
    assert laser.read() == pytest.approx(123.456e-6, rel=1e-12)
    assert laser.read() is NoReading.WAITING
    assert port.written == [
        b"Q0\r", b"SR,OI,01\r", b"SR,OG,01\r", b"R0\r", b"MS,01\r", b"MS,01\r",
    ]  # fmt: skip


# ---------------------------------------------------------------- settings


def test_settings_are_read_and_the_controller_measures_again() -> None:
    laser, controller, _ = connected()
    found = laser.controller_settings()
    assert found.sampling == pytest.approx(20e-6)
    assert found.averaging == 16
    assert found.filter == "moving average"
    assert found.metres_per_volt == pytest.approx(4e-3, rel=1e-9)
    assert found.metres_at_0_volts == pytest.approx(0.0, abs=1e-12)
    assert found.measurement_gain == 1.0
    assert not controller.setting_mode
    assert compare(SETTINGS, found) == []


def test_every_sampling_and_average_is_read_back() -> None:
    for us in SAMPLING_US:
        found = connected(set_to(sampling_us=us))[0].controller_settings()
        assert found.sampling == pytest.approx(us * 1e-6, rel=1e-12)
    for averaging in AVERAGING:
        assert (
            connected(set_to(averaging=averaging))[0].controller_settings().averaging == averaging
        )


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"mm_per_V": 5.0}, "analog scaling: 5 mm/V, expected 4 mm/V"),
        ({"mm_per_V": 4.002}, "analog scaling: 4.002 mm/V, expected 4 mm/V"),
        ({"averaging": 64}, "averaging: 64 samples, expected 16 samples"),
        ({"sampling_us": 200.0}, "sampling: 200 us, expected 20 us"),
    ],
)
def test_each_mismatch_is_one_sentence(change: dict[str, object], said: str) -> None:
    found = connected(set_to(**change))[0].controller_settings()
    (sentence,) = compare(SETTINGS, found)
    assert said in sentence


def test_direction_is_the_rig_files_business() -> None:
    found = connected(set_to(direction=-1))[0].controller_settings()
    assert found.metres_per_volt == pytest.approx(-4e-3)
    assert compare(SETTINGS, found) == []


def test_without_a_port_nothing_is_compared() -> None:
    found = connected(set_to(mm_per_V=5.0))[0].controller_settings()
    assert compare(set_to(port=""), found) == []
    (finding,) = inspect(set_to(port="")).findings
    assert finding.verdict == "not wired"


def test_every_contradiction_to_the_rig_file_is_a_finding_and_the_port_is_given_back() -> None:
    line = SimulatedLine(SimulatedController(set_to(mm_per_V=5.0, averaging=4), at(0.0)))
    found = inspect(SETTINGS, lambda _: line, line.now).findings
    wrong = {f.item: f.found for f in found if f.verdict == "wrong"}
    assert set(wrong) == {"averaging", "analog scaling"}
    assert line.closed


class TestKeyence(LaserContract):
    @contextmanager
    def connected(
        self, *, reading: float | None = LaserContract.PLACE, answers: bool = True,
        agrees: bool = True,
    ) -> Iterator[tuple[KeyenceDriver, LaserSettings]]:  # fmt: skip
        there = SETTINGS if agrees else set_to(mm_per_V=5.0)
        behaviour = Behaviour.CONTROLLER if answers else Behaviour.SILENT
        controller = SimulatedController(there, at(reading), behaviour=behaviour)
        # the line's time goes on from one port to the next
        line = SimulatedLine(controller)
        yield KeyenceDriver(lambda _: line, line.now), SETTINGS


class Set(Scripted):
    """A controller whose settings are ``changed``; it repeats nothing that was not asked."""

    def __init__(self, **changed: bytes) -> None:
        super().__init__([])
        self.answers = {
            b"PR": b"PR,3", b"Q0": b"Q0", b"SR,CA": b"SR,CA,3",
            b"SR,OC,01": b"SR,OC,01,0,2", b"SR,OD,01": b"SR,OD,01,0", b"SR,OI,01": b"SR,OI,01,0",
            b"SR,OB,01": b"SR,OB,01" + 2 * b",+000.000" + 2 * b",+100.000",
            b"SR,OH,01": b"SR,OH,01,-040.000,-10.0000,+040.000,+10.0000",
            b"SR,OG,01": b"SR,OG,01,1", b"R0": b"R0",
        }  # fmt: skip
        for letters, answer in changed.items():
            (asked,) = (a for a in self.answers if letters.encode() in a)
            self.answers[asked] = answer

    def write(self, data: bytes, /) -> int:
        self.chunks.append(self.answers[data.rstrip(b"\r")] + b"\r")
        return super().write(data)


def found_in(**changed: bytes) -> list[str]:
    port = Set(**changed)
    try:
        return compare(SETTINGS, Keyence(port, SETTINGS, port.now).controller_settings())
    finally:
        assert port.written[-1] == b"R0\r"


def test_replies_may_leave_the_output_out() -> None:
    assert found_in(OC=b"SR,OC,0,2", OD=b"SR,OD,0", CA=b"sr,ca,3\n") == []


def test_points_without_a_decimal_point_count_smallest_steps() -> None:
    assert found_in(OH=b"SR,OH,01,-0040000,-0010000,+0040000,+0010000") == []


@pytest.mark.parametrize(
    ("changed", "said"),
    [
        ({"OC": b"SR,OC,01,1,2"}, "filter: low-pass filter, expected moving average"),
        ({"OD": b"SR,OD,01,1"}, "calculation: peak hold, expected normal"),
        (
            {"OH": b"SR,OH,01,-040.000,+00.0000,+040.000,+10.0000"},
            "analog scaling: 8 mm/V, expected 4 mm/V",
        ),
        (
            {"OH": b"SR,OH,01,-038.000,-10.0000,+042.000,+10.0000"},
            "analog output at 0 V: reads 2 mm, expected 0 mm",
        ),
    ],
)
def test_what_else_falsifies_is_named(changed: dict[str, bytes], said: str) -> None:
    assert any(said in sentence for sentence in found_in(**changed))


@pytest.mark.parametrize(
    ("changed", "said"),
    [
        ({"OI": b"SR,OI,01,1"}, "puts out speed"),
        ({"CA": b"SR,CA,9"}, "sampling cycle has the number 9"),
        ({"OH": b"SR,OH,01,-040.000,-100.000,+040.000,+100.000"}, "no analog output has"),
        ({"OH": b"SR,OH,01,-040.000,+10.0000,+040.000,+10.0000"}, "two points .* are the same"),
    ],
)
def test_settings_that_cannot_be_are_refused(changed: dict[str, bytes], said: str) -> None:
    with pytest.raises(LaserError, match=said):
        found_in(**changed)


def test_a_reply_that_lost_its_end_is_no_setting() -> None:
    # the OUT would be taken for the kind of filter, and 0 for the number of samples
    with pytest.raises(LaserError, match="reply to SR,OC,01"):
        found_in(OC=b"SR,OC,01,0")
    with pytest.raises(LaserError, match="reply to SR,OH,01"):
        found_in(OH=b"SR,OH,01,-040.000,-10.0000,+040.000")


# ---------------------------------------------------------------- modes


def test_a_setting_mode_that_was_left_behind_is_ended() -> None:
    laser, controller, _ = connected()
    controller.setting_mode = True
    assert laser.program() == 0
    assert not controller.setting_mode


def test_the_controller_goes_back_even_when_a_setting_fails() -> None:
    port = Replying(b"Q0\r", b"ER,SR,62\r", b"R0\r")
    with pytest.raises(LaserError, match="refuses SR,OI,01 with code 62") as error:
        Keyence(port, SETTINGS, port.now).read()
    assert error.value.code == 62
    assert port.written[-1] == b"R0\r"


def test_a_controller_that_stays_in_its_setting_mode_is_told() -> None:
    port = Replying(b"Q0\r", b"SR,OI,01,0\r", b"SR,OG,01,1\r", b"ER,R0,99\r")
    with pytest.raises(LaserError, match=r"may still be in its setting mode.*switch it off and on"):
        Keyence(port, SETTINGS, port.now).read()


def test_silence_after_a_change_of_mode_is_waited_for_once() -> None:
    port = Scripted([])
    with pytest.raises(LaserError, match="still be in its setting mode"):
        Keyence(port, SETTINGS, port.now).read()
    assert port.written == [b"Q0\r", b"R0\r"]


# ---------------------------------------------------------------- faults


@pytest.mark.parametrize("code", sorted(ERRORS))
def test_error_replies_are_sentences(code: int) -> None:
    port = Replying(f"ER,MS,{code:02d}\r".encode())
    with pytest.raises(LaserError, match=f"MS,01 with code {code:02d}: {ERRORS[code][0]}"):
        Keyence(port, SETTINGS, port.now)._ask("measured value")


def test_an_unknown_code_is_named() -> None:
    port = Replying(b"ER,PR,77\r")
    with pytest.raises(LaserError, match="code 77: an unknown error"):
        Keyence(port, SETTINGS, port.now).program()


def test_a_late_reply_is_not_taken_for_the_next_one() -> None:
    port = Replying(b"PR,7\rMS,01,+1\r", b"PR,8\r")
    laser = Keyence(port, SETTINGS, port.now)
    assert laser.program() == 7
    assert laser.program() == 8
    assert port.written == [b"PR\r", b"PR\r"]


def test_garbage_is_got_over() -> None:
    laser, _, _ = connected(faults=FaultPlan.parse(["serial-garbage@0+0.4"]), seed=3)
    assert laser.program() == 0


def test_garbage_that_stays_is_told() -> None:
    laser, _, _ = connected(faults=FaultPlan.parse(["serial-garbage@0"]), seed=3)
    with pytest.raises(LaserError, match=r"not text: .*\\x.*laser.baud_rate"):
        laser.program()


@pytest.mark.parametrize(
    ("behaviour", "said"),
    [
        (Behaviour.SILENT, "nothing answers PR on COM3 at 115200 Bd"),
        (Behaviour.OTHER, r"is '\?SYNTAX.*another instrument"),
        (Behaviour.BABBLING, "not text"),
    ],
)
def test_who_else_may_sit_there_is_told(behaviour: Behaviour, said: str) -> None:
    laser, _, line = connected(behaviour=behaviour)
    with pytest.raises(LaserError, match=said):
        laser.program()
    assert line.now() < 10.0


def test_a_port_that_fails_is_told() -> None:
    class Unplugged(Scripted):
        def read(self, size: int = 1, /) -> bytes:  # noqa: ARG002
            raise serial.SerialException("device disconnected")

    port = Unplugged([])
    with pytest.raises(LaserError, match="COM3 fails: device disconnected; check the cable"):
        Keyence(port, SETTINGS, port.now).program()


#: Bytes as a line delivers them: noise, and pieces of what could be meant.
PIECES = st.one_of(
    st.binary(max_size=30),
    st.sampled_from(
        (
            b"MS,01,", b"+012.345", b"-FFFFFFF", b"XXXXXXXX", b"\r", b",", b"ER,MS,", b"51",
            b"Q0\r", b"R0\r", b"SR,OI,01,0\r", b"SR,OG,01,1\r", b"SR,OG,01,9\r",
            b"MS,01,+012.345\r",
        )
    ),
)  # fmt: skip


@given(st.lists(PIECES, max_size=60), st.sampled_from(["read", "settings", "program"]))
def test_any_bytes_give_a_number_a_state_or_an_error(chunks: list[bytes], call: str) -> None:
    port = Scripted([c for c in chunks if c])
    laser = Keyence(port, SETTINGS, port.now)
    calls: dict[str, Callable[[], object]] = {
        "read": laser.read,
        "settings": laser.controller_settings,
        "program": laser.program,
    }
    try:
        answer = calls[call]()
    except RigError as error:
        assert str(error).isprintable()  # noqa: PT017  (any call may end either way)
    else:
        assert call != "read" or isinstance(answer, (float, NoReading))
    assert port.reads < 3000
    assert port.time < 60.0


@given(st.integers(min_value=0), st.sampled_from(list(Behaviour)))
def test_no_line_hangs_the_driver(seed: int, behaviour: Behaviour) -> None:
    laser, _, line = connected(
        behaviour=behaviour, seed=seed, faults=FaultPlan.parse(["serial-garbage@0.1+0.8"])
    )
    try:
        assert laser.read() == pytest.approx(6.4e-3)
    except LaserError as error:
        assert error.advice  # noqa: PT017
    assert line.now() < 60.0


@given(st.binary(max_size=400), st.integers(0, 5))
def test_the_simulation_takes_any_bytes(data: bytes, setting: int) -> None:
    controller = SimulatedController(SETTINGS, at(0.0))
    controller.setting_mode = bool(setting % 2)
    controller.receive(data, 0.0)
    replies = controller.due(1.0).split(b"\r")
    assert replies[-1] == b""
    assert len(replies) - 1 == data.count(b"\r")
    assert controller.next_due() is None


def test_the_simulation_answers_every_command_of_the_table() -> None:
    for name, command in COMMANDS.items():
        controller = SimulatedController(SETTINGS, at(0.0))
        controller.setting_mode = command.letters.startswith("SR") or name == "measuring mode"
        controller.receive(command.text(1).encode() + b"\r", 0.0)
        assert not controller.due(0.001)
        assert not controller.due(1.0).startswith(b"ER"), name


# ---------------------------------------------------------------- real ports


@pytest.fixture(params=["socket", "pty"])
def port(request: pytest.FixtureRequest) -> str:
    """Name of a port at which a controller with another average answers."""
    if request.param == "pty" and sys.platform == "win32":
        pytest.skip("Windows has no pseudo-terminals")
    serve = serve_on_pty if request.param == "pty" else serve_on_socket
    controller = SimulatedController(set_to(averaging=64), at(6.4e-3), mode_change=0.0)
    return request.getfixturevalue("held")(serve(controller))


@pytest.fixture
def held():
    """Enters a context until the test is over."""
    from contextlib import ExitStack

    with ExitStack() as stack:
        yield stack.enter_context


def test_the_driver_speaks_through_pyserial(port: str) -> None:
    findings = {f.item: f for f in inspect(set_to(port=port)).findings}
    assert findings["serial port"].verdict == "ok"
    assert findings["averaging"].verdict == "wrong"
    assert findings["reading of OUT1"].found == "6.4 mm"
    assert sum(f.verdict != "ok" for f in findings.values()) == 1


@pytest.mark.skipif(sys.platform == "win32", reason="Windows names its ports otherwise")
def test_a_port_in_use_is_told() -> None:
    controller = SimulatedController(SETTINGS, at(0.0))
    with serve_on_pty(controller) as name:
        first = open_port(set_to(port=name))
        with pytest.raises(LaserError, match="in use; close the program that uses it"):
            open_port(set_to(port=name))
        first.close()
        open_port(set_to(port=name)).close()


@pytest.mark.skipif(sys.platform == "win32", reason="Windows has no pseudo-terminals")
def test_another_baud_rate_is_told() -> None:
    controller = SimulatedController(SETTINGS, at(0.0), mode_change=0.0)
    with serve_on_pty(controller, baud_rate=9600) as name:
        (wrong,) = inspect(set_to(port=name)).findings
        assert wrong.verdict == "wrong"
        assert "115200 Bd" in wrong.found
        assert "laser.baud_rate" in wrong.advice
        found = inspect(set_to(port=name, baud_rate=9600)).findings
        assert {f.verdict for f in found} == {"ok"}


@pytest.mark.parametrize(
    ("name", "said"),
    [
        ("/dev/ttyNOWHERE7", "there is no serial port /dev/ttyNOWHERE7; set laser.port"),
        ("nonsense://x", "cannot be opened"),
        ("socket://127.0.0.1:1", "cannot be opened"),
    ],
)
def test_a_port_that_is_not_there_is_told(name: str, said: str) -> None:
    with pytest.raises(LaserError, match=said):
        open_port(set_to(port=name))


def test_a_server_that_hangs_up_is_told() -> None:
    import socket
    import threading

    with socket.create_server(("127.0.0.1", 0)) as listener:

        def answer() -> None:
            caller, _ = listener.accept()
            with caller:
                caller.recv(1)

        thread = threading.Thread(target=answer)
        thread.start()
        settings = set_to(port=f"socket://127.0.0.1:{listener.getsockname()[1]}")
        port = open_port(settings)
        with pytest.raises(LaserError, match="fails"):
            Keyence(port, settings).program()
        thread.join()
        port._socket.close()  # type: ignore[attr-defined]  (pyserial leaves it open then)


def test_without_pyserial_it_is_said_where_to_get_it(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "serial", None)
    (finding,) = inspect(SETTINGS).findings
    assert finding.verdict == "wrong"
    assert "pyserial" in finding.found
    assert 'pip install "dearig[rig]"' in finding.advice
