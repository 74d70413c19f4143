"""What the example programs of nidaqmx-python must read and write on the simulated card.

Each check returns in words what it compared with the truth: the rig at rest at the inputs, and the
signals of ``DEFAULT_SIGNALS`` at the digital terminals. An ``AssertionError`` says what is wrong.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from dearig.sim_backend.daqmx.simulated_card import SimulatedCard

_REST_V = 0.1  # largest voltage at the inputs of a rig at rest: noise and offset


@dataclass
class Played:
    """An example that has run: the card, its reads and writes, its output, and its error."""

    device: SimulatedCard
    calls: list[list[Any]]
    printed: str
    failure: dict[str, Any]
    lines: list[tuple[str, bool, float]]  # changes of the digital lines, with their times in s

    def values(self, *names: str) -> list[Any]:
        """Return what its reads gave, or its writes took."""
        return [value for _, name, value in self.calls if name in (names or ("read",))]

    def numbers(self) -> np.ndarray:
        """Return all that its reads gave, one after the other."""
        parts = [np.ravel(value) for value in self.values("read", "read_waveform")]
        return np.concatenate(parts) if parts else np.empty(0)

    def edges(self, terminal: str, rising: bool = True) -> np.ndarray:
        """Return the times of the edges on a terminal up to now, in s."""
        return self.device.terminals.signal(terminal).edges(-1.0, self.device.state.now(), rising)

    def rises(self, line: str) -> np.ndarray:
        """Return when a digital line went from low to high, in s."""
        levels = [(at, level) for name, level, at in self.lines if name == line]
        before = [False, *(level for _, level in levels[:-1])]
        return np.array(
            [at for (at, level), low in zip(levels, before, strict=True) if level and not low]
        )


Check = Callable[[Played], str]


def _expect(condition: bool, words: str) -> None:
    if not condition:
        raise AssertionError(words)


def _at_rest(samples: int | None = None) -> Check:
    """Return a check of ``samples`` volts of a rig at rest; None: more than none."""

    def check(played: Played) -> str:
        volts = played.numbers()
        _expect(volts.size > 0 if samples is None else volts.size == samples, f"{volts.size} read")
        _expect(float(np.abs(volts).max()) < _REST_V, f"up to {np.abs(volts).max():g} V at rest")
        _expect(volts.size == 1 or float(np.ptp(volts)) > 0.0, "no noise")
        return f"{volts.size} samples of the rig at rest"

    return check


def _raw(played: Played) -> str:
    sizes = re.findall(r"\[[^\]]*\]|array\(([^)]*)\)", played.printed)
    _expect(len(sizes) == 4, f"{len(sizes)} reads printed")
    return "4 raw reads of 1 and 4 channels printed"


def _generated(low: float, high: float) -> Check:
    """Return a check that the wired output has gone between ``low`` and ``high`` V."""

    def check(played: Played) -> str:
        written = np.concatenate([np.ravel(v) for v in played.values("write")])
        _expect(bool(np.isclose(written.min(), low, atol=0.02)), f"from {written.min():g} V")
        _expect(bool(np.isclose(written.max(), high, atol=0.02)), f"to {written.max():g} V")
        volts = [change.output for change in played.device.history()]
        _expect(max(np.abs(volts)) > 0.0, "the output has not moved")
        return f"ao0 between {low:g} and {high:g} V"

    return check


def _stands_at(volts: float, what: str) -> Check:
    def check(played: Played) -> str:
        stands = played.device.output_voltage()
        _expect(abs(stands - volts) < 0.01, f"the output is at {stands:g} V")
        return what

    return check


def _counted(played: Played) -> str:
    counts = played.numbers()
    times = [time for time, name, _ in played.calls if name == "read"]
    rate = (counts[-1] - counts[0]) / (times[-1] - times[0])
    _expect(abs(rate - 1000.0) < 20.0, f"{rate:g} edges a second")
    return f"{counts[-1]:g} edges at {rate:.0f} a second, of 1 kHz"


def _counted_on_a_clock(played: Played) -> str:
    counts = played.numbers()
    _expect(counts.size >= 1000, f"{counts.size} samples")
    _expect(set(np.diff(counts)) == {2.0}, "other than 2 edges of 1 kHz for each of 500 Hz")
    return f"{counts.size} samples, 2 edges of 1 kHz for each of 500 Hz"


def _frequency(least: int) -> Check:
    def check(played: Played) -> str:
        found = played.numbers()
        _expect(found.size >= least, f"{found.size} values")
        _expect(bool(np.allclose(found, 1000.0)), f"{found.min():g} to {found.max():g} Hz")
        return f"{found.size} values of 1000 Hz"

    return check


def _pulse_frequency(played: Played) -> str:
    (pulse,) = played.values("read")
    _expect(abs(pulse["freq"] - 1000.0) < 0.1, f"{pulse['freq']:g} Hz")
    _expect(abs(pulse["duty_cycle"] - 0.25) < 1e-3, f"duty cycle {pulse['duty_cycle']:g}")
    return "1000 Hz, 25 %"


def _pulses(interval: float, least: int, what: str) -> Check:
    """Return a check of pulses at PFI12, ``interval`` s apart."""

    def check(played: Played) -> str:
        rises = played.edges("pfi12")
        _expect(rises.size >= least, f"{rises.size} pulses at PFI12")
        apart = np.diff(rises)
        _expect(bool(np.allclose(apart, interval, rtol=1e-3)), f"{apart.min():g} s apart")
        return f"{rises.size} {what} at PFI12"

    return check


def _one_pulse(played: Played) -> str:
    rises, falls = played.edges("pfi12"), played.edges("pfi12", rising=False)
    _expect((rises.size, falls.size) == (1, 1), f"{rises.size} pulses")
    _expect(abs(falls[0] - rises[0] - 1.0) < 1e-6, f"{falls[0] - rises[0]:g} s long")
    return "a pulse of 1 s at PFI12"


def _widths(low: float, high: float) -> Check:
    """Return a check of pulses at PFI12 whose duty cycles grow from ``low`` to ``high``."""

    def check(played: Played) -> str:
        rises, falls = played.edges("pfi12"), played.edges("pfi12", rising=False)
        ends = np.searchsorted(falls, rises[:-1])
        # the first one is what the channel was created with, until the first clock edge
        duty = ((falls[ends] - rises[:-1]) / np.diff(rises))[1:]
        _expect(duty.size > 100, f"{duty.size} pulses")
        inside = (duty > low - 1e-3) & (duty < high + 1e-3)
        _expect(bool(inside.all()), f"duty cycles {duty.min():g} to {duty.max():g}")
        return f"{duty.size} pulses at PFI12, duty cycles {duty.min():.3f} to {duty.max():.3f}"

    return check


def _lines_at_rest(samples: int | None) -> Check:
    def check(played: Played) -> str:
        values = played.values("read", "read_waveform")
        flat = np.concatenate([np.ravel(v) for v in values])
        _expect(samples is None or flat.size == samples, f"{flat.size} values")
        _expect(not flat.astype(bool).any(), "a line that no one drives is high")
        return f"{flat.size} values of lines that no one drives"

    return check


def _lines_stand(levels: str) -> Check:
    """Return a check of the levels of port 0 afterwards, line 0 first."""

    def check(played: Played) -> str:
        found = "".join(str(int(played.device.line(f"port0/line{i}"))) for i in range(len(levels)))
        _expect(found == levels, f"the lines are at {found}")
        return f"port 0 at {levels}, line 0 first"

    return check


def _walking(played: Played) -> str:
    """Check that one line after the other was high for 0.1 s."""
    rises = [played.rises(f"port0/line{i}") for i in range(8)]
    _expect(all(r.size for r in rises), "a line was never high")
    first = np.array([r[0] for r in rises])
    _expect(bool(np.allclose(np.diff(first), 0.1)), "not one after the other")
    return "each line of port 0 high for 0.1 s after the one before"


def _toggled(played: Played) -> str:
    rises = played.rises("port0/line0")
    _expect(rises.size == 500, f"{rises.size} edges")
    return "500 edges on port0/line0"


def _print(pattern: str, words: str) -> Check:
    def check(played: Played) -> str:
        _expect(re.search(pattern, played.printed) is not None, "another text than expected")
        return words

    return check


def _records_of(played: Played) -> str:
    reads = [len(v) for v in played.values("read")]
    _expect(len(reads) >= 1 and set(reads) == {1000}, f"reads of {reads}")
    return _at_rest()(played) + ", 1000 for each trigger"


def _together(played: Played) -> str:
    _expect(len(played.values("read")) >= 2, "fewer than 2 reads")
    found = re.search(r"total.* (\d+) total AI samples and (\d+) total DI", played.printed)
    _expect(found is None or found[1] == found[2], "other numbers of samples")
    return f"{len(played.values('read'))} reads of both tasks"


def _output_seen(played: Played) -> str:
    volts = np.array(played.values("read")[-1])
    monitor = played.device.settings.amplifier
    _expect(volts.size == 1000, f"{volts.size} samples")
    swing = float(np.ptp(volts))
    _expect(swing > 0.1, f"the monitor of the amplifier moves by {swing:g} V")
    return f"the film's voltage follows ao0 (monitor, {monitor.monitor_V_per_kV:g} V/kV)"


CHECKS: dict[str, Check] = {
    "analog_in/ai_raw.py": _raw,
    "analog_in/cont_voltage_acq_int_clk.py": _at_rest(),
    "analog_in/cont_voltage_acq_int_clk_dig_start.py": _at_rest(),
    "analog_in/cont_voltage_acq_int_clk_dig_start_retrig.py": _records_of,
    "analog_in/cont_voltage_acq_int_clk_every_n_samples_event.py": _at_rest(),
    "analog_in/voltage_acq_int_clk.py": _at_rest(50),
    "analog_in/voltage_acq_int_clk_dig_ref.py": _at_rest(100),
    "analog_in/voltage_acq_int_clk_dig_start_ref.py": _at_rest(100),
    "analog_in/voltage_acq_int_clk_plot_data.py": _at_rest(50),
    "analog_in/voltage_acq_int_clk_plot_wfm.py": _at_rest(50),
    "analog_in/voltage_acq_int_clk_wfm.py": _at_rest(50),
    "analog_in/voltage_sample.py": _at_rest(1),
    "analog_out/cont_gen_voltage_wfm_int_clk.py": _generated(-1.0, 1.0),
    "analog_out/cont_gen_voltage_wfm_int_clk_every_n_samples_event.py": _generated(-1.0, 1.0),
    "analog_out/cont_gen_voltage_wfm_int_clk_non_regen.py": _generated(-1.0, 1.0),
    "analog_out/gen_voltage_wfm_int_clk.py": _stands_at(4.995, "ends at the last of 1000 samples"),
    "analog_out/voltage_update.py": _stands_at(1.1, "ao0 at 1.1 V"),
    "channel_properties.py": _print(
        r"0\.1\n-0\.1\n5\.0\n-5\.0\n10\.0\n-10\.0\n5\.0\n-5\.0\n.*Dev1/ai2",
        "the limits that it set, as the card's ranges",
    ),
    "counter_in/cnt_dig_event.py": _counted,
    "counter_in/cont_cnt_buff_event_ext_clk.py": _counted_on_a_clock,
    "counter_in/cont_read_buff_freq.py": _frequency(1000),
    "counter_in/read_freq.py": _frequency(1),
    "counter_in/read_pulse_freq.py": _pulse_frequency,
    "counter_out/cont_gen_dig_pulse_train.py": _pulses(1.0, 2, "pulses 1 s apart"),
    "counter_out/cont_gen_dig_pulse_train_buff_ext_clk.py": _widths(0.5, 0.8),
    "counter_out/cont_gen_dig_pulse_train_buff_implicit.py": _widths(0.5, 0.8),
    "counter_out/write_single_dig_pulse.py": _one_pulse,
    "digital_in/acq_dig_port_int_clk.py": _lines_at_rest(50),
    "digital_in/acq_dig_port_int_clk_wfm.py": _lines_at_rest(400),
    "digital_in/cont_acq_dig_lines_int_clk.py": _lines_at_rest(None),
    "digital_in/read_dig_lines.py": _lines_at_rest(4),
    "digital_in/read_dig_port.py": _lines_at_rest(1),
    "digital_out/cont_gen_dig_port_int_clk.py": _walking,
    "digital_out/cont_gen_dig_port_int_clk_wfm.py": _walking,
    "digital_out/gen_dig_line_int_clk.py": _toggled,
    "digital_out/write_dig_lines.py": _lines_stand("1010"),
    "digital_out/write_dig_port.py": _lines_stand("11111111"),
    "every_n_samples_event.py": _at_rest(),
    "nidaqmx_warnings.py": _print(
        "Suppressing warnings", "came to its end; a simulated card may not warn"
    ),
    "playrec.py": _print(
        r"Input channels: \['Dev2/ai0'", "the card's channels, and 5000 samples of 3 inputs"
    ),
    "synchronization/multi_function/ai_ao_sync.py": _output_seen,
    "synchronization/multi_function/cont_ai_ci_tdms_sync.py": _print(
        r"First 10 samples from CI_Task", "the file that it wrote, with both tasks"
    ),
    "synchronization/multi_function/cont_ai_di_acq.py": _together,
    "system_properties.py": _print(r"DAQmx 25\.0\.0\n.*PCIe-6361", "the version and the card"),
}
