"""Bad input to the command: one sentence that says what and where, code 2, and nothing touched."""

from __future__ import annotations

import os
import re
from collections.abc import Callable
from pathlib import Path

import h5py
import numpy as np
import pytest

from tests.tools.command import (
    LOBE,
    SLOW_RIG,
    Answer,
    dearig,
    done,
    film_csv,
    film_model,
    names,
    thesis_model,
    write,
)

#: Words that belong to the program and not to its operator.
FOREIGN = re.compile(
    r"Traceback|Error\b|Errno|pydantic|Input should|after validation|NoneType|\bdict\b"
    r"|list should|valid list|object at 0x|<class"
)


@pytest.fixture(scope="session")
def shelf(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with good and bad files of every kind; tests only read it."""
    folder = tmp_path_factory.mktemp("shelf")
    write(folder / "lobe.toml", LOBE)
    rig = write(folder / "rig.toml", SLOW_RIG)
    light = write(folder / "light.toml", f"{SLOW_RIG}[load]\nmass_g = 150.0\n")
    thin = write(folder / "thin.toml", f"{SLOW_RIG}[film]\nthickness_mm = 0.9\n")
    for name, file in (("run", rig), ("light", light), ("thin", thin)):
        done("record", folder / "lobe.toml", "--out", folder / f"{name}.h5", "--rig-file", file)
    (folder / "copy.h5").write_bytes((folder / "run.h5").read_bytes())
    thesis_model(folder / "actuator.toml")
    film_model(folder / "film.toml")
    done("import", film_csv(folder / "film.csv", 0.1, 1), "--out", folder / "film.h5")
    done("import", folder / "film.csv", "--out", folder / "wide.h5", "--kinematics", "equibiaxial")

    def imported(name: str, head: str, rows: np.ndarray) -> None:
        np.savetxt(folder / f"{name}.csv", rows, delimiter=",", header=head, comments="")
        done("import", folder / f"{name}.csv", "--out", folder / f"{name}.h5")

    actuator, film = "time_s,voltage_V,displacement_mm", "time_s,stretch,nominal_stress_kPa"
    t = np.arange(200.0) / 50.0
    imported("still", actuator, np.column_stack([t, 1e3 * (t > 2.0), np.ones_like(t)]))
    imported("short", actuator, np.column_stack([t, 1e3 * t, 0.1 * t**2])[:3])
    imported("few", actuator, np.column_stack([t, 1e3 * t, 0.1 * np.sin(9.0 * t)])[:8])
    imported("still-film", film, np.column_stack([t, 1.0 + t, np.full_like(t, 5.0)]))

    raw = (folder / "run.h5").read_bytes()
    (folder / "cut.h5").write_bytes(raw[: len(raw) // 2])
    (folder / "text.h5").write_text("not one of ours")
    (folder / "empty.h5").touch()
    (folder / "empty.toml").touch()
    with h5py.File(folder / "foreign.h5", "w") as file:
        file["x"] = [1.0]
    return folder


@pytest.fixture
def bench(shelf: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A working directory of its own."""
    monkeypatch.chdir(tmp_path)
    return tmp_path


def refused(answer: Answer, *words: str) -> str:
    """The one sentence of a command that refused."""
    assert answer.code == 2, (answer.code, answer.out, answer.err)
    assert answer.out == ""
    assert answer.err.startswith("dearig: ")
    assert answer.err.count("\n") == 1
    sentence = answer.err.removeprefix("dearig: ").strip()
    # the names of files are the operator's own words
    assert not FOREIGN.search(re.sub(r"\S*/\S*", "", sentence)), sentence
    for word in words:
        assert word in sentence, sentence
    return sentence


# ---------------------------------------------------------------- sequences

HEAD = 'name = "x"\n'


def segment(kind: str = "half_sine", **keys: object) -> str:
    given: dict[str, object] = {"half_sine": {"amplitude_kV": 3.0, "frequency_Hz": 1.0}}.get(
        kind, {}
    )
    lines = [f"{key} = {value}" for key, value in {**given, **keys}.items() if value != ""]
    return "\n".join(["[[segment]]", f'kind = "{kind}"', *lines, ""])


SEQUENCES = {
    "broken TOML": (
        f'{HEAD}[[segment]\nkind = "hold"\n',
        ["s.toml, line 2, column 10", "[[segment]"],
    ),
    "a text that is not closed": (
        f'{HEAD}[[segment]]\nkind = "hold\n',
        ["s.toml, line 3", "not closed by a quotation mark", 'kind = "hold'],
    ),
    "brackets without end": ("x = " + "[" * 9000, ["nested too deeply"]),
    "a number without end": ("x = " + "9" * 5000, ["thousands of digits"]),
    "empty file": ("", ["s.toml: name is missing"]),
    "no name": (segment(), ["name is missing", "title of the recording"]),
    "a number for a name": ("name = 3\n" + segment(), ["name = 3", "it takes a text"]),
    "no segment": (HEAD, ["there is no list of segments", "[[segment]]"]),
    "an empty list of segments": (f"{HEAD}segment = []\n", ["no list of segments"]),
    "single brackets": (f'{HEAD}[segment]\nkind = "hold"\n', ["in double brackets"]),
    "a segment that is a number": (f"{HEAD}segment = [3]\n", ["segment 1 is not a table"]),
    "unknown kind": (
        HEAD + segment("halfsine"),
        ['segment 1: kind = "halfsine" is not known', "half_sine, sine, triangle"],
    ),
    "no kind": (f"{HEAD}[[segment]]\nduration_s = 1.0\n", ["segment 1: kind is missing"]),
    "amplitude above the limit": (
        HEAD + segment(amplitude_kV=9.0),
        ["sequence 'x' is refused", "voltage reaches 9 kV", "8.5 kV is allowed", "rig file"],
    ),
    "amplitude far beyond": (
        HEAD + segment(amplitude_kV=500.0),
        ["voltage reaches 500 kV", "true field reaches 500 MV/m"],
    ),
    "amplitude beyond reason": (
        HEAD + segment(amplitude_kV=5e6),
        ["segment 1 (half_sine): amplitude_kV = 5000000.0", "from -1000 to 1000"],
    ),
    "negative voltage": (
        HEAD + segment(amplitude_kV=-3.0),
        ["negative voltage reaches 3 kV", "0 kV is allowed"],
    ),
    "negative frequency": (
        HEAD + segment(frequency_Hz=-1.0),
        ["segment 1 (half_sine): frequency_Hz = -1.0", "a number above 0"],
    ),
    "NaN": (HEAD + segment(frequency_Hz="nan"), ["frequency_Hz = NaN", "a number above 0"]),
    "infinity": (HEAD + segment(amplitude_kV="inf"), ["amplitude_kV = Infinity"]),
    "NaN in a list": (
        HEAD + segment("thesis", amplitudes_kV="[6.0, nan, 7.0, 7.0, 7.0]"),
        ["segment 1 (thesis): amplitudes_kV[2] = NaN", "from -1000 to 1000"],
    ),
    "a number for a list": (
        HEAD + segment("thesis", amplitudes_kV=6.0),
        ["amplitudes_kV = 6.0", "a list such as [6.0, 6.5], each a number"],
    ),
    "an empty list": (
        HEAD + segment("steps", levels_kV="[]", dwell_s=1.0),
        ["levels_kV = []", "a list such as"],
    ),
    "lists of two lengths": (
        HEAD + segment("thesis", amplitudes_kV="[6.0]"),
        ["1 amplitudes_kV and 5 frequencies_Hz"],
    ),
    "wrong unit": (
        f'{HEAD}[[segment]]\nkind = "half_sine"\namplitude_V = 3000.0\nfrequency_Hz = 1.0\n',
        ["amplitude_V is not a key", "given in kV, as amplitude_kV"],
    ),
    "unknown key": (HEAD + segment(colour=3), ["colour is not a key", "amplitude_kV"]),
    "a text for a number": (
        HEAD + segment(amplitude_kV='"three"'),
        ['amplitude_kV = "three"', "it takes a number"],
    ),
    "yes for a number": (HEAD + segment(amplitude_kV="true"), ["amplitude_kV = true"]),
    "negative lead-in": (
        "lead_in_s = -1.0\n" + HEAD + segment(),
        ["lead_in_s = -1.0", "from 0 to 3600"],
    ),
    "a billion seconds": (
        HEAD + segment("hold", duration_s=1e9),
        ["lasts 1e+09 s", "1e+12 samples at 1000 Hz", "at most 250,000,000", "shorten it"],
    ),
    "nearly no frequency": (HEAD + segment(frequency_Hz=1e-300), ["lasts 1e+300 s"]),
    "repeats absurdly large": (
        HEAD + segment(repeats=10**9),
        ["repeats = 1000000000", "from 1 to 10000"],
    ),
    "many times many repeats": (
        HEAD + segment(repeats=6000) + segment(repeats=6000),
        ["segment 2 (half_sine): repeats = 6000", "more than 10,000 segments"],
    ),
    "absurdly many periods": (
        HEAD + segment("thesis", periods=1_000_000),
        ["at most 250,000,000 can be played"],
    ),
    "shorter than a sample": (
        HEAD + segment(frequency_Hz=1e6),
        ["segment 1 (half_sine) lasts 1e-06 s", "less than two samples at 1000 Hz"],
    ),
    "faster than the clock": (
        HEAD + segment("sine", amplitude_kV=1.0, frequency_Hz=900.0, cycles=1800.0),
        ["segment 1 (sine) reaches 900 Hz", "play at most 500 Hz"],
    ),
    "a step at the start": (
        HEAD + segment("hold", voltage_kV=3.0, duration_s=1.0),
        ["segment 1 (hold) starts at 3 kV", "the lead-in ends at 0 kV", "put a ramp between"],
    ),
    "a step at the end": (
        HEAD + segment("ramp", to_kV=3.0, duration_s=1.0),
        ["ends at 3 kV", "put a ramp to 0"],
    ),
    "too steep": (
        HEAD + segment("steps", levels_kV="[5.0, 0.0]", dwell_s=1.0, rise_s=1e-6),
        ["slew reaches 5000 kV/s at 2 s", "1500 kV/s is allowed"],
    ),
    "a rise longer than its step": (
        HEAD + segment("steps", levels_kV="[5.0, 0.0]", dwell_s=1.0, rise_s=2.0),
        ["segment 1: steps: rise = 2.0 s is longer than dwell = 1.0 s"],
    ),
    "a waveform file with a zero byte in its name": (
        HEAD + segment("csv", file='"a\\u0000b.csv"'),
        ["segment 1", "cannot be read"],
    ),
    "a folder for a waveform": (HEAD + segment("csv", file='"."'), ["Is a directory"]),
    "no waveform there": (
        HEAD + segment("csv", file='"no.csv"'),
        ["s.toml: segment 1", "no.csv cannot be read: No such file or directory"],
    ),
}


@pytest.mark.parametrize("case", SEQUENCES)
def test_a_bad_sequence_is_refused(bench: Path, case: str) -> None:
    text, words = SEQUENCES[case]
    write(bench / "s.toml", text)
    refused(dearig("record", "s.toml", "--out", "out.h5"), *words)
    assert names(bench) == {"s.toml"}


WAVEFORMS = {
    "empty": ("", ["w.csv is empty"]),
    "no data": ("time_s,voltage_kV\n", ["a line of names and no data"]),
    "one line": ("time_s,voltage_kV\n0,0\n", ["one line of data", "at least 2"]),
    "missing column": ("time_s,volts\n0,0\n1,0\n", ["the columns time_s, volts", "voltage_kV"]),
    "wrong unit": ("time_s,voltage_mV\n0,0\n1,0\n", ["voltage_mV", "voltage_kV or voltage_V"]),
    "NaN": ("time_s,voltage_kV\n0,0\n1,nan\n2,0\n", ["line 3, column 'voltage_kV'", "'nan'"]),
    "text": ("time_s,voltage_kV\n0,0\n1,high\n", ["line 3", "'high' is not a number"]),
    "a gap": ("time_s,voltage_kV\n0,0\n1,\n2,0\n", ["line 3", "there is no value"]),
    "time goes back": (
        "time_s,voltage_kV\n0,0\n1,1\n0.5,0\n",
        ["w.csv, line 4: time goes back, from 1 s to 0.5 s"],
    ),
    "time stands still": (
        "time_s,voltage_kV\n0,0\n1,1\n1,0\n",
        ["w.csv, line 4: time stands still", "a step takes two lines"],
    ),
    "a step at the start": (
        "time_s,voltage_kV\n0,1\n1,0\n",
        ["segment 1 (csv) starts at 1 kV", "the lead-in ends at 0 kV"],
    ),
    "a step at the end": ("time_s,voltage_kV\n0,0\n1,1\n", ["(csv) ends at 1 kV"]),
    "a million kilovolts": ("time_s,voltage_kV\n0,0\n1,1e6\n2,0\n", ["reaches 1e+06 kV"]),
    "ages": ("time_s,voltage_kV\n0,0\n1,1\n1e300,0\n", ["lasts 1e+300 s"]),
    "no text": ("time_s\0voltage_kV\n", ["is not a text file"]),
}


@pytest.mark.parametrize("case", WAVEFORMS)
def test_a_bad_waveform_is_refused(bench: Path, case: str) -> None:
    text, words = WAVEFORMS[case]
    write(bench / "w.csv", text)
    write(bench / "s.toml", HEAD + segment("csv", file='"w.csv"'))
    refused(dearig("record", "s.toml", "--out", "out.h5"), *words)
    assert names(bench) == {"s.toml", "w.csv"}


# ---------------------------------------------------------------- everything else

# {s} is the shelf of good and bad files
COMMANDS: dict[str, tuple[str, list[str]]] = {
    # rigs and outputs
    "unknown rig": (
        "record {s}/lobe.toml --out o.h5 --rig foo",
        ["rig 'foo' is not known", "sim:7"],
    ),
    "a real card": (
        "record {s}/lobe.toml --out o.h5 --rig daqmx:Dev1",
        ["daqmx:Dev1", "no film is declared", "--rig-file"],
    ),
    "a seed that is none": (
        "record {s}/lobe.toml --out o.h5 --rig sim:x",
        ["'sim:x' is not a simulated rig", "sim:7"],
    ),
    "unknown sequence": (
        "record thesys --out o.h5",
        ["neither a file nor a preset", "mean thesis?"],
    ),
    "no sequence there": ("record no.toml --out o.h5", ["no.toml cannot be read: No such file"]),
    "a recording for a sequence": ("record {s}/run.h5 --out o.h5", ["is a recording (HDF5)"]),
    "a folder for a sequence": ("record {s} --out o.h5", ["Is a directory"]),
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
    "an empty recording": ("info {s}/empty.h5", ["empty.h5 is not an HDF5 file"]),
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
    "an unknown format": ("import {s}/rig.toml --out o.h5", [".csv, .mat, .parquet and .tdms"]),
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
        ["run.h5 is named twice", "counts once"],
    ),
    "a copy": (
        "identify {s}/run.h5 {s}/copy.h5 --out m.toml",
        ["copy.h5 is a copy of", "counts once"],
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
        ["films held in different ways (equibiaxial, uniaxial)"],
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
    "no model there": ("validate no.toml {s}/run.h5", ["model file no.toml cannot be read"]),
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
    "validated twice": ("validate {s}/actuator.toml {s}/run.h5 {s}/run.h5", ["is named twice"]),
    "a report over the model": (
        "validate {s}/actuator.toml {s}/run.h5 --report {s}/actuator.toml --force",
        ["the input file"],
    ),
    # diagnose
    "nothing to diagnose": (
        "diagnose --json o.json",
        ["give recordings to diagnose, or a rig to record on with --rig"],
    ),
    "diagnosed twice": ("diagnose {s}/run.h5 {s}/run.h5", ["is named twice"]),
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


IMPORTS = {
    "empty": ("", ["in.csv is empty"]),
    "no data": ("time_s,voltage_V,displacement_mm\n", ["a line of names and no data"]),
    "no names": ("0,0,0\n1,1,1\n", ["numbers where the names of the columns should be"]),
    "missing column": ("time_s,voltage_V\n0,0\n1,1\n", ["no column for displacement"]),
    "wrong unit": (
        "time_s,voltage_V,displacement_nm\n0,0,0\n1,1,1\n",
        ["'displacement_nm'", "displacement may be in mm or um or m"],
    ),
    "NaN": (
        "time_s,voltage_V,displacement_mm\n0,0,0\n1,nan,1\n",
        ["line 3, column 'voltage_V'", "not a finite number"],
    ),
    "text": (
        "time_s,voltage_V,displacement_mm\n0,0,0\n1,high,1\n",
        ["line 3, column 'voltage_V': 'high' is not a number"],
    ),
    "time goes back": (
        "time_s,voltage_V,displacement_mm\n0,0,0\n1,0,1\n0.5,0,1\n",
        ["line 4, column 'time_s': time goes back"],
    ),
    "time stands still": (
        "time_s,voltage_V,displacement_mm\n0,0,0\n1,0,1\n1,0,1\n",
        ["line 4, column 'time_s': time stands still"],
    ),
}


@pytest.mark.parametrize("case", IMPORTS)
def test_bad_measured_data_are_refused(bench: Path, case: str) -> None:
    text, words = IMPORTS[case]
    write(bench / "in.csv", text)
    refused(dearig("import", "in.csv", "--out", "out.h5"), *words)
    assert names(bench) == {"in.csv"}


# ---------------------------------------------------------------- model files


def _cut(word: str, instead: str) -> Callable[[str], str]:
    def change(text: str) -> str:
        assert word in text
        return text.replace(word, instead, 1)

    return change


MODELS: dict[str, tuple[Callable[[str], str], list[str]]] = {
    "newer": (
        _cut("dearig-model/1", "dearig-model/9"),
        ["m.toml has the format dearig-model/9", "reads dearig-model/1", "a newer dearig"],
    ),
    "not a model": (_cut("format", "form"), ['no line format = "dearig-model/1"']),
    "broken": (_cut("[film]", "[film"), ["m.toml, line ", "in `[film`"]),
    "key missing": (_cut("mass_kg = 0.2\n", ""), ["load.mass_kg is missing", "a number from 0"]),
    "table missing": (
        lambda text: re.sub(r"\[film\].*(?=\[load\])", "", text, flags=re.DOTALL),
        ["[film] and [load] go together"],
    ),
    "wrong unit": (_cut("modulus_Pa", "modulus_kPa"), ["modulus_kPa is not a key", "modulus_Pa"]),
    "wrong table": (_cut("[film]", "[flim]"), ["flim is not a key", "did you mean film?"]),
    "negative": (_cut("mass_kg = 0.2", "mass_kg = -1.0"), ["load.mass_kg = -1.0", "from 0"]),
    "text": (_cut("mass_kg = 0.2", 'mass_kg = "a"'), ['load.mass_kg = "a"', "a number from 0"]),
    "NaN": (_cut("mass_kg = 0.2", "mass_kg = nan"), ["load.mass_kg = NaN"]),
    "no limit": (_cut("limit = ", "limit = -"), ["limit = -", "a number above 0"]),
    "unknown spring": (_cut('"gent"', '"steel"'), ['"steel"', '"gent" or "arruda-boyce"']),
    "unknown kinematics": (_cut('"constrained-width"', '"loose"'), ['kinematics = "loose"']),
    "branch is a number": (
        lambda text: re.sub(r"branch = \[.*?\n\]\n", "branch = 3\n", text, flags=re.DOTALL),
        ["branch = 3 is no list of tables", "[[branch]]"],
    ),
    "film is a number": (
        lambda text: "film = 3\n" + re.sub(r"\[film\].*(?=\[load\])", "", text, flags=re.DOTALL),
        ["film = 3 is not a table", "[film]"],
    ),
    "unknown effect": (
        _cut("[film]", '[[effect]]\nname = "magic"\nvalues = {}\n[film]'),
        ["effect 'magic' is not one of"],
    ),
    "nothing to carry the load": (
        _cut("modulus_Pa = 45772.0", "modulus_Pa = 0.0"),
        ["m.toml: no rest state", "cannot carry the load"],
    ),
    "rest shorter than the film": (
        _cut("mass_kg = 0.2", "mass_kg = 0.2\nrest_length_m = 0.05"),
        ["m.toml", "rest stretch of 0.6667", "above 1"],
    ),
}


@pytest.mark.parametrize("case", MODELS)
def test_a_bad_model_file_is_refused(shelf: Path, bench: Path, case: str) -> None:
    change, words = MODELS[case]
    write(bench / "m.toml", change((shelf / "actuator.toml").read_text(encoding="utf-8")))
    refused(dearig("validate", "m.toml", shelf / "run.h5"), *words)
    refused(dearig("simulate", "m.toml", "--drive", shelf / "run.h5", "--out", "o.csv"), *words)
    assert names(bench) == {"m.toml"}


@pytest.mark.parametrize("history", ["train = 3", "train = [3]", "train = [{sha256 = 3}]"])
def test_a_history_that_somebody_edited_harms_nothing(
    shelf: Path, bench: Path, history: str
) -> None:
    text = (shelf / "actuator.toml").read_text(encoding="utf-8")
    write(bench / "m.toml", f"{text}\n[history]\n{history}\n")
    (row,) = done("validate", "m.toml", shelf / "run.h5", "--json", "-").json["recordings"]
    assert row["role"] == "validation"


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
