"""Plans of campaigns: grids, lists, repeats, orders and names."""

from __future__ import annotations

from collections import Counter
from itertools import product
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from dearig.analysis.readings.compatibility import BRANCHES_MAX
from dearig.config.campaignfile import EXAMPLE, Campaign, load_campaign, parse_campaign
from dearig.errors import InputError
from tests.deep import examples
from tests.tools.command import LOBE, write

HEAD = 'name = "ageing"\nsequence = "thesis"\n'
FREQUENCY = '"segment.0.frequencies_Hz"'


def parsed(text: str, folder: Path = Path()) -> Campaign:
    return parse_campaign(text, "plan", folder)


def test_the_example_is_a_plan_whose_runs_can_be_loaded() -> None:
    plan = parsed(EXAMPLE)
    assert len(plan.runs) == 1 + 2 * 2
    assert plan.runs[0].warm_up
    for run in plan.runs[1:]:
        assert run.name.endswith(f"-{run.settings['segment.0.amplitudes_kV'][0]}kV")
        assert plan.load(run).sequence.segments[0].amplitudes[0] == pytest.approx(
            1e3 * run.settings["segment.0.amplitudes_kV"][0]
        )


settings = st.dictionaries(
    st.sampled_from(["segment.0.periods", "lead_in_s", "tail_s"]),
    st.lists(st.integers(1, 5), min_size=1, max_size=3, unique=True),
    max_size=3,
)


@examples(100, suite=30)
@given(
    grid=settings,
    listed=st.lists(st.integers(1, 3), max_size=3),
    repeat=st.integers(1, 3),
    seed=st.none() | st.integers(0, 9),
)
def test_a_plan_has_every_combination_as_often_as_it_says(grid, listed, repeat, seed) -> None:
    text = HEAD + f"repeat = {repeat}\n"
    if seed is not None:
        text += f'order = "random"\nseed = {seed}\n'
    text += "[grid]\n" + "".join(f'"{key}" = {values}\n' for key, values in grid.items())
    text += "".join(f"[[run]]\nrepeat = {n}\nset = {{lead_in_s = 9}}\n" for n in listed)
    plan = parsed(text)
    expected = Counter()
    if grid or not listed:
        for values in product(*grid.values()):
            expected[tuple(sorted(zip(grid, values, strict=True)))] += repeat
    expected[(("lead_in_s", 9),)] += sum(listed)
    found = Counter(tuple(sorted(run.settings.items())) for run in plan.runs)
    assert found == +expected
    assert len({run.name.lower() for run in plan.runs}) == len(plan.runs)
    assert [run.number for run in plan.runs] == list(range(1, len(plan.runs) + 1))
    again = parsed(text)
    assert [dict(run.settings) for run in again.runs] == [dict(run.settings) for run in plan.runs]


def test_a_random_order_depends_on_its_seed_and_has_the_same_runs() -> None:
    text = HEAD + 'order = "random"\nseed = {}\n[grid]\nlead_in_s = {}\n'
    orders = [
        [run.settings["lead_in_s"] for run in parsed(text.format(seed, list(range(1, 30)))).runs]
        for seed in (1, 2)
    ]
    assert orders[0] != orders[1]
    assert sorted(orders[0]) == sorted(orders[1]) == list(range(1, 30))


def test_a_dotted_key_without_quotation_marks_is_the_same_path() -> None:
    quoted, bare = (
        parsed(HEAD + f"[grid]\n{key} = [[0.5], [1.0]]\n")
        for key in (FREQUENCY, "segment.0.frequencies_Hz")
    )
    assert [dict(run.settings) for run in quoted.runs] == [dict(run.settings) for run in bare.runs]


def test_a_setting_changes_its_key_and_nothing_else(tmp_path: Path) -> None:
    write(tmp_path / "lobe.toml", LOBE)
    plan = parsed(
        'name = "a"\nsequence = "lobe.toml"\n[grid]\n"segment.0.amplitude_kV" = [1.0, 2.0]\n',
        tmp_path,
    )
    first, second = (plan.load(run).sequence for run in plan.runs)
    assert (first.lead_in, first.tail, first.duration) == (0.4, 0.1, second.duration)
    peaks = [s.voltage(s.sample(200.0)[0]).max() for s in (first, second)]
    assert peaks == pytest.approx([1000.0, 2000.0], rel=1e-3)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "name is missing"),
        ('name = "a"\n', "sequence is missing"),
        (HEAD + "rests_s = 1\n", "rests_s is not a key: did you mean rest_s?"),
        (HEAD + "rest_s = -1\n", "rest_s = -1 is not allowed, but a number from 0 to 86400"),
        (HEAD + 'order = "up"\n', 'but "as_written" or "random"'),
        (HEAD.replace("thesis", "thesys"), "did you mean thesis?"),
        (HEAD.replace("thesis", "../a.toml"), "leads out of the plan's folder"),
        (HEAD.replace("thesis", "no.toml"), "neither a preset nor a file next to the plan"),
        (HEAD + "[grid]\nlead_in_s = 3\n", "grid.lead_in_s = 3 is not a list of values"),
        (HEAD + "[grid]\nlead_in_s = []\n", "is not a list of values"),
        (HEAD + '[grid]\n"segment.4.periods" = [1]\n', "places 0 to 0"),
        (HEAD + '[grid]\n"sequent.0" = [1]\n', "sequent is not in the sequence"),
        (HEAD + '[grid]\n"name.0" = [1]\n', "which has no keys"),
        (HEAD + "repeat = 2\ntemplate = \"x\"\n", "put {number} into the template"),
        (HEAD + 'template = "{number"\n', "template"),
        (HEAD + 'template = "{number:x}"\n', "formats such as 04d"),
        (HEAD + 'template = "{name:d}"\n', "does not fit to the value"),
        (HEAD + 'template = "{number:9999999}"\n', "formats such as"),
        (HEAD + 'template = "{segment}"\n', "template"),
        (HEAD + 'template = "con"\n', "a device on Windows"),
        (HEAD + 'template = "../{number}/x"\nrepeat = 10001\n', "repeat = 10001"),
        (HEAD + "repeat = 10000\n[[run]]\n[grid]\ntail_s=[1]\n", "more than 10,000 runs"),
        (HEAD + "run = [3]\n", "run[1] = 3 is not a table"),
        (HEAD + "[[run]]\nrepeat = 1.5\n", "run[1].repeat = 1.5 is not allowed"),
        (HEAD + "[after]\nidentfy = true\n", "after.identfy is not a key: did you mean identify?"),
        (HEAD + "[after]\nidentify = 1\n", "true or false"),
        (HEAD + '[after]\nstop_when = "mu_0_kPa < 4"\n', "this plan they are peak"),
        (HEAD + '[after]\nidentify = true\nstop_when = "mu_0 < 4"\n', "humidity_percent, mu_0_kPa"),
        (HEAD + '[after]\nidentify = true\nstop_when = "mu_0_kPa = 4"\n', "is not a condition"),
        (HEAD + '[after]\nidentify = true\nstop_when = "mu_0_kPa < 1e999"\n', "is not a condition"),
        (HEAD + '[after]\nmodel = "/m.toml"\n', "after.model"),
        (HEAD + "[after]\nvalidate = true\n", "after.validate has no model"),
        (HEAD + "[after]\nidentify = true\nbranches = 9\n", "a whole number from 1 to 8"),
        (HEAD + '[notify]\ncommand = "x"\n', 'a list of texts such as ["program", "argument"]'),
        (HEAD + '[notify]\non = ["end"]\n', '"run-ended" or "tripped" or "queue-stopped"'),
        (HEAD + "[notify]\non = []\n", "notify.on"),
        (HEAD + 'repeat_after = "arc"\n', 'a list of "input-overflow" or'),
    ],
)  # fmt: skip
def test_what_is_wrong_is_said_in_one_sentence(text: str, words: str, tmp_path: Path) -> None:
    path = write(tmp_path / "plan.toml", text)
    with pytest.raises(InputError) as refused:
        load_campaign(path)
    assert words in str(refused.value)
    assert "\n" not in str(refused.value)


def test_names_are_names_of_files_on_every_system() -> None:
    plan = parsed(HEAD.replace("ageing", "a/b: c?") + 'template = "{name}*{number}"\n')
    assert plan.runs[0].name == "a-b-c-1"


def test_a_large_sequence_is_not_written_for_every_run(tmp_path: Path) -> None:
    segments = '[[segment]]\nkind = "hold"\nduration_s = 1.0\n' * 1000
    write(tmp_path / "long.toml", 'name = "long"\n' + segments)
    with pytest.raises(InputError, match="characters of sequences"):
        parsed('name = "a"\nsequence = "long.toml"\nrepeat = 9000\n', tmp_path)


def test_a_band_can_be_of_a_parameter_that_a_diagnosis_may_find() -> None:
    band = "power-law_drag.drag_kPa > 2"
    plan = parsed(HEAD + f'[after]\ndiagnose = true\nstop_when = "{band}"\n')
    assert str(plan.stop_when[0]) == band


def test_a_band_is_left_where_its_condition_holds() -> None:
    text = '[after]\nidentify = true\nstop_when = ["mu_0_kPa < 40", "T_1_s >= 2e1"]\n'
    low, late = parsed(HEAD + text).stop_when
    assert [low.left_by(value) for value in (39.9, 40.0)] == [True, False]
    assert [late.left_by(value) for value in (20.0, 19.9)] == [True, False]


def test_a_campaign_may_end_by_what_every_recording_gives() -> None:
    plan = parsed(HEAD + '[after]\nstop_when = "peak_displacement_mm < 0.1"\n')
    assert [str(band) for band in plan.stop_when] == ["peak_displacement_mm < 0.1"]


def test_a_plan_has_as_many_branches_as_a_fit() -> None:
    assert parsed(HEAD + f"[after]\nbranches = {BRANCHES_MAX}\n").branches == BRANCHES_MAX
