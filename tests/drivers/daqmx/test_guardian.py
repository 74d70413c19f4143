"""The guardian's judgement: which words and which silence take the output to 0 V."""

import json

import pytest

from dearig.drivers.daqmx.guardian import TakeOver
from dearig.drivers.daqmx.guardian_process import Guard
from dearig.drivers.errors import RigError
from dearig.drivers.zero_reading import ZeroReading


class Bench:
    """A guard whose acts and words are kept."""

    def __init__(self, fails: str = "") -> None:
        self.zeroed = 0
        self.said: list[str] = []
        self.told: list[str] = []
        self._fails = fails
        self.released = 0
        self.guard = Guard(self._zero, self.said.append, self.told.append, self._release)

    def reports(self) -> list[TakeOver]:
        acted = [word.removeprefix("acted ") for word in self.said if word.startswith("acted ")]
        return [TakeOver(**json.loads(report)) for report in acted]

    def _release(self) -> None:
        self.released += 1

    def _zero(self) -> ZeroReading | None:
        self.zeroed += 1
        if self._fails:
            raise RigError(self._fails)
        return ZeroReading(0.3, 0.0, True)


@pytest.mark.parametrize(
    ("words", "goes_on", "zeroed", "told"),
    [
        (["arm", "beat", "beat"], True, 0, ""),
        (["arm", "beat", None], False, 1, "(the run has died): the output was taken to 0 V"),
        (["arm", None], False, 1, "the run has died"),
        (["arm", "disarm", None], False, 0, ""),
        (["arm", "beat", "disarm", "bye"], False, 0, ""),
        (["bye"], False, 0, ""),
        ([None], False, 0, ""),
        (["arm", "take over"], True, 1, "could not bring the output to 0 V itself"),
        (["arm", "take over", "beat", None], False, 1, "could not bring"),
        (["arm", "take over", "arm", None], False, 1, "could not bring"),
        (["arm", "take over", "disarm", "arm", None], False, 2, "the run has died"),
        (["arm", "a word of another version"], True, 0, ""),
        (["beat"], True, 0, ""),
    ],
)
def test_words(words, goes_on, zeroed, told):
    bench = Bench()
    results = [bench.guard.hear(word) for word in words]
    assert results[:-1] == [True] * (len(words) - 1)
    assert results[-1] is goes_on
    assert bench.zeroed == zeroed
    assert bench.said.count("heard") == len([word for word in words if word is not None])
    assert len(set(bench.reports())) == zeroed
    assert all(report.confirmed for report in bench.reports())
    assert told in "".join(bench.told[-1:])


def test_silence_is_a_frozen_run_and_a_beat_after_it_does_not_arm_again():
    bench = Bench()
    bench.guard.hear("arm")
    bench.guard.silence()
    assert bench.zeroed == 1
    assert "frozen" in bench.told[0]
    bench.guard.hear("beat")
    assert not bench.guard.armed


def test_what_was_taken_down_is_held_until_the_run_has_made_itself_safe():
    bench = Bench()
    bench.guard.hear("arm")
    bench.guard.silence()
    report = bench.said[-1]
    bench.guard.hear("arm")
    assert bench.said[-2:] == [report, "heard"]
    assert not bench.guard.armed
    assert bench.released == 0
    bench.guard.hear("disarm")
    bench.guard.hear("disarm")
    assert bench.released == 1
    bench.guard.hear("arm")
    assert bench.guard.armed
    assert bench.said[-1] == "heard"


def test_what_cannot_be_done_is_told_to_the_run_and_to_the_person():
    bench = Bench(fails="the server does not answer")
    bench.guard.hear("arm")
    bench.guard.hear("take over")
    assert "THE OUTPUT COULD NOT BE TAKEN TO 0 V (the server does not answer)" in bench.told[0]
    assert [report.error for report in bench.reports()] == ["the server does not answer"]
    assert not bench.reports()[0].confirmed
