"""Uncertainties of given values: those of the rig file, as a fit or a diagnosis takes them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from dearig.config.rigfile import RigFile
from dearig.errors import InputError
from dearig.model.diagnosis.results import Diagnosis
from dearig.model.fitting import Constraint, GivenValue, uncertainty_budget, with_systematic
from dearig.model.fitting.parameters import FitLayout
from dearig.model.readings.records import Record
from dearig.model.simulation.actuator import Actuator
from dearig.progress import Progress

__all__ = ["diagnosis_with_budget", "given_values"]

#: Table and key of a rig file by the value that a fit takes for given.
_KEYS = {
    "length": ("film", "length_mm"),
    "width": ("film", "width_mm"),
    "thickness": ("film", "thickness_mm"),
    "permittivity": ("film", "relative_permittivity"),
    "mass": ("load", "mass_g"),
    "displacement": ("laser", "mm_per_V"),
}
_VOLTAGE = {"command": ("amplifier", "gain_V_per_V"), "monitor": ("amplifier", "monitor_V_per_kV")}


def given_values(rig_file: RigFile | None, drive: str) -> list[GivenValue]:
    """Return the values whose uncertainty ``rig_file`` states, each with its relative one.

    ``drive`` is command or monitor: the voltage that drives the model, with its scaling. Raises
    ``InputError`` for one of half of its value or more.
    """
    if rig_file is None:
        return []
    found = []
    for name, (table, key) in {**_KEYS, "voltage": _VOLTAGE[drive]}.items():
        section = getattr(rig_file, table)
        value, uncertainty = getattr(section, key), getattr(section, f"{key}_uncertainty")
        if uncertainty > 0.0 and value > 0.0:
            if uncertainty >= 0.5 * value:
                raise InputError(
                    f"{table}.{key}_uncertainty = {uncertainty:g} in the rig file is half of "
                    f"{table}.{key} = {value:g} or more; a fit cannot allow for so much"
                )
            found.append(GivenValue(name, uncertainty / value))
    return found


def diagnosis_with_budget(
    finding: Diagnosis,
    records: Sequence[Record],
    given: Sequence[GivenValue],
    progress: Progress,
    stop: Callable[[], bool],
    constraints: Sequence[Constraint] = (),
) -> Diagnosis:
    """Return ``finding`` with what the uncertainties of ``given`` values do to its parameters.

    ``records`` are those of the training, ``constraints`` what is stated of parameters. Without,
    where the operator has stopped the search, or where ``stop()`` is True before the budget is
    made.
    """
    final = finding.final
    # with the drift, which each record has for itself
    model = final.of_each(len(records))[0]
    if finding.interrupted or not given or not isinstance(model, Actuator):
        return finding
    held = ~np.isin(FitLayout(model).names, final.covariance_names)
    budget = uncertainty_budget(
        records, model, held, given,
        # the bar is of the whole work, which the search has filled
        progress=lambda stage, _: progress(stage, 1.0), stop=stop, constraints=constraints,
    )  # fmt: skip
    if not budget:
        said = "stopped before the uncertainties of the rig file were taken into account"
        return replace(finding, notes=(*finding.notes, said))
    estimates = with_systematic(final.estimates, budget)
    systematic = {e.name: e.systematic for e in estimates}
    steps = tuple(
        replace(
            step,
            estimates=tuple(
                replace(e, systematic=systematic.get(f"{step.effect}: {e.name}", 0.0))
                for e in step.estimates
            ),
        )
        for step in finding.steps
    )
    return replace(finding, final=replace(final, estimates=estimates, budget=budget), steps=steps)
