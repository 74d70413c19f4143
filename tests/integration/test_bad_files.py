"""Files with mistakes: a command refuses each in one sentence, with code 2, and writes nothing."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path

import pytest

from tests.tools.command import dearig, done, names, refused, write

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
        ["voltage reaches 500 kV", "true field reaches"],
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
        ["lasts 1e+09 s", "1e+12 samples at 1000 Hz", "at most 1,000,000,000", "shorten it"],
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
        ["at most 1,000,000,000 can be played"],
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
    "a folder for a waveform": (HEAD + segment("csv", file='"."'), ["is a folder"]),
    "no waveform there": (
        HEAD + segment("csv", file='"no.csv"'),
        ["s.toml: segment 1", "no.csv is not there"],
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


# ---------------------------------------------------------------- measured data

IMPORTS = {
    "empty": ("", ["in.csv is empty"]),
    "no data": ("time_s,voltage_V,displacement_mm\n", ["a line of names and no data"]),
    "no names": ("0,0,0\n1,1,1\n", ["the names #1, #2, #3 do not say", "--column time_s=COLUMN"]),
    "missing column": ("time_s,voltage_V\n0,0\n1,1\n", ["no column for displacement"]),
    "wrong unit": (
        "time_s,voltage_V,displacement_pm\n0,0,0\n1,1,1\n",
        ["'displacement_pm' names no unit", "--column displacement_UNIT=displacement_pm"],
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
        ["branch = 3 is not a list of tables", "[[branch]]"],
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
