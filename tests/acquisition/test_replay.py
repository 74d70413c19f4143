"""A run repeated from its recording: the same counts, to the last bit."""

from __future__ import annotations

import shutil
from pathlib import Path

import h5py
import numpy as np
import pytest

from dearig.acquisition.replay import original_of
from dearig.config.rigfile import load_rig_file
from dearig.recording import RunMetadata, open_recording, save_recording
from tests.tools.command import LOBE, SLOW_RIG, dearig, done, refused, thesis_model, write
from tests.tools.daqmx import served
from tests.tools.recordings import Clock


def counts(path: Path) -> dict[str, np.ndarray]:
    with h5py.File(path) as file:
        data = file["entry/data"]
        return {name: data[name][()] for name in data if name.endswith("_counts")}


def same(first: Path, second: Path) -> bool:
    one, two = counts(first), counts(second)
    assert one.keys() == two.keys()
    assert len(one) >= 3
    return all(np.array_equal(one[name], two[name]) for name in one)


@pytest.mark.parametrize("rig", ["sim", "sim:7"])
def test_the_same_seed_gives_the_same_bytes(tmp_path: Path, rig: str) -> None:
    first, again, other = (tmp_path / f"{n}.h5" for n in ("first", "again", "other"))
    files = write(tmp_path / "lobe.toml", LOBE), write(tmp_path / "rig.toml", SLOW_RIG)
    done("record", files[0], "--rig", rig, "--rig-file", files[1], "--seed", "5", "--out", first)
    for path in files:
        path.unlink()
    done("record", "--like", first, "--rig", "sim", "--out", again)
    assert same(first, again)
    made = [open_recording(path) for path in (first, again)]
    for what in ("rig", "seed", "configuration"):
        assert made[0].provenance[what] == made[1].provenance[what]
    assert made[0].sequence_toml == made[1].sequence_toml
    done("record", "--like", first, "--seed", "6", "--out", other)
    assert not same(first, other)


def test_a_run_of_a_model_file_needs_it_again(tmp_path: Path) -> None:
    first, again = tmp_path / "first.h5", tmp_path / "again.h5"
    rig = "[film]\nthickness_mm = 2.0\n" + SLOW_RIG
    lobe, rig_file = write(tmp_path / "lobe.toml", LOBE), write(tmp_path / "rig.toml", rig)
    model = thesis_model(tmp_path / "model.toml")
    record = ("record", lobe, "--rig-file", rig_file, "--model", model, "--out", first)
    assert dearig(*record).code == 0
    without = dearig("record", "--like", first, "--out", again)
    refused(without, "give the model file too (--model)")
    done("record", "--like", first, "--model", model, "--out", again)
    assert same(first, again)
    longer = write(
        tmp_path / "longer.toml", model.read_text().replace("length_m = 0.075", "length_m = 0.09")
    )
    other = dearig("record", "--like", first, "--model", longer, "--out", tmp_path / "no.h5")
    refused(other, "give the model of that run, or none (--model")
    hidden = tmp_path / "hidden.h5"
    done("record", lobe, "--rig", "sim:7", "--rig-file", rig_file, "--out", hidden)
    other = dearig("record", "--like", hidden, "--model", model, "--out", tmp_path / "no.h5")
    refused(other, "was recorded on sim:7, which has a film of its own", "leave --model out")


def test_what_cannot_be_repeated(tmp_path: Path) -> None:
    time = np.arange(10.0)
    values = {"time": time, "stretch": 1 + time, "nominal_stress": time}
    film = save_recording(tmp_path / "film.h5", "film", values, RunMetadata(title="x"), now=Clock())
    run, bad, out = (tmp_path / f"{n}.h5" for n in ("run", "bad", "out"))
    lobe, rig = write(tmp_path / "lobe.toml", LOBE), write(tmp_path / "rig.toml", SLOW_RIG)
    done("record", lobe, "--rig-file", rig, "--out", run)
    shutil.copyfile(run, bad)
    with h5py.File(bad, "r+") as file:
        del file["entry/provenance/configuration"]
        file["entry/provenance/configuration"] = "[card]\nspeed = 3\n"
    for line, words in (
        (("--like", film), "holds no sequence: only a run"),
        (("--like", run, lobe), "give one of them"),
        ((), "give a sequence to play, or a recording"),
        (("--like", run, "--rig-file", rig), "has its own rig file"),
        (("--like", bad), "is not of this version: card.speed"),
        (("--like", tmp_path / "none.h5"), "none.h5 is not there"),
    ):
        answer = dearig("record", *line, "--out", out)
        assert answer.code == 2, answer.err
        assert words in answer.err
        assert not out.exists()
    assert "is the input file" in dearig("record", "--like", run, "--out", run, "--force").err


OTHER_RIG = """\
[film]
name = "A7"
[amplifier]
gain_V_per_V = 500.0
[limits]
voltage_max_kV = 4.9
"""
CARD = '[film]\nname = "B2"\n[card]\ni_have_no_watchdog = true\n[limits]\nvoltage_max_kV = {}\n'


@pytest.mark.parametrize("given", ["rig-file", "lower-limit", "none"])
def test_on_a_card_only_the_sequence_of_a_recording_is_repeated(tmp_path: Path, given: str) -> None:
    """The recording's amplifier has half the gain, and its limits are wider."""
    run, out = tmp_path / "run.h5", tmp_path / "again.h5"
    other = write(tmp_path / "other.toml", OTHER_RIG)
    limit = {"rig-file": 7.5, "lower-limit": 1.0, "none": 7.5}[given]
    ours = write(tmp_path / "ours.toml", CARD.format(limit))
    done("record", write(tmp_path / "lobe.toml", LOBE), "--rig-file", other, "--out", run)
    asked = () if given == "none" else ("--rig-file", ours)
    with served() as card:
        address = f"daqmx:Dev1@127.0.0.1:{card.server.port}"
        answer = dearig("record", "--like", run, "--rig", address, *asked, "--out", out)
        peaks = [abs(change.wire) for change in card.device.history()]
    if given == "none":
        refused(answer, "only the sequence of", "give the rig's own file (--rig-file)")
    elif given == "lower-limit":
        refused(answer, "limits of the rig file")
    if given != "rig-file":
        assert max(peaks) == 0.0
        assert not out.exists()
        return
    assert answer.code == 0, answer.err
    said = answer.out
    assert f"scaling and limits are those of rig file {ours}: amplifier 1000 V/V" in said
    assert "amplifier.gain_V_per_V: 500 in the recording, 1000 here" in said
    assert "limits.voltage_max_kV: 4.9 in the recording, 7.5 here" in said
    made, before = open_recording(out), open_recording(run)
    assert made.provenance["configuration"] == ours.read_text()
    assert made.provenance["configuration_from"] == f"rig file {ours}"
    assert made.provenance["repeats"] == str(run)
    # the same voltage at the film, whatever the amplifier's gain is
    assert made.sequence_toml == before.sequence_toml
    assert made.voltage_command.max() == pytest.approx(before.voltage_command.max(), abs=1.0)


def test_seed_zero_is_a_seed(tmp_path: Path) -> None:
    """It is not taken for none: the noise of the original has another seed."""
    first, zero, again = (tmp_path / f"{n}.h5" for n in ("first", "zero", "again"))
    lobe, rig = write(tmp_path / "lobe.toml", LOBE), write(tmp_path / "rig.toml", SLOW_RIG)
    done("record", lobe, "--rig-file", rig, "--seed", "5", "--out", first)
    done("record", "--like", first, "--seed", "0", "--out", zero)
    done("record", "--like", first, "--out", again)
    assert not same(first, zero)
    assert same(first, again)
    assert [open_recording(p).provenance["seed"] for p in (zero, again)] == [0, 5]
    assert open_recording(again).provenance["configuration_from"] == f"the rig file in {first}"
    assert open_recording(first).provenance["configuration_from"] == f"rig file {rig}"


def test_a_recording_without_a_rig_file_is_compared_with_the_rig_of_the_thesis(
    tmp_path: Path,
) -> None:
    run, other = tmp_path / "run.h5", write(tmp_path / "other.toml", OTHER_RIG)
    done("record", write(tmp_path / "lobe.toml", LOBE), "--out", run)
    differing = original_of(run).differences("daqmx:Dev1", other, load_rig_file(other))
    assert "another rig file: none, which is the thesis's rig; what differs:" in differing[0]
    assert "amplifier.gain_V_per_V: 1000 in the recording, 500 here" in differing
    assert "limits.voltage_max_kV: 8.5 in the recording, 4.9 here" in differing
