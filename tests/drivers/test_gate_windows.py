"""A waveform that is computed again gives the samples that were checked, or none at all."""

import math
import threading
from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from dearig.drivers import gate
from dearig.drivers.errors import ChangedWaveform, RefusedWaveform
from dearig.drivers.gate import FilmForecast, Limits, admit, ramp_down
from dearig.drivers.samples import Computed, Repeated

PIECE, KEPT = 8, 2
RATE = 1000.0
LIMITS = Limits(-1000.0, 8000.0, 4e5, 1e7, 1.0, 5000.0, 1.0)


class Source:
    """A waveform of ``values`` that ``change`` may replace whenever a window is read."""

    def __init__(self, values, change: Callable[[int, np.ndarray], np.ndarray] | None = None):
        self.values = np.array(values, dtype=float)
        self.change = change
        self.read: list[tuple[int, int]] = []

    @property
    def samples(self) -> int:
        return self.values.size

    def window(self, start: int, stop: int) -> np.ndarray:
        self.read.append((start, stop))
        values = self.values[start:stop].copy()
        again = self.read.count((start, stop)) > 1
        return self.change(start, values) if again and self.change else values


@pytest.fixture(autouse=True)
def _short_pieces(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(gate, "_PIECE", PIECE)
    monkeypatch.setattr(gate, "_KEPT", KEPT)


def still(samples: int) -> FilmForecast:
    return FilmForecast(np.full(samples, 1e3), 5e-16)


def admitted(source, **more):
    return admit(source, RATE, LIMITS, still(source.samples), **more)


def long(samples: int = 10 * PIECE + 3) -> np.ndarray:
    return 300.0 * np.abs(np.sin(np.pi * np.arange(samples) / (samples - 1))).round(3) * 0.9


@settings(max_examples=60)
@given(
    st.lists(st.floats(-150.0, 150.0), max_size=5 * PIECE),
    st.lists(st.tuples(st.integers(-60, 60), st.integers(-60, 60) | st.none()), min_size=1),
)
def test_every_window_is_a_slice_of_what_was_checked(inside, windows):
    values = np.array([0.0, *inside, 0.0])
    source = Source(values)
    passed = admitted(source)
    np.testing.assert_array_equal(passed.window(), values)
    for start, stop in windows:
        np.testing.assert_array_equal(passed.window(start, stop), values[start:stop])
        for writeable in (passed.window(start, stop),):
            assert not writeable.size or not writeable.flags.writeable


any_value = st.one_of(
    st.floats(allow_nan=True, allow_infinity=True), st.floats(-1000.0, 8000.0),
    st.sampled_from([math.nan, math.inf, -0.0, 1e308]),
)  # fmt: skip


@settings(max_examples=100)
@given(st.integers(0, 10 * PIECE + 2), any_value)
def test_no_sample_of_a_second_evaluation_gets_out_unless_it_is_the_first(at, value):
    def change(start, values):
        if start <= at < start + values.size:
            values[at - start] = value
        return values

    values = long()
    passed = admitted(Source(values, change))
    same = np.array(value).tobytes() == values[at].tobytes()
    for start in range(0, values.size, 3):
        stop = min(start + 3, values.size)
        touched = start // PIECE <= at // PIECE <= (stop - 1) // PIECE
        try:
            out = passed.window(start, stop)
        except ChangedWaveform:
            assert touched
            assert not same
        else:
            np.testing.assert_array_equal(out, values[start:stop])


def fails(start, values):
    raise ZeroDivisionError("the segment divides by zero")


@pytest.mark.parametrize(
    "change",
    [
        fails,
        lambda _, values: values[:-1],
        lambda _, values: np.append(values, 0.0),
        lambda _, values: values[:, None],
        lambda _, values: np.nextafter(values, 1e9),
        lambda _, values: values.astype(np.float32),
        lambda _, values: np.zeros_like(values),
        lambda _, values: None,  # noqa: ARG005
    ],
)
def test_a_second_evaluation_that_is_no_waveform_gives_nothing(change):
    passed = admitted(Source(long(), change))
    with pytest.raises(ChangedWaveform):
        passed.window(3 * PIECE, 3 * PIECE + 1)
    with pytest.raises(ChangedWaveform):
        passed.window()
    with pytest.raises(ChangedWaveform):
        ramp_down(passed, 4 * PIECE, 1.0)


def test_an_array_that_its_owner_changes_afterwards_is_not_played():
    values = long()
    passed = admitted(Computed(values.size, lambda start, stop: values[start:stop]))
    before = values.copy()
    values[:] = 8e3
    with pytest.raises(ChangedWaveform):
        passed.window(0, 1)
    # what is still kept are copies
    np.testing.assert_array_equal(passed.window(-PIECE), before[-PIECE:])


def test_an_array_that_its_owner_changes_during_the_check_is_played_as_it_was_checked():
    shared = long()

    class Saboteur(FilmForecast):
        def follow(self, start, voltage):
            shared[start : start + voltage.size] = 7e3  # the voltage has been checked by now
            return super().follow(start, voltage)

    before = shared.copy()
    source = Computed(shared.size, lambda start, stop: shared[start:stop])
    passed = admit(source, RATE, LIMITS, Saboteur(np.full(shared.size, 1e3), 5e-16))
    for at in range(shared.size):
        try:
            assert passed.window(at, at + 1)[0] == before[at]
        except ChangedWaveform:
            continue
    assert passed.margins[0].reached < 1.0


def test_an_array_of_another_kind_cannot_lie_about_its_bytes():
    class Liar(np.ndarray):
        def tobytes(self, order="C"):  # noqa: ARG002
            return np.full(self.shape, 8e3).tobytes()

        def copy(self, order="C"):  # noqa: ARG002
            return np.full(self.shape, 8e3)

    values = long(PIECE)
    np.testing.assert_array_equal(
        admit(values.view(Liar), RATE, LIMITS, still(PIECE)).window(), values
    )
    source = Computed(PIECE, lambda start, stop: values[start:stop].view(Liar))
    np.testing.assert_array_equal(admitted(source).window(), values)


def test_a_waveform_that_is_kept_is_read_once():
    short = Source(long(KEPT * PIECE), fails)
    passed = admitted(short)
    for _ in range(3):
        np.testing.assert_array_equal(passed.window(), short.values)
    assert short.read == [(0, PIECE), (PIECE, 2 * PIECE)]


def test_reading_on_computes_each_piece_once_again():
    source = Source(long())
    passed = admitted(source)
    first = list(source.read)
    for at in range(passed.samples):
        passed.window(at, at + 1)
        passed.window(max(0, at - PIECE), at)  # a reader that is one piece behind
    assert source.read == first * 2


def test_its_length_is_that_which_was_checked():
    source = Source(long())
    passed = admitted(source)
    samples = passed.samples
    source.values = np.full(1000, 8e3)
    assert passed.samples == samples
    assert passed.window(samples, samples + 9).size == 0
    with pytest.raises(ChangedWaveform):
        passed.window(0, 1)


@pytest.mark.parametrize("wrong", [lambda v: v[:-1], lambda v: v[None]])
def test_a_source_that_gives_another_number_of_samples_is_refused(wrong):
    values = long()
    source = Computed(values.size, lambda start, stop: wrong(values[start:stop]))
    with pytest.raises(RefusedWaveform, match=r"8 samples from 0 on were asked for"):
        admitted(source)


def test_a_prediction_that_follows_with_another_number_is_refused():
    class Short(FilmForecast):
        def follow(self, start, voltage):
            return super().follow(start, voltage)[:-1]

    with pytest.raises(RefusedWaveform, match=r"8 samples from 0 on have \(7,\) predictions"):
        admit(long(), RATE, LIMITS, Short(np.full(10 * PIECE + 3, 1e3), 5e-16))


def test_the_first_bad_sample_is_named_in_whatever_piece():
    values = long()
    values[6 * PIECE + 1] = math.nan
    with pytest.raises(RefusedWaveform, match=r"sample 49 \(at 0.049 s\) is not a finite number"):
        admitted(Source(values))


def test_progress_is_told_and_ends_the_check():
    told: list[float] = []
    admitted(Source(long()), progress=told.append)
    assert told == sorted(told)
    assert told[-1] == 1.0
    assert len(told) == 11

    class Enough(Exception):  # noqa: N818
        pass

    def stop(part: float) -> None:
        if part > 0.3:
            raise Enough

    source = Source(long())
    with pytest.raises(Enough):
        admitted(source, progress=stop)
    assert len(source.read) < 7
    assert not [t for t in threading.enumerate() if t.name.startswith("gate")]


def test_windows_are_the_same_from_every_thread():
    values = long(40 * PIECE)
    passed = admitted(Source(values))
    wrong: list[int] = []

    def read(offset: int) -> None:
        for i in range(200):
            start = (offset + 7 * i) % values.size
            if not np.array_equal(passed.window(start, start + 20), values[start : start + 20]):
                wrong.append(start)

    threads = [threading.Thread(target=read, args=(31 * k,)) for k in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert not wrong


@given(st.integers(1, 40), st.integers(1, 7), st.integers(0, 45), st.integers(0, 45))
def test_repeated_samples_are_those_of_the_whole(samples, stride, start, stop):
    values = np.arange(-(-samples // stride))
    whole = np.repeat(values, stride)[:samples]
    repeated = Repeated(values, stride, samples).window(start, max(start, stop))
    np.testing.assert_array_equal(repeated, whole[start : max(start, stop)])
