"""Wrong command lines: each is refused in one sentence, with code 2, and nothing is touched."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from tests.tools.command import dearig, names, refused

# {s} is the shelf of good and bad files
COMMANDS: dict[str, tuple[str, list[str]]] = {
    # campaigns, studies, watchers
    "no plan there": ("campaign no.toml --out o", ["no.toml", "is not there"]),
    "a sequence for a plan": (
        "campaign {s}/lobe.toml --out o",
        ["lobe.toml: lead_in_s is not a key"],
    ),
    "a recording for a plan": ("campaign {s}/run.h5 --out o", ["is a recording (HDF5)"]),
    "a folder for a plan": ("campaign {s} --out o", ["is a folder"]),
    "no runs to arm": ("campaign {s}/lobe.toml --out o --runs 0", ["--runs", "it must be"]),
    "no campaign to ask": ("campaign-queue no --pause", ["no has no campaign"]),
    "nothing to watch": ("watch no.h5", ["no.h5 is not there"]),
    "nothing to study": ("study {s}/lobe.toml --do identify --out o", ["lobe.toml is not one"]),
    "a study without its model": (
        "study {s} --do validate --out o",
        ["needs a model file", "--model"],
    ),
    "a study on nothing": ("study {s}/run.h5 --do identify --on x --out o", ["write local, or"]),
    # rigs and outputs
    "unknown rig": (
        "record {s}/lobe.toml --out o.h5 --rig foo",
        ["rig 'foo' is not known", "sim:7"],
    ),
    "a real card": (
        "record {s}/lobe.toml --out o.h5 --rig daqmx:Dev1",
        ["daqmx:Dev1", "no film is declared", "--rig-file"],
    ),
    "a seed for a real card": (
        "record {s}/lobe.toml --out o.h5 --rig daqmx:Dev1 --seed 5",
        ["'daqmx:Dev1' is not simulated", "leave them out (--seed)"],
    ),
    "a pace for a real card": (
        "record {s}/lobe.toml --out o.h5 --rig daqmx:Dev1 --paced",
        ["'daqmx:Dev1' is not simulated", "leave them out (--paced)"],
    ),
    "a seed that is none": (
        "record {s}/lobe.toml --out o.h5 --rig sim:x",
        ["'sim:x' is not a simulated rig", "sim:7"],
    ),
    "unknown sequence": (
        "record thesys --out o.h5",
        ["neither a file nor a preset", "mean thesis?"],
    ),
    "no sequence there": ("record no.toml --out o.h5", ["no.toml is not there"]),
    "a recording for a sequence": ("record {s}/run.h5 --out o.h5", ["is a recording (HDF5)"]),
    "a folder for a sequence": ("record {s} --out o.h5", ["is a folder"]),
    "a name too long": ("record " + "x" * 300 + " --out o.h5", ["neither a file nor a preset"]),
    "an output name too long": ("record thesis --out " + "x" * 300 + ".h5", ["File name too long"]),
    "a folder for the output": (
        "record thesis --out {s}",
        ["is a folder; give the name of a file"],
    ),
    "no folder for the output": ("record thesis --out no/o.h5", ["there is no folder no"]),
    "the output exists": (
        "record thesis --out {s}/run.h5",
        ["run.h5 exists already", "--force"],
    ),
    "the output is the sequence": (
        "record {s}/lobe.toml --out {s}/lobe.toml --force",
        ["lobe.toml is the input file"],
    ),
    "a table for a recording": (
        "record thesis --out o.csv",
        ["o.csv", "HDF5", "end its name in .h5"],
    ),
    "json where the recording goes": (
        "record thesis --out o.h5 --json o.h5",
        ["o.h5 is named for two outputs"],
    ),
    "json over a recording": (
        "info {s}/run.h5 --json {s}/run.h5 --force",
        ["the input file"],
    ),
    "json nowhere": ("validate {s}/actuator.toml {s}/run.h5 --json no/x.json", ["no folder no"]),
    "no rig file there": ("record thesis --out o.h5 --rig-file no.toml", ["rig file no.toml"]),
    # recordings
    "no recording there": ("info no.h5", ["no.h5 is not there"]),
    "a folder for a recording": ("info {s}", ["is a folder"]),
    "not HDF5": ("info {s}/text.h5", ["text.h5 is not an HDF5 file", "dearig import"]),
    "an empty recording": ("info {s}/empty.h5", ["empty.h5 is empty", "before it wrote anything"]),
    "HDF5 of others": ("info {s}/foreign.h5", ["is an HDF5 file but not a recording"]),
    "a truncated recording": ("info {s}/cut.h5", ["cut.h5 is truncated", "copied"]),
    "export of none": ("export no.h5 --to csv", ["no.h5 is not there"]),
    "export onto itself": (
        "export {s}/run.h5 --to csv --out {s}/run.h5 --force",
        ["the input file"],
    ),
    "export onto another": ("export {s}/film.h5 --to csv", ["film.csv exists already"]),
    "recover of none": ("recover {s}/text.h5", ["is not an HDF5 file"]),
    # import
    "nothing to import": ("import no.csv --out o.h5", ["no.csv is not there"]),
    "an unknown format": ("import {s}/rig.toml --out o.h5", [".csv, .xlsx, ", " and .tdms can"]),
    "import onto itself": ("import {s}/film.csv --out {s}/film.csv --force", ["the input file"]),
    "column nonsense": (
        "import {s}/film.csv --out o.h5 --column nonsense",
        ["--column nonsense is not of the form NAME=SOURCE", "voltage_kV=Voltage"],
    ),
    "column twice": (
        "import {s}/film.csv --out o.h5 --column stretch=a --column stretch=b",
        ["--column stretch is given twice"],
    ),
    "column unknown": (
        "import {s}/film.csv --out o.h5 --column foo=stretch",
        ["'foo' is not a column"],
    ),
    "column not there": (
        "import {s}/film.csv --out o.h5 --column stretch=strecth",
        ["there is no column 'strecth'", "did you mean 'stretch'?"],
    ),
    "negative gauge length": (
        "import {s}/film.csv --out o.h5 --gauge-length-mm -3",
        ["gauge length is -3.0", "above 0"],
    ),
    # identify
    "the model exists": ("identify {s}/run.h5 --out {s}/film.toml", ["film.toml exists already"]),
    "the model is the recording": (
        "identify {s}/run.h5 --out {s}/run.h5 --force",
        ["the input file"],
    ),
    "the same file twice": (
        "identify {s}/run.h5 {s}/run.h5 --out m.toml",
        ["run.h5 is given twice", "give each recording once"],
    ),
    "a copy": (
        "identify {s}/run.h5 {s}/copy.h5 --out m.toml",
        ["copy.h5 is a copy of", "leave one of them out"],
    ),
    "the same to fit and to validate": (
        "identify {s}/run.h5 --validate {s}/run.h5 --out m.toml",
        ["both to fit and to validate", "proves nothing"],
    ),
    "a copy to validate": (
        "identify {s}/run.h5 --validate {s}/copy.h5 --out m.toml",
        ["copy.h5, to validate, is a copy of", "proves nothing"],
    ),
    "another kind to validate": (
        "identify {s}/run.h5 --validate {s}/film.h5 --out m.toml",
        ["film.h5, to validate, is of kind film"],
    ),
    "two kinds": ("identify {s}/run.h5 {s}/film.h5 --out m.toml", ["cannot be used together"]),
    "two loads": (
        "identify {s}/run.h5 {s}/light.h5 --out m.toml",
        ["run.h5 and", "light.h5 are of different loads (mass 0.2 and 0.15", "--rig-file"],
    ),
    "two films": (
        "identify {s}/run.h5 {s}/thin.h5 --out m.toml",
        ["different films (thickness 0.001 and 0.0009"],
    ),
    "films held in two ways": (
        "identify {s}/film.h5 {s}/wide.h5 --out m.toml",
        ["films were held in different ways (equibiaxial, uniaxial): fit each way alone"],
    ),
    "branches in words": (
        "identify {s}/run.h5 --out m.toml --branches three",
        ["'three' is neither"],
    ),
    "branches half": ("identify {s}/run.h5 --out m.toml --branches 3-", ["such as 1-4"]),
    "branches squared": ("identify {s}/run.h5 --out m.toml --branches \u00b2", ["such as 1-4"]),
    "branches backwards": ("identify {s}/run.h5 --out m.toml --branches 4-1", ["write 1-4"]),
    "no branches": ("identify {s}/run.h5 --out m.toml --branches 0", ["from 1 to 8 branches"]),
    "too many branches": (
        "identify {s}/run.h5 --out m.toml --branches 1-999999999",
        ["from 1 to 8 branches"],
    ),
    "rest length below the film's": (
        "identify {s}/run.h5 --out m.toml --rest-length-mm 74",
        ["a rest length of 74 mm is not above the film's own 75 mm"],
    ),
    "rest length NaN": (
        "identify {s}/run.h5 --out m.toml --rest-length-mm nan",
        ["of nan mm is not"],
    ),
    "rest length of a film": (
        "identify {s}/film.h5 --out m.toml --rest-length-mm 82",
        ["these recordings are of films"],
    ),
    "three samples": ("identify {s}/short.h5 --out m.toml", ["short.h5: 3 samples are too few"]),
    "eight samples": (
        "identify {s}/few.h5 --out m.toml",
        ["8 samples cannot determine 11 parameters", "record longer or fit fewer branches"],
    ),
    "a sensor that stands still": (
        "identify {s}/still.h5 --out m.toml",
        ["still.h5: the signal never changes", "sensor was connected"],
    ),
    "a stress that stands still": ("identify {s}/still-film.h5 --out m.toml", ["never changes"]),
    "no monitor": ("identify {s}/few.h5 --drive monitor --out m.toml", ["no voltage monitor"]),
    # validate
    "no model there": ("validate no.toml {s}/run.h5", ["model file no.toml is not there"]),
    "files in the wrong order": (
        "validate {s}/run.h5 {s}/actuator.toml",
        ["run.h5 is a recording (HDF5) where a model file (TOML) should be"],
    ),
    "an empty model": ("validate {s}/empty.toml {s}/run.h5", ["it is not a model file"]),
    "film model, actuator recording": (
        "validate {s}/film.toml {s}/run.h5",
        ["run.h5 is of an actuator (voltage)", "the model is of a bare film"],
    ),
    "actuator model, film recording": (
        "validate {s}/actuator.toml {s}/film.h5",
        ["film.h5 is of a film (stretch)", "the model is of an actuator"],
    ),
    "validated twice": ("validate {s}/actuator.toml {s}/run.h5 {s}/run.h5", ["is given twice"]),
    "a report over the model": (
        "validate {s}/actuator.toml {s}/run.h5 --report {s}/actuator.toml --force",
        ["the input file"],
    ),
    # diagnose
    "nothing to diagnose": (
        "diagnose --json o.json",
        ["give recordings to diagnose, or a rig to record on with --rig"],
    ),
    "diagnosed twice": ("diagnose {s}/run.h5 {s}/run.h5", ["is given twice"]),
    "several after one --validate": (
        "diagnose {s}/run.h5 --validate {s}/film.h5 {s}/run.h5 --json o.json",
        ["run.h5 is given both to fit and to validate", "proves nothing"],
    ),
    "diagnosed and validated": (
        "diagnose {s}/run.h5 --validate {s}/run.h5",
        ["given both to fit and to validate", "proves nothing"],
    ),
    "validated on a copy, diagnosed": (
        "diagnose {s}/run.h5 --validate {s}/copy.h5 --report r.html",
        ["copy.h5, to validate, is a copy of", "run.h5"],
    ),
    "validated on another kind, diagnosed": (
        "diagnose {s}/run.h5 --validate {s}/film.h5",
        ["to validate, is of kind film", "of kind actuator"],
    ),
    "two loads, diagnosed": (
        "diagnose {s}/run.h5 {s}/light.h5",
        ["are of different loads", "mass 0.2 and 0.15"],
    ),
    "two films, diagnosed": (
        "diagnose {s}/run.h5 {s}/thin.h5",
        ["are of different films", "thickness"],
    ),
    "two kinds, diagnosed": ("diagnose {s}/run.h5 {s}/film.h5", ["cannot be used together"]),
    "a lobe only, diagnosed": (
        "diagnose {s}/run.h5 --model-out m.toml",
        ["run.h5: 1.09 s and", "too few to tell one effect from another", "several lobes"],
    ),
    "no branches, diagnosed": ("diagnose {s}/run.h5 --branches 0", ["0 branches", "from 1 to 8"]),
    "no monitor, diagnosed": ("diagnose {s}/few.h5 --drive monitor", ["no voltage monitor"]),
    "diagnosed into a full folder": ("diagnose --rig sim:7 --out {s}", ["is not empty", "--force"]),
    "diagnosed into a file": ("diagnose --rig sim:7 --out {s}/rig.toml", ["is a file; give a"]),
    "a report that is there": (
        "diagnose {s}/run.h5 --report {s}/rig.toml",
        ["rig.toml exists already", "--force"],
    ),
    "a model over a recording": (
        "diagnose {s}/run.h5 --model-out {s}/run.h5 --force",
        ["the input file"],
    ),
    "one name for report and model": (
        "diagnose {s}/run.h5 --report o.x --model-out o.x",
        ["named for two outputs"],
    ),
    # simulate
    "an unknown ending": ("simulate {s}/actuator.toml --drive thesis --out o.txt", [".h5", ".csv"]),
    "simulated over its drive": (
        "simulate {s}/actuator.toml --drive {s}/run.h5 --out {s}/run.h5 --force",
        ["the input file"],
    ),
    "a film under a voltage": (
        "simulate {s}/film.toml --drive thesis --out o.csv",
        ["the model is of a bare film"],
    ),
    "no drive there": ("simulate {s}/actuator.toml --drive no.h5 --out o.csv", ["is not there"]),
    # others
    "demo onto a file": ("demo --out {s}/rig.toml", ["is a file; give a folder"]),
    "demo into a full folder": ("demo --out {s}", ["is not empty", "--force"]),
    "a rig file onto another": ("rig-file {s}/rig.toml", ["exists already"]),
}


@pytest.mark.parametrize("case", COMMANDS)
def test_a_bad_command_is_refused(shelf: Path, bench: Path, case: str) -> None:
    line, words = COMMANDS[case]
    before = {p: p.stat().st_mtime_ns for p in shelf.iterdir()}
    refused(dearig(*(word.format(s=shelf) for word in line.split(" "))), *words)
    assert names(bench) == set()
    assert {p: p.stat().st_mtime_ns for p in shelf.iterdir()} == before


# ---------------------------------------------------------------- folders


@pytest.mark.parametrize(
    "line",
    [
        "record {s}/lobe.toml --out locked/o.h5",
        "import {s}/film.csv --out locked/o.h5",
        "identify {s}/run.h5 --out locked/m.toml",
        "simulate {s}/actuator.toml --drive {s}/run.h5 --out locked/o.csv",
        "export {s}/run.h5 --to csv --out locked/o.csv",
        "info {s}/run.h5 --json locked/o.json",
    ],
)
def test_a_folder_that_may_not_be_written_is_told_before_any_work(
    shelf: Path, bench: Path, monkeypatch: pytest.MonkeyPatch, line: str
) -> None:
    locked = bench / "locked"
    locked.mkdir()
    # asked for, not tried with chmod: an administrator may write everywhere
    allowed = os.access
    monkeypatch.setattr(
        "dearig.recording.files.os.access",
        lambda path, mode: Path(path).name != "locked" and allowed(path, mode),
    )
    answer = dearig(*(word.format(s=shelf) for word in line.split(" ")))
    refused(answer, "locked", "cannot be written", "choose another")
    assert names(locked) == set()


@pytest.mark.skipif(not Path("/dev/null").exists(), reason="there is no such device here")
def test_a_device_is_not_replaced_by_a_file(shelf: Path, bench: Path) -> None:
    answer = dearig("identify", shelf / "run.h5", "--out", "/dev/null", "--force")
    refused(answer, "/dev/null is not a regular file")
    assert not Path("/dev/null").is_file()
