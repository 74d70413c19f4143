"""Files made to harm: nothing outside them is read, nothing is made room for that is not there."""

from __future__ import annotations

import shutil
from collections.abc import Callable
from pathlib import Path

import h5py
import numpy as np
import pytest

from dearig.config.sequencefile import load_sequence
from dearig.drivers.rig import Block
from dearig.errors import InputError
from dearig.recording import open_recording
from dearig.recording.importers.formats.text_file import TextFile
from dearig.recording.verify import verify
from tests.fuzz.__main__ import run as fuzz
from tests.fuzz.targets import TARGETS, seeds_of
from tests.fuzz.worker import complaint, input_of
from tests.tools.recordings import run_counts, write_run, writer

CORPUS = sorted((Path(__file__).parents[2] / "fuzz" / "corpus").iterdir())
Change = Callable[[h5py.File], None]


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("good") / "run.h5"
    write_run(path)
    return path


def linked(where: str, link: object) -> Change:
    def change(file: h5py.File) -> None:
        del file[where]
        file[where] = link

    return change


def virtual(file: h5py.File) -> None:
    del file["entry/data/displacement"]
    layout = h5py.VirtualLayout(shape=(3000,), dtype="f8")
    layout[:] = h5py.VirtualSource("other.h5", "entry/data/displacement", shape=(3000,))
    file["entry/data"].create_virtual_dataset("displacement", layout)


def outside(file: h5py.File) -> None:
    del file["entry/data/displacement"]
    file["entry/data"].create_dataset(
        "displacement", (3000,), "f8", external=[("secret.bin", 0, h5py.h5f.UNLIMITED)]
    )


def claiming(where: str, dtype: str = "f8", **how: object) -> Change:
    def change(file: h5py.File) -> None:
        attributes = dict(file[where].attrs)
        del file[where]
        made = file.create_dataset(where, (10**12,), dtype, chunks=(1024,), **how)
        made.attrs.update(attributes)
        made[:1000] = np.zeros(1000, dtype)

    return change


def packed(file: h5py.File) -> None:
    del file["entry/data/displacement"]
    file.create_dataset(
        "entry/data/displacement", data=np.zeros(2_000_000), chunks=(500_000,), compression=9
    )


@pytest.mark.parametrize(
    ("change", "match"),
    [
        (
            linked("entry/data/displacement", h5py.ExternalLink("other.h5", "/entry/data/time")),
            "/entry/data/displacement is a link, and links are not followed",
        ),
        (linked("entry", h5py.ExternalLink("other.h5", "/entry")), "/entry is a link"),
        (linked("entry/data", h5py.SoftLink("/entry/away")), "/entry/data is a link"),
        (linked("entry/data/time", h5py.SoftLink("/entry/data/time")), "time is a link"),
        (linked("entry/sample", h5py.ExternalLink("/dev/zero", "/")), "/entry/sample is a link"),
        (
            linked("entry/instrument/amplifier", h5py.ExternalLink("other.h5", "/")),
            "amplifier is a link",
        ),
        (linked("entry/sequence", h5py.ExternalLink("other.h5", "/x")), "/entry/sequence is a lin"),
        (virtual, "displacement takes its values from other files"),
        (outside, "displacement takes its values from other files"),
        (claiming("entry/data/displacement"), "displacement claims 8000000000000 bytes and 8192"),
        (claiming("entry/data/time"), "time claims 8000000000000 bytes"),
        (claiming("entry/data/displacement_counts", "i2"), "displacement_counts claims 2000000"),
        (claiming("entry/data/time", compression=1), "time claims 8000000000000 bytes"),
        (claiming("entry/notes"), None),
        (claiming("entry/events", "i8"), "/entry/events claims 8000000000000 bytes"),
        (claiming("entry/model", "S9"), "/entry/model claims 9000000000000 bytes"),
        (claiming("entry/wall_clock", "i8"), None),
        (packed, "displacement claims 16000000 bytes and"),
    ],
)
def test_nothing_is_followed_or_believed(
    tmp_path: Path, run: Path, change: Change, match: str | None
) -> None:
    path = tmp_path / "bad.h5"
    shutil.copyfile(run, path)
    shutil.copyfile(run, tmp_path / "other.h5")
    (tmp_path / "secret.bin").write_bytes(bytes(24_000))
    with h5py.File(path, "r+") as file:
        file["entry/model"] = "m = 1"
        file["entry/notes"] = 1
        change(file)
    if match is None:
        # not read to open it; held against its claims, it is
        open_recording(path)
        verify(path)
        return
    with pytest.raises(InputError, match=match) as caught:
        open_recording(path)
    assert "\n" not in str(caught.value)
    assert verify(path).faults == [str(caught.value)]


@pytest.mark.parametrize("file", ["/etc/passwd", "../secret.csv", "a/../../secret.csv"])
def test_a_sequence_reads_nothing_but_what_lies_by_it(tmp_path: Path, file: str) -> None:
    (tmp_path / "secret.csv").write_text("time_s,voltage_V\n0,0\n1,100\n")
    folder = tmp_path / "folder"
    folder.mkdir()
    path = folder / "sequence.toml"
    path.write_text(f'name = "x"\n[[segment]]\nkind = "csv"\nfile = "{file}"\n')
    with pytest.raises(InputError, match="leads out of the sequence's folder"):
        load_sequence(path)


@pytest.mark.skipif(not Path("/dev/zero").exists(), reason="there is no such device here")
def test_a_device_is_no_table() -> None:
    with pytest.raises(InputError, match="/dev/zero is a device, not a file"):
        TextFile(Path("/dev/zero"))


def test_a_killed_run_that_claims_more_than_it_has(tmp_path: Path) -> None:
    path, copy = tmp_path / "run.h5", tmp_path / "copy.h5"
    recorder = writer(path)
    recorder.append(Block(0, run_counts(2000)))
    for counts in recorder._counts:
        counts.resize((10**12,))
    recorder._flush_all(1.8e9)
    copy.write_bytes(path.read_bytes())
    recorder._let_go()
    # two chunks of 1024 are there, and 2000 samples are noted
    assert open_recording(copy).samples == 2000


@pytest.mark.parametrize("path", CORPUS, ids=lambda path: path.name)
def test_what_was_found_once_is_not_found_again(tmp_path: Path, path: Path) -> None:
    name = next(n for n in TARGETS if path.name.startswith(n.replace(" ", "-")))
    target = tmp_path / f"current{path.suffix}"
    shutil.copyfile(path, target)
    assert complaint(name, target) is None


@pytest.mark.parametrize("name", [n for n in TARGETS if n != "recordings"])
def test_damaged_files_are_a_sentence(tmp_path: Path, name: str) -> None:
    seeds = seeds_of(name)
    path = tmp_path / f"current{TARGETS[name].suffix}"
    refused = 0
    # a folder is indexed for each sidecar; the fuzzer has the rest
    for index in range(5 if name == "sidecars" else 30):
        path.write_bytes(input_of(name, seeds, 1, index))
        assert complaint(name, path) is None
        try:
            TARGETS[name].read(path)
        except InputError:
            refused += 1
    # what is damaged next to a recording spoils no reading of it
    assert refused > 5 or name == "sidecars"


@pytest.mark.deep
def test_damaged_recordings_are_a_sentence_and_no_crash(tmp_path: Path) -> None:
    assert fuzz("recordings", 1, 60, float("inf"), tmp_path) == (60, 0)
    assert {path.name for path in tmp_path.iterdir()} == {"current.h5", "errors.txt"}


def test_the_same_input_whenever_it_is_asked_for() -> None:
    seeds = [b"a = 1\nb = 2\n", bytes(range(100))]
    made = [input_of("MAT", seeds, 3, n) for n in range(20)]
    assert made == [input_of("MAT", seeds, 3, n) for n in range(20)]
    assert len(set(made)) > 15
