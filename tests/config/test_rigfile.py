"""The rig file: what it gives, and what it says about every kind of mistake."""

import re

import numpy as np
import pytest
from pydantic import ValidationError

from dearig.config.rigfile import RigFile, load_rig_file, write_default
from dearig.config.rigform import faults_of
from dearig.drivers.contract.rig import foreseen
from dearig.drivers.gate import admit
from dearig.drivers.settings import LaserSettings, RigSettings, ThermometerSettings
from dearig.errors import InputError
from dearig.model.film.material import THESIS_FILM, THESIS_LOAD


@pytest.fixture
def rig_file(tmp_path):
    """Write a rig file and give its path."""

    def write(text, name="rig.toml"):
        path = tmp_path / name
        path.write_text(text, encoding="utf-8")
        return path

    return write


def test_without_a_file_it_is_the_rig_of_the_thesis():
    rig = load_rig_file(None)
    assert rig.as_film() == THESIS_FILM
    assert rig.as_load() == THESIS_LOAD
    limits = rig.gate_limits()
    assert (limits.voltage_min, limits.voltage_max) == (0.0, 8500.0)
    assert limits.slew == pytest.approx(1.5e6)
    assert limits.field == pytest.approx(1.5e7)
    assert isinstance(rig, RigSettings)


def test_default_file_says_what_the_defaults_are(tmp_path):
    path = tmp_path / "rig.toml"
    write_default(path)
    assert load_rig_file(path) == RigFile()
    text = path.read_text(encoding="utf-8")
    assert "# highest voltage at the film (a number above 0, at most 100)" in text
    assert "# [thermometer]" in text
    with pytest.raises(InputError, match="exists already; choose another name"):
        write_default(path)


def test_every_commented_key_of_the_default_file_is_one(tmp_path, rig_file):
    path = tmp_path / "default.toml"
    write_default(path)
    lines = path.read_text(encoding="utf-8").splitlines()
    start = lines.index("# [thermometer]")
    end = start + lines[start:].index("")
    keys = [line for line in lines[start:end] if " = " in line or "[" in line]
    rig = load_rig_file(rig_file("\n".join(line.removeprefix("# ") for line in keys)))
    assert rig.thermometer == ThermometerSettings()


def test_values_reach_the_model_in_si_units(rig_file):
    rig = load_rig_file(
        rig_file(
            "[film]\nlength_mm = 50\nthickness_mm = 0.5\nkinematics = 'uniaxial'\n"
            "[load]\nmass_g = 100\nrest_length_mm = 55.5\n"
            "[limits]\nvoltage_min_kV = -2\nramp_down_s = 1\n"
        )
    )
    film, load = rig.as_film(), rig.as_load()
    assert (film.length, film.thickness, film.kinematics) == (0.05, 0.0005, "uniaxial")
    assert (load.mass, load.rest_length) == (pytest.approx(0.1), pytest.approx(0.0555))
    assert rig.gate_limits().voltage_min == -2000.0


MISTAKES = [
    ("[film]\nlength_m = 0.075", r"film\.length_m is not a key: .* in mm, as film\.length_mm"),
    ("[film]\nlength = 75", r"film\.length is not a key: .* in mm, as film\.length_mm"),
    ("[amplifier]\nrange_kv = 10", r"amplifier\.range_kv is not a key: .* as amplifier\.range_kV"),
    ("[limits]\nslew_max_V_per_us = 1", r"in kV per s, as limits\.slew_max_kV_per_s"),
    ("[film]\nlenght_mm = 75", r"film\.lenght_mm is not a key; did you mean film\.length_mm\?"),
    ("[lazer]\nnoise_um = 1", r"lazer is not a table; did you mean laser\?"),
    ("[zzz]\na = 1", r"zzz is not a table; a rig file takes amplifier, laser"),
    ("[load]\nqqq = 1", r"load\.qqq is not a key; \[load\] takes mass_g, mass_g_uncertainty, "),
    ("length_mm = 75", r"length_mm is not a key here: it belongs in \[film\]"),
    ("[load]\nlength_mm = 75", r"load\.length_mm is not a key here: it belongs in \[film\]"),
    (
        "[film]\nlength_mm = -75",
        r"film\.length_mm = -75 is not allowed, but a number above 0, at most 10000 \(free length",
    ),
    ("[film]\nlength_mm = '75'", r'film\.length_mm = "75" is not allowed, but a number'),
    ("[film]\nwidth_mm = 1e-320", r"film\.width_mm = .* it is too small to be meant"),
    ("[card]\ntimebase_MHz = 1e-320", r"card\.timebase_MHz = .* it is too small to be meant"),
    ("[film]\nlength_mm = nan", r"film\.length_mm = NaN is not allowed"),
    ("[film]\nlength_mm = true", r"film\.length_mm = true is not allowed"),
    ("[card]\nai_buffer_samples = 1.5", r"= 1\.5 is not allowed, but a whole number from 1000"),
    (
        "[card]\naverage = 100",
        r"the scan, in us, = 80 is more than 10: one sample interval at card\.sample_rate_Hz x "
        r"card\.average \(1000 x 100\)",
    ),
    (
        "[card]\nsample_rate_Hz = 10000.0\naverage = 40\nfirst_convert_us = 0.0\n"
        "convert_interval_us = 0.8",
        r"card\.sample_rate_Hz x card\.average \(10000 x 40\) = 400000 is more than 333333: what "
        r"the card can do",
    ),
    (
        "[card]\naverage = 0",
        r"card\.average = 0 is not allowed, but a whole number from 1 to 65536",
    ),
    ("[card]\nao_command = 'dac'", r'ao_command = "dac" is not allowed, but a text such as ao0'),
    ("[film]\nkinematics = 'free'", r'"free" is not allowed, but "constrained-width" or "uni'),
    ("[laser]\naveraging = 15", r"laser\.averaging = 15 is not allowed: .* offers 1, 4, 16, 64"),
    ("[laser]\naveraging = 32", r"laser\.averaging = 32 is not allowed"),
    ("[laser]\ndirection = 0", r"laser\.direction = 0 is not allowed, but 1 or -1"),
    ("film = 3", r"film = 3 is not a table: write \[film\]"),
    ("[limits]\nvoltage_max_kV = 12", r"voltage_max_kV = 12 is more than 10: the amplifier's"),
    ("[limits]\nvoltage_min_kV = -12", r"voltage_min_kV, without its sign, = 12 is more than 10"),
    (
        "[limits]\nslew_max_kV_per_s = 2000\n[amplifier]\nslew_V_per_us = 1.0",
        r"slew_max_kV_per_s = 2000 is more than 1000: the amplifier's own slew rate",
    ),
    ("[amplifier]\ngain_V_per_V = 500", r"voltage_max_kV = 8\.5 is more than 5: what card\.ao_r"),
    ("[amplifier]\nmonitor_V_per_kV = 2", r"= 8\.5 is more than 5: what card\.range_voltage_mon"),
    ("[laser]\nmm_per_V = 1", r"laser\.range_mm = 40 is more than 10: what laser\.mm_per_V"),
    ("[laser]\nrest_position_mm = -41", r"rest_position_mm, without its sign, = 41 is more than"),
    ("[card]\nai_displacement = 'ai0'", r"input ai0 is wired to two channels, one is allowed"),
    ("[card]\nsample_rate_Hz = 20000", r"the scan, in us, = 80 is more than 50: one sample"),
    ("[card]\nconvert_interval_us = 0.5", r"in kHz, = 2000 is more than 1000: card\.ai_rate_max"),
    ("[load]\nrest_length_mm = 70", r"rest_length_mm = 70 is not above film\.length_mm = 75"),
    ("[load]\nrest_length_mm = 80\nmass_g = 0", r"needs a load\.mass_g above 0"),
    ("[film]\na = 1\nb = 2", r"film\.a is not a key; .* \(1 more fault after that\)"),
    ("[film]\nlength_mm = \n", r"line 2, column 13: Invalid value in `length_mm =`"),
    ("[film\nlength_mm = 1", r"line 1, column 6: Expected '\]' .* in `\[film`"),
    ('name = "', r"line 1: Unterminated string at the end of the file"),
]


@pytest.mark.parametrize(("text", "message"), MISTAKES, ids=[text for text, _ in MISTAKES])
def test_a_mistake_gets_one_sentence_with_file_key_value_and_what_is_allowed(
    rig_file, text, message
):
    with pytest.raises(InputError, match=message) as caught:
        load_rig_file(rig_file(text))
    said = str(caught.value)
    assert "rig.toml" in said
    assert "\n" not in said
    assert caught.value.exit_code == 2


def test_files_that_cannot_be_read(tmp_path):
    with pytest.raises(InputError, match=r"missing\.toml is not there"):
        load_rig_file(tmp_path / "missing.toml")
    with pytest.raises(InputError, match="is a folder"):
        load_rig_file(tmp_path)
    latin = tmp_path / "latin.toml"
    latin.write_bytes(b"[film]\n# L\xe4nge\n")
    with pytest.raises(InputError, match=r"latin\.toml, line 2: not UTF-8 text"):
        load_rig_file(latin)
    with pytest.raises(InputError, match="cannot be written"):
        write_default(tmp_path / "no folder" / "rig.toml")


def test_settings_do_not_change():
    with pytest.raises(ValidationError, match="frozen"):
        RigSettings().laser.averaging = 4


def test_channels_carry_scaling_and_timing():
    settings = RigSettings(
        laser=LaserSettings(averaging=64, sampling_us=10.0, direction=-1),
        thermometer=ThermometerSettings(),
    )
    channels = settings.channels(dict.fromkeys(settings.channel_names, (0.0, 3e-4)))
    by_name = {channel.name: channel for channel in channels}
    assert by_name["voltage_monitor"].scaling.gain == 1000.0
    assert by_name["current_monitor"].scaling.gain == pytest.approx(4e-3)
    assert by_name["displacement"].scaling.gain == pytest.approx(-4e-3)
    assert by_name["displacement"].delay == pytest.approx(320e-6)
    # the laser samples every 10 us, whenever that is
    assert by_name["displacement"].delay_error == pytest.approx(5e-6)
    assert by_name["voltage_monitor"].delay_error == 0.0
    assert by_name["temperature"].scaling.offset == 273.15
    skews = [channel.skew * 1e6 for channel in channels]
    assert skews == pytest.approx([0.0, 50.0, 60.0, 70.0, 80.0])


@pytest.mark.parametrize("averaging", [4**i for i in range(10)])
def test_averaging_takes_the_powers_that_the_controller_offers(averaging):
    assert LaserSettings(averaging=averaging).averaging == averaging


def thesis_lobes(amplitudes, frequencies):
    time = np.arange(0.0, 5.0, 1e-3)
    for peak, frequency in zip(amplitudes, frequencies, strict=True):
        lobe = peak * 1e3 * np.sin(np.pi * frequency * time[time < 1.0 / frequency])
        yield np.append(lobe, 0.0)


def rounded_steps():
    rise = 4000.0 * (1.0 - np.cos(np.pi * np.arange(11) / 10.0))
    yield np.concatenate((rise, np.full(50, 8000.0), rise[::-1]))


@pytest.mark.parametrize(
    "waveform",
    [
        *thesis_lobes([6.0, 6.5, 7.0, 7.5, 8.0], [0.2, 0.4, 0.6, 0.8, 1.0]),
        *thesis_lobes([8.0] * 5, [0.2, 0.4, 0.6, 0.8, 1.0]),
        *rounded_steps(),
    ],
)
def test_default_limits_let_the_thesis_and_fast_steps_pass(waveform):
    # a film of 1 mm at the greatest stretch of the thesis, 1.25
    admit(waveform, 1000.0, RigFile().gate_limits(), foreseen(waveform.size))


def test_declared_channels_of_the_default_file_are_commented_and_valid(tmp_path, rig_file):
    path = tmp_path / "default.toml"
    write_default(path)
    lines = path.read_text(encoding="utf-8").splitlines()
    start = lines.index("# [[channel]]")
    end = start + lines[start:].index("")
    keys = [line for line in lines[start:end] if re.match(r"# (\w+ = |\[)", line)]
    (channel,) = load_rig_file(rig_file("\n".join(k.removeprefix("# ") for k in keys))).channel
    assert (channel.name, channel.terminal, channel.unit) == ("load_cell", "ai4", "N")


CHANNEL = '[[channel]]\nname = "a"\nterminal = "ai4"\nunit = "N"\nunit_per_V = 2.0\n'


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ('[channel]\nname = "a"', r"not a list of tables: write \[\[channel\]\]"),
        ('[[channel]]\nname = "a"', r"channel\[1\].terminal is missing: it is a text such as ai4"),
        (CHANNEL.replace('"a"', '"time"'), "recordings use this name for something else"),
        (CHANNEL.replace('"a"', '"b_counts"'), "recordings use this name for something else"),
        (CHANNEL.replace('"a"', '"Load cell"'), r"channel\[1\].name = .* text such as load_cell"),
        (CHANNEL.replace("2.0", "0.0"), "with 0 every voltage would read the same"),
        (CHANNEL.replace('"ai4"', '"ai0"'), "input ai0 is wired to two channels"),
        (CHANNEL.replace('"ai4"', '"ai9"'), 'channel a: terminal = "ai9" with .* differential'),
        (CHANNEL + CHANNEL.replace("ai4", "ai5"), "channel a: the name is given to two channels"),
        (CHANNEL + "limit_max = 30.0", "limit_max = 30 is not within -20 to 20 N"),
        (CHANNEL + "limit_min = 2.0\nlimit_max = 1.0", "limit_min = 2 is not below limit_max = 1"),
        (CHANNEL + "gain = 2.0", r"channel.gain is not a key"),
    ],
)
def test_what_is_wrong_with_a_declared_channel(rig_file, text, words):
    with pytest.raises(InputError, match=words):
        load_rig_file(rig_file(text))
    assert any(re.search(words, told) for told in faults_of(text).values())
