"""Any sequence that a person can write, from its text to the output: no sample beyond a limit."""

import tempfile
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from dearig.acquisition.plan import plan
from dearig.config.rigfile import RigFile
from dearig.config.sequencefile import parse_sequence
from dearig.drivers.channels import Scaling
from dearig.drivers.gate import GatedWaveform, ramp_down
from dearig.errors import InputError

RIG = RigFile.model_validate(
    {
        "card": {"sample_rate_Hz": 500.0},
        "limits": {
            "voltage_max_kV": 7.0,
            "voltage_min_kV": -1.0,
            "slew_max_kV_per_s": 200.0,
            "true_field_max_MV_per_m": 9.0,
            "time_at_voltage_max_s": 1.5,
            "energy_max_J": 0.05,
        },
    }
)
LIMITS = RIG.limits
COUNT = 10e3 / 32768.0  # V at the film

kilovolts = st.one_of(
    st.floats(-2.0, 9.0), st.sampled_from([0.0, 7.0, -1.0, 7.0000001, 1e3, -1e3]),
    st.sampled_from(["nan", "inf", "-inf"]),
)  # fmt: skip
seconds = st.floats(0.004, 2.0)
rows = st.lists(st.tuples(st.floats(0.002, 0.3), kilovolts), min_size=1, max_size=8)


def table(kind, **keys):
    lines = [f"{key} = {value}" for key, value in keys.items()]
    return "\n".join(["[[segment]]", f'kind = "{kind}"', *lines])


segments = st.one_of(
    st.builds(lambda v, s: table("ramp", to_kV=v, duration_s=s), kilovolts, seconds),
    st.builds(lambda v, s: table("hold", voltage_kV=v, duration_s=s), kilovolts, seconds),
    st.builds(lambda s: table("hold", duration_s=s), seconds),
    st.builds(
        lambda v, f: table("half_sine", amplitude_kV=v, frequency_Hz=f),
        kilovolts, st.floats(0.3, 60.0),
    ),
    st.builds(
        lambda v, o, f: table("sine", amplitude_kV=v, offset_kV=o, frequency_Hz=f, cycles=1.5),
        kilovolts, kilovolts, st.floats(0.5, 60.0),
    ),
    st.builds(
        lambda v, r: table("steps", levels_kV=[v, 0.0], dwell_s=0.2, rise_s=r),
        st.floats(-2.0, 9.0), st.floats(0.001, 0.1),
    ),
    rows,
)  # fmt: skip


def write(parts, folder: Path) -> str:
    """The sequence's text; a list of rows becomes a CSV file next to it."""
    texts = ['name = "any"', "lead_in_s = 0.01", "tail_s = 0.01"]
    for number, part in enumerate(parts):
        if isinstance(part, list):
            at = np.cumsum([0.0, *(step for step, _ in part)])
            levels = [0.0, *(level for _, level in part)]
            lines = [f"{t},{v}" for t, v in zip(at, levels, strict=True)]
            text = "\n".join(["time_s,voltage_kV", *lines])
            (folder / f"{number}.csv").write_text(text, encoding="utf-8")
            texts.append(table("csv", file=f'"{number}.csv"'))
        else:
            texts.append(part)
    return "\n".join(texts)


@settings(max_examples=150)
@given(st.lists(segments, min_size=1, max_size=5), st.floats(0.0, 1.0))
def test_no_sample_of_any_sequence_is_beyond_a_limit(parts, stopped_at):
    with tempfile.TemporaryDirectory() as folder:
        text = write(parts, Path(folder))
        try:
            planned = plan(parse_sequence(text, "any", Path(folder)), RIG)
        except InputError:
            return
    if planned.waveform is None:
        assert planned.reasons
        return
    waveform = planned.waveform
    check_limits(waveform, waveform.window())
    check_standing(waveform)
    # wherever it is stopped, the way down is within them as well
    last = int(stopped_at * (waveform.samples - 1))
    down = ramp_down(waveform, last, LIMITS.ramp_down_s)
    check_limits(waveform, np.concatenate((waveform.window(0, last + 1), down)))


def check_limits(waveform: GatedWaveform, voltage: np.ndarray) -> None:
    # what goes out are counts of the converter, half of one from the sample at most
    out = Scaling((0.0, 10.0 / 32768.0), 1000.0).physical(
        Scaling((0.0, 10.0 / 32768.0), 1000.0).counts(voltage)
    )
    for samples, slack in ((voltage, 1e-9), (out, 0.5 * COUNT + 1e-9)):
        assert np.isfinite(samples).all()
        assert samples.max() <= 7e3 + slack
        assert samples.min() >= -1e3 - slack
        assert np.abs(np.diff(samples)).max(initial=0.0) * waveform.rate <= 200e3 * (1 + 1e-9) + (
            2.0 * slack * waveform.rate
        )
        # the film is never thicker than it is at rest
        assert np.abs(samples).max() / 1e-3 <= 9e6 + slack / 1e-3
    assert voltage[0] == voltage[-1] == 0.0


def check_standing(waveform: GatedWaveform) -> None:
    standing = np.abs(waveform.window()) >= LIMITS.at_voltage_kV * 1e3
    if standing.any():
        runs = np.diff(np.flatnonzero(np.diff(np.concatenate(([0], standing.astype(int), [0])))))
        assert runs[::2].max() / waveform.rate <= LIMITS.time_at_voltage_max_s


def test_the_property_meets_sequences_that_pass_and_that_do_not():
    good = table("half_sine", amplitude_kV=5.0, frequency_Hz=1.0)
    rows_of_nan = [(0.1, "nan"), (0.1, 0.0)]
    with tempfile.TemporaryDirectory() as folder:
        text = write([good], Path(folder))
        assert plan(parse_sequence(text, "any", Path(folder)), RIG).waveform is not None
        with pytest.raises(InputError, match="nan"):
            parse_sequence(write([rows_of_nan], Path(folder)), "any", Path(folder))
