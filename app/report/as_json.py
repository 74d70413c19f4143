"""An outcome as JSON, for programs."""

from __future__ import annotations

import json
import math
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

from app.errors import InputError
from app.report.units import SHOWN
from app.report.words import pooled_noise, warnings_of

if TYPE_CHECKING:
    from app.outcomes import BranchTrial, Comparison, IdentifyOutcome, Published, ValidateOutcome
    from model.fitting import Estimate

__all__ = ["outcome_json", "write_json"]


def outcome_json(outcome: IdentifyOutcome | ValidateOutcome) -> dict[str, Any]:
    """``outcome`` for ``--json``: plain values in SI units, or in the unit that a key ends with.

    What is not known, not finite, or has no meaning (the thesis's e_rms for a stress) is None.
    """
    from app.outcomes import IdentifyOutcome

    head: dict[str, Any] = {"format": "dearig-validation/1"}
    if not isinstance(outcome, IdentifyOutcome):
        return head | {
            "title": outcome.title,
            "kind": outcome.kind,
            "model": outcome.model_name,
            "model_path": outcome.model_path,
            **_noise_json(outcome.kind, outcome.comparisons),
            "recordings": [_comparison_json(c) for c in outcome.comparisons],
            "warnings": list(warnings_of(outcome)),
        }
    fit = outcome.fit
    known = fit.covariance.size > 0
    return head | {
        "format": "dearig-identification/1",
        "title": outcome.title,
        "kind": outcome.kind,
        "method": outcome.method,
        "converged": bool(fit.converged),
        "model_path": outcome.model_path,
        **_noise_json(outcome.kind, outcome.train),
        "residual_over_noise": _number(math.sqrt(fit.cost)) if fit.cost >= 0.0 else None,
        "parameters": [_parameter_json(e, known) for e in fit.estimates],
        "train": [_comparison_json(c) for c in outcome.train],
        "validation": [_comparison_json(c) for c in outcome.validation],
        "trials": [_trial_json(t, outcome.kind) for t in outcome.trials],
        "published_fit": _published_json(outcome.published_fit),
        "simulations": int(fit.simulations),
        "seconds": _number(outcome.seconds),
        "warnings": list(warnings_of(outcome)),
    }


def _number(value: float | None) -> float | None:
    return float(value) if value is not None and math.isfinite(value) else None


def _noise_json(kind: str, comparisons: tuple[Comparison, ...]) -> dict[str, Any]:
    shown = SHOWN[kind]
    noise = pooled_noise(comparisons)
    value = None if noise is None else noise * shown.error_factor
    return {f"noise_floor_{shown.suffix}": _number(value)}


def _parameter_json(estimate: Estimate, known: bool) -> dict[str, Any]:
    low = None if estimate.low == 0.0 else _number(estimate.low)
    high = _number(estimate.high)
    return {
        "name": estimate.name,
        "value": _number(estimate.value),
        "unit": estimate.unit,
        "ci95": [low, high] if known or not estimate.free else [None, None],
        "determined": bool(estimate.determined),
        "free": bool(estimate.free),
        "note": estimate.note,
    }


def _comparison_json(comparison: Comparison) -> dict[str, Any]:
    shown = SHOWN[comparison.kind]
    e = comparison.errors
    film = comparison.kind == "film"
    measures = {
        f"rms_{shown.suffix}": _number(e.rms * shown.error_factor),
        "nrmse_pct": _number(e.nrmse_pct),
        "e_rms_thesis_pct": None if film else _number(e.e_rms_thesis_pct),
        "e_m_thesis_pct": _number(e.e_m_thesis_pct),
        f"max_{shown.suffix}": _number(e.max * shown.error_factor),
    }
    if film:
        measures["peak_pct"] = _number(e.peak_pct)
    return {
        "name": comparison.name,
        "role": comparison.role,
        "table": comparison.table,
        "row": comparison.row,
        "samples": int(e.samples),
        **measures,
        **_noise_json(comparison.kind, (comparison,)),
        "published": _published_json(comparison.published),
        "warnings": list(comparison.warnings),
    }


def _published_json(published: Published | None) -> dict[str, Any] | None:
    if published is None:
        return None
    return {"e_rms_pct": _number(published.e_rms_pct), "e_m_pct": _number(published.e_m_pct)}


def _trial_json(trial: BranchTrial, kind: str) -> dict[str, Any]:
    shown = SHOWN[kind]
    validation = trial.validation_rms
    return {
        "branches": int(trial.branches),
        f"train_rms_{shown.suffix}": _number(trial.train_rms * shown.error_factor),
        "train_peak_pct": _number(trial.train_peak_pct),
        f"validation_rms_{shown.suffix}": None
        if validation is None
        else _number(validation * shown.error_factor),
        "validation_peak_pct": _number(trial.validation_peak_pct),
        "bic": _number(trial.bic),
        "chosen": bool(trial.chosen),
    }


def write_json(obj: dict[str, Any], target: str | Path) -> None:
    """Write ``obj`` as JSON to the file ``target``, or to standard output if that is ``-``.

    A file appears as a whole or not at all. Raises ``InputError`` if it cannot be written, and
    ``ValueError`` for numbers that JSON does not have.
    """
    # the escapes of JSON: any terminal and any reader can take them, whatever a file is called
    text = json.dumps(obj, indent=2, allow_nan=False) + "\n"
    if str(target) == "-":
        try:
            sys.stdout.write(text)
            sys.stdout.flush()
        except OSError as error:
            raise InputError(f"the JSON cannot be written to standard output: {error}") from error
        return
    from app.recording.files import check_output, replaced_when_done

    path = check_output(target, overwrite=True)
    with replaced_when_done(path) as partial:
        partial.write_text(text, encoding="utf-8", newline="\n")
