"""A file that another program deletes, replaces, moves, cuts or overwrites during its run."""

from __future__ import annotations

import contextlib
import shutil
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from dearig.drivers.rig import Block
from dearig.errors import DiskFault
from dearig.recording import open_recording
from dearig.recording.verify import verify
from dearig.recording.writing.lost_file import LostFile
from dearig.recording.writing.recorder import Recorder
from tests.tools.command import names
from tests.tools.recordings import Clock, run_counts, writer

pytestmark = pytest.mark.skipif(
    sys.platform == "win32", reason="Windows lets no one delete or rename an open file"
)

COUNTS = run_counts(3000)
BLOCK = 500


def delete(path: Path) -> None:
    path.unlink()


def replace(path: Path) -> None:
    other = path.with_name("other")
    other.write_bytes(b"precious")
    other.replace(path)


def delete_folder(path: Path) -> None:
    shutil.rmtree(path.parent)


def move(path: Path) -> None:
    path.rename(path.with_name("elsewhere.h5"))


def move_folder(path: Path) -> None:
    path.parent.rename(path.parent.with_name("renamed"))


def cut(path: Path) -> None:
    path.write_bytes(b"")


def cut_its_end(path: Path) -> None:
    with path.open("r+b") as file:
        file.truncate(path.stat().st_size - 4096)


def overwrite(path: Path) -> None:
    with path.open("r+b") as file:
        file.write(b"not yours" * 10_000)


class Played:
    """A run of six blocks in which something happens to the file after the third."""

    def __init__(self, folder: Path, trouble: Callable[[Path], None], new_file: bool) -> None:
        folder.mkdir()
        self.path = folder / "run.h5"
        self.clock, self.now = Clock(), Clock()
        made = writer(self.path, now=self.now, samples_expected=COUNTS.shape[1])
        self.recorder = Recorder(made, new_file=new_file, clock=self.clock)
        for i in range(6):
            if i == 3:
                trouble(self.path)
            self.put(i)
        self.fault = self.recorder.fault

    def put(self, number: int) -> None:
        self.clock.moment += 1.0
        self.now.moment += 1.0
        start = number * BLOCK
        self.recorder.append(Block(start, COUNTS[:, start : start + BLOCK]))
        self.recorder.drain()


def holds(path: Path, start: int, stop: int) -> None:
    """The recording at ``path`` is whole and has these samples of the run."""
    found = verify(path)
    assert not [f for f in found.faults if "outcome is finished" not in f]
    run = open_recording(path)
    assert (run.samples, run.complete) == (stop - start, True)
    scaling = run.channels[3].scaling
    rest = scaling.physical(COUNTS[3, :1000]).mean()
    expected = scaling.physical(COUNTS[3, start:stop]) - rest
    np.testing.assert_allclose(run.displacement, expected, rtol=0.0, atol=1e-15)


@pytest.mark.parametrize(
    ("trouble", "said", "place"),
    [
        (delete, "was deleted by another program", "lab/run-saved.h5"),
        (delete_folder, "was deleted by another program", "run-saved.h5"),
        (replace, "another file has taken the place of", "lab/run-saved.h5"),
        (move, r"was moved to .*elsewhere\.h5", "lab/elsewhere.h5"),
        (move_folder, r"was moved to .*renamed/run\.h5", "renamed/run.h5"),
    ],
)
@pytest.mark.parametrize("in_the_end", [False, True])
def test_a_file_without_its_place_is_kept_whole(
    tmp_path: Path, trouble: Callable[[Path], None], said: str, place: str, in_the_end: bool
) -> None:
    played = Played(tmp_path / "lab", (lambda _: None) if in_the_end else trouble, new_file=False)
    if in_the_end:
        trouble(played.path)
        with pytest.raises(LostFile, match=rf"{said}.*; it is saved as .*{place}"):
            played.recorder.close("finished")
    else:
        # the run ends by its ramp, and that is recorded too
        with pytest.raises(LostFile, match=said):
            played.recorder.check()
        played.recorder.close("ended early")
    assert played.recorder.path.resolve() == tmp_path / place
    assert played.recorder.samples == 3000
    holds(tmp_path / place, 0, 3000)
    if trouble is replace:
        assert played.path.read_bytes() == b"precious"


@pytest.mark.parametrize("trouble", [cut, cut_its_end, overwrite])
def test_a_file_that_was_cut_or_overwritten_ends_the_run(
    tmp_path: Path, trouble: Callable[[Path], None]
) -> None:
    played = Played(tmp_path / "lab", trouble, new_file=False)
    said = r"another program cut .*run\.h5 short.*; (nothing|\d+ samples) of what was in it can be"
    with pytest.raises(LostFile, match=said):
        played.recorder.check()
    changed = played.path.read_bytes()
    with contextlib.suppress(LostFile):  # told again where something can be read
        played.recorder.close("ended early")
    # the other program's file is neither written to any more nor deleted
    assert played.path.read_bytes() == changed
    assert names(tmp_path / "lab") == {"run.h5"}


@pytest.mark.parametrize("trouble", [delete, replace, move, cut, cut_its_end, overwrite])
def test_the_run_goes_on_in_a_new_file(tmp_path: Path, trouble: Callable[[Path], None]) -> None:
    played = Played(tmp_path / "lab", trouble, new_file=True)
    recorder = played.recorder
    new = tmp_path / "lab" / "run-continued.h5"
    assert (played.fault, recorder.path) == (None, new)
    begun, *more = recorder.notices()
    assert not more
    start = begun.sample
    assert start in {1500, 2000}
    assert f"the recording goes on in {new} from sample {start}" in begun.message
    intact = trouble in (delete, replace, move)
    if intact:
        recorder.close("finished")
        place = tmp_path / "lab" / ("elsewhere.h5" if trouble is move else "run-saved.h5")
        assert [e.message for e in recorder.notices()] == [
            f"samples 0 to {start - 1} are in {place}"
        ]
        holds(place, 0, start)
    else:
        with pytest.raises(LostFile, match="of what was in it can be read"):
            recorder.close("finished")
    holds(new, start, 3000)
    run = open_recording(new)
    assert run.provenance["continues"] == str(played.path)
    assert run.provenance["continues_from_sample"] == start
    assert run.samples_expected == 3000 - start
    assert (run.events[0].sample, run.events[0].message) == (0, begun.message)


def test_where_no_new_file_can_be_begun_the_run_ends(tmp_path: Path) -> None:
    played = Played(tmp_path / "lab", move_folder, new_file=True)
    with pytest.raises(DiskFault, match=r"was moved to .*no new file could be begun"):
        played.recorder.check()
    played.recorder.close("ended early")
    assert played.recorder.path.resolve() == tmp_path / "renamed" / "run.h5"


def test_samples_that_another_program_changed_are_found_at_the_end(tmp_path: Path) -> None:
    path = tmp_path / "run.h5"
    recorder = writer(path)
    recorder.append(Block(0, COUNTS))
    recorder._flush_all(1.8e9)
    held = COUNTS[2].tobytes()
    raw = path.read_bytes()
    at = raw.index(held)
    with path.open("r+b") as file:
        file.seek(at + 100)
        file.write(bytes(50))
    # HDF5 has the chunk in its cache, and would write it again if it had changed
    with pytest.raises(DiskFault, match="samples 0 to 2999 are not those that were recorded"):
        recorder.close()
