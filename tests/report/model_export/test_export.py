"""Models for other programs: one Python file, a page of equations, Prony series."""

from __future__ import annotations

import json
import math
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from dearig.api.models import export_model
from dearig.config.modelfile import ModelFile, save_model
from dearig.errors import InputError
from dearig.model.effects import EFFECTS, ORIGINS, Effect
from dearig.model.effects.registry import OURS
from dearig.model.film.material import TABLE_3, THESIS_FILM, THESIS_LOAD, Branch, Network, Spring
from dearig.model.simulation.actuator import Actuator, Drive
from dearig.model.simulation.strip import Strip
from dearig.report.model_export.write import export_text
from tests.deep import mostly_deep
from tests.tools.command import dearig as run
from tests.tools.command import done, refused

TIME = np.arange(0.0, 0.6, 0.004)
VOLTAGE = 6e3 * np.abs(np.sin(2.5 * np.pi * TIME))
WARMTH, MOISTURE = 0.5 * TIME, 0.1 * TIME
PLAIN = Actuator(THESIS_FILM, THESIS_LOAD, TABLE_3)

#: The file is run where neither this package nor numba can be imported.
ALONE = """
import json, runpy, sys
import numpy as np
sys.modules["dearig"] = sys.modules["numba"] = None
drive = json.load(open(sys.argv[2]))
simulate = runpy.run_path(sys.argv[1])["simulate"]
print(json.dumps(simulate(**drive).tolist()))
"""
OURS_BY_VOLTAGE = [n for n, e in EFFECTS.items() if ORIGINS[n] == OURS and "voltage" in e.drives]
OURS_BY_STRETCH = [n for n, e in EFFECTS.items() if ORIGINS[n] == OURS and "stretch" in e.drives]


def noticeable(effect: Effect) -> tuple[tuple[str, tuple[tuple[str, float], ...]], ...]:
    """The effect with values at which it is seen."""
    values = []
    for p in effect.parameters:
        value = p.typical if p.neutral is None else p.neutral + p.typical
        if p.neutral is None and p.starts and not p.relative_to:
            value = p.starts[0]
        if p.name == "moment":
            value = 0.3
        values.append((p.name, min(max(value, p.bounds[0]), p.bounds[1])))
    return ((effect.name, tuple(values)),)


def alone(model: Actuator | Strip, folder: Path, **drive: object) -> np.ndarray:
    """What the exported file of ``model`` computes in a process of its own."""
    (folder / "model.py").write_text(export_text(ModelFile("m", model), "python"), "utf-8")
    (folder / "drive.json").write_text(json.dumps(drive), "utf-8")
    made = subprocess.run(
        [sys.executable, "-c", ALONE, folder / "model.py", folder / "drive.json"],
        capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert made.returncode == 0, made.stderr
    return np.array(json.loads(made.stdout))


def agrees(found: np.ndarray, right: np.ndarray) -> bool:
    return bool(np.max(np.abs(found - right)) <= 1e-9 * np.ptp(right))


def test_the_plain_model_needs_numpy_alone(tmp_path: Path) -> None:
    for hold in (False, True):
        right = PLAIN.simulate(Drive(TIME, VOLTAGE, hold)).displacement
        found = alone(PLAIN, tmp_path, time=TIME.tolist(), voltage=VOLTAGE.tolist(), hold=hold)
        assert agrees(found, right)
    text = (tmp_path / "model.py").read_text(encoding="utf-8")
    assert "jit" not in text
    assert f"{TABLE_3.equilibrium.modulus!r}  # Pa: shear modulus" in text


@pytest.mark.parametrize(
    "name",
    mostly_deep(
        OURS_BY_VOLTAGE,
        (
            "strained electrode",
            "dry friction",
            "general softening",
            "sensor delay",
            "moist leakage",
        ),
    ),
)
def test_every_effect_is_computed_as_here(name: str, tmp_path: Path) -> None:
    model = Actuator(THESIS_FILM, THESIS_LOAD, TABLE_3, noticeable(EFFECTS[name]))
    drive = Drive(TIME, VOLTAGE, warmth=WARMTH, moisture=MOISTURE, temperature=2.0, humidity=0.1)
    response = model.simulate(drive)
    assert response.ok
    found = alone(
        model, tmp_path, time=TIME.tolist(), voltage=VOLTAGE.tolist(), warmth=WARMTH.tolist(),
        moisture=MOISTURE.tolist(), temperature=2.0, humidity=0.1,
    )  # fmt: skip
    assert agrees(found, response.displacement)


@pytest.mark.parametrize("name", mostly_deep(OURS_BY_STRETCH, ("slow branch",)))
def test_a_film_is_computed_as_here(name: str, tmp_path: Path) -> None:
    model = Strip(TABLE_3, "uniaxial", noticeable(EFFECTS[name]))
    stretch = 1.2 - 0.2 * np.cos(8.0 * TIME)
    right = model.simulate(TIME, stretch).stress
    found = alone(model, tmp_path, time=TIME.tolist(), stretch=stretch.tolist())
    assert agrees(found, right)


@pytest.mark.deep
def test_a_spring_of_each_integrator_is_computed_as_here(tmp_path: Path) -> None:
    ogden = Network(
        Spring(4.6e4, kind="ogden", shape=(1.2,)),
        (Branch(Spring(4e4, kind="ogden", shape=(1.2,)), 0.4),),
    )
    stiff = Network(Spring(4.6e4, 9e3), (Branch(Spring(4e6, 9e3), 1e-4),))
    for network in (ogden, stiff):
        model = Actuator(THESIS_FILM, THESIS_LOAD, network)
        right = model.simulate(Drive(TIME, VOLTAGE))
        assert right.ok
        found = alone(model, tmp_path, time=TIME.tolist(), voltage=VOLTAGE.tolist())
        assert agrees(found, right.displacement)


def test_the_page_has_the_equations_with_numbers_and_intervals() -> None:
    model = Actuator(
        THESIS_FILM, THESIS_LOAD, TABLE_3,
        (("strained electrode", (("resistance", 1e7), ("gauge", 13.61))),),
    )  # fmt: skip
    history = {"estimate": [
        {"name": "mu_0", "low95": 45e3, "high95": 46.5e3},
        {"name": "strained electrode: gauge", "low95": 13.5, "high95": 13.7},
        {"name": "T_2", "stated": {"fixed": 0.3980}},
        {"name": "mu_1", "low95": None, "high95": 2e5},
        {"name": "J_0", "low95": 21.0, "high95": None},
        {"name": "J_1", "low95": None, "high95": None},
    ]}  # fmt: skip
    page = export_text(ModelFile("film_7 & more", model, history), "latex")
    for equation in EFFECTS["strained electrode"].law.equations:
        assert equation in page
    assert r"film\_7 \& more" in page
    (gauge,) = (line for line in page.splitlines() if "gauge relative" in line)
    assert "13.6" in gauge
    assert "[$13.500$, $13.700$]" in gauge
    (fixed,) = (line for line in page.splitlines() if line.startswith("$T_{2}$"))
    assert fixed.endswith(r"& fixed \\")
    # an end of an interval that the data leave open is no number
    ends = (r"$\mu_{1}$", r"below $200000$"), (r"$J_{0}$", r"above $21$"), (r"$J_{1}$", "open")
    for symbol, end in ends:
        (row,) = (line for line in page.splitlines() if line.startswith(symbol))
        assert row.endswith(rf"& {end} \\")
    assert r"\infty" not in page
    for opened in re.findall(r"\\begin\{(\w+\*?)\}", page):
        assert page.count(f"\\begin{{{opened}}}") == page.count(f"\\end{{{opened}}}")


def test_a_prony_series_relaxes_as_the_film_does() -> None:
    """A small step at rest, held: the stress decays with the sum of the series."""
    model = Strip(Network(Spring(5e4), (Branch(Spring(4e4), 0.4),)), "uniaxial")
    text = export_text(ModelFile("m", model), "prony")
    (term,) = re.findall(r"^ +1 +(\S+) +(\S+) +(\S+)$", text, re.MULTILINE)
    g, tau, modulus = map(float, term)
    assert modulus == 4e4
    assert g == pytest.approx(4e4 / 9e4)
    time = np.linspace(0.0, 0.5, 501)
    stretch = np.where(time > 0.0, 1.0 + 1e-5, 1.0)
    stress = model.simulate(time, stretch).stress
    series = 1.0 - g + g * np.exp(-(time - time[1]) / tau)
    assert stress[1:] / stress[1] == pytest.approx(series[1:], rel=2e-3)


def test_what_a_prony_series_cannot_express_is_named() -> None:
    model = Actuator(
        THESIS_FILM, THESIS_LOAD, TABLE_3,
        (
            ("slow branch", (("modulus", 2e3), ("relaxation_time", 30.0))),
            ("dry friction", (("friction", 50.0), ("presliding", 1e-4), ("damping", 1e-3))),
        ),
    )  # fmt: skip
    text = export_text(ModelFile("m", model), "prony")
    assert "- Not expressed: dry friction" in text
    assert "Not expressed: slow branch" not in text
    assert "The springs of this model differ" in text
    shares = [float(g) for g in re.findall(r"^ +\d +(\S+) +\S+ +\S+$", text, re.MULTILINE)]
    assert len(shares) == 4
    instant = float(re.search(r"G_0 = (\S+) Pa", text)[1])
    assert math.isclose(1.0 - sum(shares), TABLE_3.equilibrium.modulus / instant, rel_tol=1e-9)


@pytest.mark.parametrize("to", ["latex", "prony", "python"])
def test_what_the_fit_said_against_its_numbers_goes_with_them(to: str) -> None:
    weak = {"name": "mu_1", "unit": "Pa", "value": 8e6, "low95": 5e6, "determined": False}
    history = {"estimate": [weak], "warnings": ["the model is rejected: noise as that"]}
    told, plain = (
        re.sub(r"[\s\\]+", " ", export_text(ModelFile("m", PLAIN, h), to)).replace(" _", "_")
        for h in (history, {"estimate": [{**weak, "determined": True}]})
    )
    for words in ("fitted to reject it", "The data do not determine mu_1: other values fit"):
        assert words in told
        assert words not in plain


def test_a_branch_that_is_weaker_in_another_program_is_called_softer() -> None:
    told = export_text(ModelFile("m", PLAIN), "prony")
    assert re.search(r"branches are 1\d % softer than the model's", told)


def test_the_command_writes_each_kind_and_refuses_others(tmp_path: Path) -> None:
    path = tmp_path / "m.toml"
    save_model(path, "m", PLAIN, {})
    for kind, ending in (("latex", ".tex"), ("python", ".py"), ("prony", ".txt")):
        done("export-model", path, "--to", kind)
        assert path.with_suffix(ending).stat().st_size > 500
    refused(run("export-model", path, "--to", "latex"), "m.tex")
    assert export_model(path, "prony", tmp_path / "again.txt") == tmp_path / "again.txt"
    with pytest.raises(InputError, match="a model is exported to latex, python, prony"):
        export_model(path, "matlab", tmp_path / "m.m")
