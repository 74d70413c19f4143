"""Work in a process of its own: what comes back, and how it ends."""

from __future__ import annotations

import math
import os
import sys
import threading
from collections.abc import Iterator
from pathlib import Path

import pytest

from dearig.errors import InputError, hints_of
from dearig.progress import Progress
from dearig.window.jobs.worker import Job, TimeLeft, Worker

# long enough for an interpreter to start on a busy machine
_PATIENCE = 60_000


@pytest.fixture(autouse=True)
def _elsewhere(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Work in another folder: a child imports nothing from the working one, this module neither."""
    monkeypatch.chdir(tmp_path)


def doubled(number: int, progress: Progress) -> int:
    progress("doubling", 0.5)
    progress("doubling", 0.5001)
    progress("doubling", 1.0)
    return 2 * number


def refused(progress: Progress) -> None:
    raise InputError("x.h5 is not there", option="rig_file", command=("recover", "x.h5"))


def defective(progress: Progress) -> None:
    raise KeyError("mu_0")


def gone(progress: Progress) -> None:
    os._exit(7)


def endless(sign: Path, progress: Progress) -> None:
    sign.touch()
    progress("waiting", 0.0)
    threading.Event().wait()


def stubborn(progress: Progress) -> None:
    while True:
        try:
            progress("waiting", 0.0)
            threading.Event().wait()
        except KeyboardInterrupt:
            progress("heard, and going on", 0.5)


def niceness(progress: Progress) -> int:
    return os.getpriority(os.PRIO_PROCESS, 0)


class _Deaf:
    """What is deleted loses an interrupt: ``__del__`` cannot raise it."""

    def __del__(self) -> None:
        threading.Event().wait()


def deaf(progress: Progress) -> str:
    progress("waiting", 0.0)
    _Deaf()
    progress("going on", 0.5)
    return "never"


def keeping(progress: Progress) -> str:
    try:
        progress("waiting", 0.0)
        threading.Event().wait()
    except KeyboardInterrupt:
        return "kept"
    return "never"


@pytest.fixture
def worker(qtbot) -> Iterator[Worker]:
    worker = Worker()
    yield worker
    worker.close()


def ended(job: Job) -> list:
    """What the job will end with: (kind, value)."""
    seen: list = []
    job.finished.connect(lambda value: seen.append(("done", value)))
    job.failed.connect(lambda words: seen.append(("failed", words)))
    job.cancelled.connect(lambda: seen.append(("cancelled", None)))
    return seen


def test_a_job_gives_its_result_and_its_progress(qtbot, worker):
    job = worker.submit(doubled, 21)
    seen, stages = ended(job), []
    job.progressed.connect(lambda *told: stages.append(told[:2]))
    qtbot.waitUntil(lambda: seen != [], timeout=_PATIENCE)
    assert seen == [("done", 42)]
    # a change too small to be seen is not worth a message
    assert stages == [("doubling", 0.5), ("doubling", 1.0)]
    assert not worker.busy


@pytest.mark.skipif(sys.platform == "win32", reason="priorities of POSIX")
def test_the_window_and_a_run_come_before_its_jobs(qtbot, worker):
    """On two cores a press of STOP waited twice as long for a job that reads recordings."""
    seen = ended(worker.submit(niceness))
    qtbot.waitUntil(lambda: seen != [], timeout=_PATIENCE)
    assert seen == [("done", min(os.getpriority(os.PRIO_PROCESS, 0) + 10, 19))]


def test_jobs_come_in_their_order_but_for_those_put_first(qtbot, worker):
    order: list[int] = []
    for number, first in ((1, False), (2, False), (3, True), (4, True)):
        worker.submit(doubled, number, first=first).finished.connect(order.append)
    qtbot.waitUntil(lambda: len(order) == 4, timeout=_PATIENCE)
    assert order == [2, 6, 8, 4]


def test_a_refusal_is_a_sentence_and_the_next_job_runs(qtbot, worker):
    job = worker.submit(refused)
    seen = ended(job)
    after = ended(worker.submit(doubled, 1))
    qtbot.waitUntil(lambda: after != [], timeout=_PATIENCE)
    assert seen == [("failed", "x.h5 is not there")]
    assert job.failure == "x.h5 is not there"
    (hint,) = hints_of(job.failure)
    assert (hint.options, hint.command) == (("rig_file",), ("recover", "x.h5"))
    assert after == [("done", 2)]


def test_a_defect_is_told_and_the_next_job_runs(qtbot, worker):
    seen = ended(worker.submit(defective))
    after = ended(worker.submit(doubled, 1))
    qtbot.waitUntil(lambda: after != [], timeout=_PATIENCE)
    ((kind, words),) = seen
    assert kind == "failed"
    assert "an error in the program" in words
    assert "mu_0" in words
    assert after == [("done", 2)]


def test_a_process_that_dies_is_told_and_replaced(qtbot, worker):
    seen = ended(worker.submit(gone))
    after = ended(worker.submit(doubled, 1))
    qtbot.waitUntil(lambda: after != [], timeout=_PATIENCE)
    assert seen[0][0] == "failed"
    assert "ended unexpectedly" in seen[0][1]
    assert after == [("done", 2)]


def test_cancel_ends_the_work_and_the_next_job_runs(qtbot, worker, tmp_path):
    sign = tmp_path / "began"
    job = worker.submit(endless, sign)
    seen, after = ended(job), ended(worker.submit(doubled, 1))
    with qtbot.waitSignal(job.progressed, timeout=_PATIENCE):
        pass
    assert sign.exists()
    job.cancel()
    qtbot.waitUntil(lambda: after != [], timeout=_PATIENCE)
    assert seen == [("cancelled", None)]


def test_an_interrupt_that_a_callback_loses_ends_the_work_at_its_next_progress(qtbot, worker):
    job = worker.submit(deaf)
    seen = ended(job)
    with qtbot.waitSignal(job.progressed, timeout=_PATIENCE):
        pass
    job.cancel()
    qtbot.waitUntil(lambda: seen != [], timeout=_PATIENCE)
    assert seen == [("cancelled", None)]


def test_what_work_keeps_when_it_is_cancelled_comes_back(qtbot, worker):
    job = worker.submit(keeping)
    seen = ended(job)
    with qtbot.waitSignal(job.progressed, timeout=_PATIENCE):
        pass
    job.cancel()
    qtbot.waitUntil(lambda: seen != [], timeout=_PATIENCE)
    assert seen == [("done", "kept")]


def test_a_second_cancel_does_not_ask(qtbot, worker):
    job = worker.submit(stubborn)
    seen, after = ended(job), ended(worker.submit(doubled, 1))
    with qtbot.waitSignal(job.progressed, timeout=_PATIENCE):
        pass
    with qtbot.waitSignal(job.progressed, timeout=_PATIENCE):
        job.cancel()
    assert seen == []
    job.cancel()
    assert seen == [("cancelled", None)]
    qtbot.waitUntil(lambda: after != [], timeout=_PATIENCE)


def test_a_job_that_waits_is_cancelled_unseen(qtbot, worker):
    first = ended(worker.submit(doubled, 1))
    job = worker.submit(doubled, 2)
    waiting = ended(job)
    job.cancel()
    assert waiting == [("cancelled", None)]
    qtbot.waitUntil(lambda: first != [], timeout=_PATIENCE)
    assert not worker.busy


def test_close_leaves_no_process_and_no_thread(qtbot, tmp_path):
    before = set(threading.enumerate())
    worker = Worker()
    job = worker.submit(endless, tmp_path / "began")
    seen = ended(job)
    with qtbot.waitSignal(job.progressed, timeout=_PATIENCE):
        pass
    process = worker._process
    worker.close()
    assert seen == []
    assert set(threading.enumerate()) == before
    with pytest.raises(ValueError, match="closed"):
        process.is_alive()


def test_the_estimate_is_that_of_the_stage():
    estimate = TimeLeft()
    assert estimate.left("search", 0.0, 0.0) is None
    assert estimate.left("search", 0.01, 2.0) is None  # too little to tell
    assert estimate.left("search", 0.25, 5.0) == pytest.approx(15.0)
    assert estimate.left("intervals", 0.5, 6.0) is None
    # what a stage had done when it was first heard of took no time of its own
    assert estimate.left("intervals", 0.75, 8.0) == pytest.approx(2.0)


def test_the_whole_work_keeps_one_estimate_through_its_stages(qtbot):
    now = iter((0.0, 3.0, 6.0, 9.0))
    worker = Worker(clock=lambda: next(now))
    left: list[float] = []
    job = worker.submit(staged, whole=True)
    job.progressed.connect(lambda *told: left.append(told[2]))
    with qtbot.waitSignal(job.finished, timeout=_PATIENCE):
        pass
    worker.close()
    assert math.isnan(left[0])
    assert left[1:] == pytest.approx([9.0, 6.0, 3.0])


def staged(progress: Progress) -> None:
    for i, stage in enumerate(("baseline", "screening", "refits", "choice")):
        progress(stage, 0.25 * i)
