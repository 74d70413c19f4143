"""What derivatives cost: this revision and another one, in the same run.

Run as ``python -m tests.benchmarks.bench_derivatives [PYTHON]``. ``PYTHON`` is the interpreter
of another checkout's environment. The two take turns, each in a process of its own, on one thread;
processor seconds, the least of the turns. The record is two periods of the thesis's excitation at
1 kHz with Table 3's film and 1 um of noise; the rigs are films about Table 3 at 100 Hz.
"""

import json
import subprocess
import sys
import time
from collections.abc import Callable
from dataclasses import replace

import numpy as np

TURNS = 3
RIGS = 8
EFFECTS = ("linear drag", "slow branch", "electrode resistance", "dry friction")


def spent(run: Callable[[], object], repeats: int) -> float:
    """Return the least processor seconds of ``repeats`` runs after one that compiles."""
    run()
    found = []
    for _ in range(repeats):
        before = time.process_time()
        run()
        found.append(time.process_time() - before)
    return min(found)


def measured() -> dict[str, float | list[float]]:
    """Return the numbers of the revision that this interpreter imports."""
    from dearig.model.effects import EFFECTS as KNOWN
    from dearig.model.film.material import TABLE_3, THESIS_FILM, THESIS_LOAD, Network
    from dearig.model.fitting import identify, parameters
    from dearig.model.fitting.problem import Problem
    from dearig.model.readings.records import ActuatorRecord
    from dearig.model.simulation.actuator import Actuator, Drive
    from dearig.model.simulation.excitation import Sequence

    layout_of = getattr(parameters, "FitLayout", None) or parameters.Layout
    thesis = Actuator(THESIS_FILM, THESIS_LOAD, TABLE_3)
    found: dict[str, float | list[float]] = {}

    def record(model: Actuator, rate: float, periods: int, seed: int) -> ActuatorRecord:
        drive = Drive(*Sequence.thesis(periods=periods).sample(rate), hold=True)
        noise = 1e-6 * np.random.default_rng(seed).standard_normal(drive.time.size)
        return ActuatorRecord("made", drive, model.simulate(drive).displacement + noise, 1e-6)

    def typical(name: str) -> tuple[str, tuple[tuple[str, float], ...]]:
        known = KNOWN[name]
        values = (
            (p.name, p.starts[0] if p.neutral is None else p.neutral + p.typical)
            for p in known.parameters
        )
        return name, tuple(values)

    for name in ("", *EFFECTS):
        model = replace(thesis, effects=(typical(name),) if name else ())
        layout = layout_of(model)
        problem = Problem([record(model, 1e3, 2, 0)], layout, 1)
        x = layout.coordinates(layout.initial())
        free = np.ones(x.size, dtype=bool)
        residuals = problem.residuals(x)
        one = spent(lambda p=problem, x=x: p.residuals(x), 9)
        for kind, given in (("one-sided", residuals), ("central", None)):
            took = spent(lambda p=problem, x=x, f=free, r=given: p.jacobian(x, f, r), 3)
            found[f"{kind}, {x.size} parameters, {name or 'no effect'}"] = took / one
    fitted = record(thesis, 1e3, 2, 0)
    identify([fitted], thesis, workers=1, intervals=False)
    before = time.process_time()
    fit = identify([fitted], thesis, workers=1)
    found["identify, s"] = time.process_time() - before
    found["cost of identify"] = fit.cost
    rng = np.random.default_rng(1)
    costs = []
    for seed in range(RIGS):
        factors = np.exp(0.3 * rng.standard_normal(4))
        moduli = tuple(f * s.modulus for f, s in zip(factors, TABLE_3.springs, strict=True))
        times = tuple(
            t * f for t, f in zip(TABLE_3.times, np.exp(0.3 * rng.standard_normal(3)), strict=True)
        )
        network = Network.gent(moduli, tuple(s.limit for s in TABLE_3.springs), times)
        rig = record(replace(thesis, network=network), 100.0, 1, seed)
        costs.append(identify([rig], thesis, workers=1, intervals=False).cost)
    found["costs of rigs"] = costs
    return found


def main() -> None:
    if sys.argv[1:] == ["measure"]:
        print(json.dumps(measured()))
        return
    interpreters = [*sys.argv[1:], sys.executable]
    turns: list[list[dict[str, float | list[float]]]] = [[] for _ in interpreters]
    for _ in range(TURNS):
        for of, interpreter in zip(turns, interpreters, strict=True):
            answer = subprocess.run(
                [interpreter, __file__, "measure"], check=True, capture_output=True, text=True
            )
            of.append(json.loads(answer.stdout.splitlines()[-1]))
    print(f"least of {TURNS} turns; Jacobians in the time of one simulation")
    for key in turns[-1][0]:
        rows = [[one[key] for one in of] for of in turns]
        if key == "costs of rigs":
            costs = np.array([row[0] for row in rows])
            apart = (costs[-1] - costs[0]) / costs[0]
            print(
                f"{RIGS} rigs, cost over the other's less 1: {apart.min():.1e} to {apart.max():.1e}"
            )
        elif key == "cost of identify":
            print(f"{key:<52}" + "".join(f"{row[0]:>14.9f}" for row in rows))
        else:
            print(f"{key:<52}" + "".join(f"{min(row):>14.2f}" for row in rows))


if __name__ == "__main__":
    main()
