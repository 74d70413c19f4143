"""Effects of other distributions: found by their entry points, or left out with a sentence."""

import pytest

from tests.tools.effect_plugin import FEW, add_distribution, made_effect, run_with

FOUND = """
from dearig.model.effects import ORIGINS, PROBLEMS
print([f"{name}: {origin}" for name, origin in ORIGINS.items() if origin != "dearig"])
print(*PROBLEMS, sep="\\n")
"""
USED = """
import numpy as np
from dearig.config.modelfile import load_model, save_model
from dearig.model.simulation.strip import Strip
from dearig.model.film.material import Network, Spring
time = np.linspace(0.0, 1.0, 5)
plain = Strip(Network(Spring(4e4, 60.0)))
pulled = Strip(plain.network, effects=(("lab drag", (("drag", 250.0),)),))
added = pulled.simulate(time, 1.0 + time).stress - plain.simulate(time, 1.0 + time).stress
print(np.round(added, 6).tolist())
save_model("model.toml", "made", pulled, {})
print(load_model("model.toml").model.effects)
"""
HOOK = (
    FEW
    + """
import numpy as np
from dearig.model.effects import MEMORY, PLACES, assembly
from dearig.model.simulation.strip import Strip
from dearig.model.compiled.jit import cache_folder
from dearig.model.film.material import Network, Spring
c = Strip(Network(Spring(4e4, 60.0)), effects=(("lab drag", (("drag", 250.0),)),)).coefficients()
m, on = np.zeros(MEMORY), assembly.active(c)
print(assembly.stress(on, c, m, 1.1, 0.5, 1.1, 0.0, 0.0))
print(assembly.stiffness(on, c, m, 1.1, 0.5)[1])
print(cache_folder().name)
"""
)
EXAMINED = """
from dearig.cli.doctor import examine
for item in examine():
    if item.section == "plug-ins":
        print(item.name, item.verdict, item.found, sep=" | ")
"""
SOFTENED = """

@jit
def soften(c, k, m, j, lam, since, t, warmth):
    return {}
"""


def test_an_effect_of_another_distribution_is_found_and_used(tmp_path):
    add_distribution(tmp_path, "lab-effects", {"lab_drag": made_effect("lab drag")})
    found, problems, added, effects = run_with(tmp_path, FOUND + USED).splitlines()
    assert (found, problems) == ("['lab drag: lab-effects 1.0']", "")
    assert added == "[0.0, 250.0, 250.0, 250.0, 250.0]"
    assert effects == "(('lab drag', (('drag', 250.0),)),)"


def test_an_effect_may_be_imported_before_the_package_finds_it(tmp_path):
    add_distribution(tmp_path, "lab-effects", {"lab_drag": made_effect("lab drag")})
    found, problems, *_ = run_with(tmp_path, "import lab_drag\n" + FOUND).split("\n")
    assert (found, problems) == ("['lab drag: lab-effects 1.0']", "")


#: Modules that cannot be used, by the name of each, with the reason that is told.
UNUSABLE = {
    "lab_import": (
        "import no_such_module", "ModuleNotFoundError: No module named 'no_such_module'"
    ),
    "lab_raises": ("raise RuntimeError('no licence')", "RuntimeError: no licence"),
    "lab_empty": ("x = 1", "it has no EFFECT of the class dearig.model.effects.Effect"),
    "lab_clash": (
        made_effect("linear drag"), "an effect of dearig is called 'linear drag' already"
    ),
    "lab_family": (
        made_effect("lab drag").replace('family="drag"', 'family="magic"'),
        "its family 'magic' is not one of load_inertia, drag",
    ),
    "lab_arguments": (
        made_effect("lab drag").replace(", since, t)", ", since)"),
        "its hook stress takes (c, k, m, j, lam, rate, lam0, since), not (c, k, m, j, lam, "
        "rate, lam0, since, t)",
    ),
}  # fmt: skip
#: The same of hooks that do not compile.
UNCOMPILED = {
    "lab_name": (SOFTENED.format("nothing"), "its hook soften does not compile"),
    "lab_two": (
        SOFTENED.format("1.0, 2.0"), "its hook soften returns UniTuple(float64 x 2), not 1"
    ),
    "lab_plain": (
        SOFTENED.format("1.0").replace("@jit", ""), "its hook soften is not compiled: decorate"
    ),
}  # fmt: skip


def require_left_out(problems, reasons):
    """Each module is left out with a sentence of its own, whatever else is left out."""
    assert len(problems) == len(reasons)
    for module, reason in reasons.items():
        (problem,) = (p for p in problems if f"(module {module})" in p)
        distribution = module.replace("_", "-")
        assert problem.startswith(
            f"The effect {module!r} of {distribution} 1.0 (module {module}) is left out: "
        )
        assert reason in problem
        assert problem.endswith(f"Repair or uninstall {distribution} 1.0.")


def test_effects_that_cannot_be_used_are_left_out_one_by_one(tmp_path):
    for module, (source, _) in UNUSABLE.items():
        add_distribution(tmp_path, module.replace("_", "-"), {module: source})
    add_distribution(tmp_path, "lab-more", {"lab_good": made_effect("good drag")})
    found, *problems = run_with(tmp_path, FOUND).strip().split("\n")
    assert found == "['good drag: lab-more 1.0']"
    require_left_out(problems, {module: reason for module, (_, reason) in UNUSABLE.items()})


@pytest.mark.deep
def test_hooks_that_do_not_compile_are_told(tmp_path):
    for module, (more, _) in UNCOMPILED.items():
        source = made_effect(f"{module} drag", more=more)
        add_distribution(tmp_path, module.replace("_", "-"), {module: source})
    found, *problems = run_with(tmp_path, FOUND, compiled=True).strip().split("\n")
    assert found == "[]"
    require_left_out(problems, {module: reason for module, (_, reason) in UNCOMPILED.items()})


def test_more_effects_than_places(tmp_path):
    modules = {f"lab_{i}": made_effect(f"drag {i:03}") for i in range(62)}
    add_distribution(tmp_path, "lab-effects", modules)
    found, *problems = run_with(tmp_path, FOUND).strip().split("\n")
    assert len(problems) + found.count("lab-effects") == 62
    assert all("there is no place for more than 62 effects" in problem for problem in problems)


@pytest.mark.deep
def test_the_compiled_kernels_are_those_of_this_source(tmp_path):
    source = made_effect("lab drag")
    add_distribution(tmp_path, "lab-effects", {"lab_drag": source})
    stress, drag, folder = run_with(tmp_path, HOOK, compiled=True).splitlines()
    assert float(stress) == 125.0
    assert float(drag) == pytest.approx(250.0)
    (tmp_path / "lab_drag.py").write_text(made_effect("lab drag", 2.0), encoding="utf-8")
    stress, drag, other = run_with(tmp_path, HOOK, compiled=True).splitlines()
    assert float(stress) == 250.0
    assert float(drag) == pytest.approx(500.0)
    assert folder != other


@pytest.mark.deep
def test_an_effect_that_is_left_out_for_now_has_kernels_of_its_own(tmp_path):
    needs = "import lab_needed\n"
    add_distribution(tmp_path, "lab-drag", {"lab_drag": made_effect("lab drag")})
    add_distribution(tmp_path, "lab-later", {"lab_later": needs + made_effect("later drag")})
    without = run_with(tmp_path, HOOK, compiled=True).splitlines()
    (tmp_path / "lab_needed.py").touch()
    there = run_with(tmp_path, HOOK, compiled=True).splitlines()
    assert without[0] == there[0] == "125.0"
    assert without[2] != there[2]


@pytest.mark.deep
def test_the_doctor_tells_which_effects_are_left_out(tmp_path):
    modules = {"lab_drag": made_effect("lab drag"), "lab_twice": made_effect("linear drag")}
    add_distribution(tmp_path, "lab-effects", modules)
    good, bad = run_with(tmp_path, EXAMINED).splitlines()
    assert good == "effects: lab_drag | ok | lab_drag of lab-effects 1.0"
    assert bad.startswith("effects: lab_twice | wrong | The effect 'lab_twice' of lab-effects 1.0")
