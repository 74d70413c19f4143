"""JSON of an outcome, for programs."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from dearig.analysis.outcomes import (
    budget_table,
    covariance_table,
    noise_from,
    pooled_noise,
    pooled_over_noise,
    pooled_steady_rms,
)
from dearig.batch.numbers import rejection_of
from dearig.model.verdict import COMPLETE, STOPPED
from dearig.recording.json_file import finite
from dearig.report.made import made_now
from dearig.report.stored import Outcome, stored
from dearig.report.text.bands import band_json
from dearig.report.text.laws import effect_named, law_json
from dearig.report.text.sentences import warnings_of
from dearig.units import SHOWN

if TYPE_CHECKING:
    from dearig.analysis.outcomes import (
        BranchTrial,
        Comparison,
        DiagnoseOutcome,
        Evaluation,
        IdentifyOutcome,
        Published,
        SpringCandidate,
        ValidateOutcome,
    )
    from dearig.model.diagnosis.results import Candidate, Stage, Step
    from dearig.model.effects import Curve
    from dearig.model.fitting import Estimate
    from dearig.model.fitting.channels import ChannelResult
    from dearig.model.residual import Signature

__all__ = ["diagnosis_json", "outcome_json", "result_json"]


def result_json(outcome: Outcome) -> dict[str, Any]:
    """``outcome`` for ``--json``: its numbers, and the whole of it for a report made again."""
    from dearig.analysis.outcomes import DiagnoseOutcome

    if isinstance(outcome, DiagnoseOutcome):
        numbers = diagnosis_json(outcome)
    else:
        numbers = outcome_json(outcome)
    return {**numbers, "report": stored((outcome,), made_now())}


def outcome_json(outcome: IdentifyOutcome | ValidateOutcome) -> dict[str, Any]:
    """Numbers of ``outcome``: plain values in SI units, or in the unit that a key ends with.

    What is not known, not finite, or has no meaning (the thesis's e_rms for a stress) is None.
    """
    from dearig.analysis.outcomes import IdentifyOutcome

    head: dict[str, Any] = {"format": "dearig-validation/1"}
    if not isinstance(outcome, IdentifyOutcome):
        return head | {
            "title": outcome.title,
            "kind": outcome.kind,
            "model": outcome.model_name,
            "model_path": outcome.model_path,
            **_noise_json(outcome.kind, outcome.comparisons),
            **rejection_of(*outcome.comparisons),
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
        "status": STOPPED if outcome.interrupted else COMPLETE,
        "model_path": outcome.model_path,
        **_noise_json(outcome.kind, outcome.train),
        "residual_over_noise": finite(pooled_over_noise(outcome.train)),
        **rejection_of(*outcome.train),
        "prior_p": finite(fit.prior_p),
        "starts": [
            {"mean_square_over_noise": finite(cost), "followed": followed}
            for cost, followed in fit.starts
        ],
        "parameters": [_parameter_json(e, known) for e in fit.estimates],
        "sums": [_parameter_json(e, known) for e in fit.sums],
        "covariance": covariance_table(fit.covariance_names, fit.covariance),
        "uncertainty_budget": budget_table(fit.budget),
        "train": [_comparison_json(c) for c in outcome.train],
        "validation": [_comparison_json(c) for c in outcome.validation],
        "trials": [_trial_json(t, outcome.kind) for t in outcome.trials],
        "springs": [_spring_json(s, outcome.kind) for s in outcome.springs],
        "published_fit": _published_json(outcome.published_fit),
        "simulations": int(fit.simulations),
        "few_data": outcome.few_data,
        "assumed": outcome.assumed,
        "seconds": finite(outcome.seconds),
        "warnings": list(warnings_of(outcome)),
    }


def _noise_json(kind: str, comparisons: tuple[Comparison, ...]) -> dict[str, Any]:
    shown = SHOWN[kind]
    noise = pooled_noise(comparisons)
    value = None if noise is None else noise * shown.error_factor
    return {f"noise_floor_{shown.suffix}": finite(value), "noise_from": noise_from(comparisons)}


def _parameter_json(estimate: Estimate, known: bool) -> dict[str, Any]:
    """A parameter of the springs: 0 is no lower end, and what was not fitted may be known."""
    fixed = estimate.is_fixed
    combined = [finite(end) if end != 0.0 else None for end in estimate.combined]
    low = None if estimate.low == 0.0 else finite(estimate.low)
    shown = not fixed and (known or not estimate.free)
    return {
        **_effect_number_json(estimate),
        "ci95": [low, finite(estimate.high)] if shown else [None, None],
        "free": bool(estimate.free),
        "ci95_combined": combined if known and not fixed else [None, None],
    }


def _stated_json(estimate: Estimate) -> dict[str, Any]:
    """What was stated of a parameter before the fit, in SI units; None where nothing was."""
    stated = estimate.constraint
    bounds = None if stated is None or not stated.is_bounded else [stated.low, stated.high]
    prior = None if stated is None or stated.mean is None else stated
    return {
        "fixed": estimate.is_fixed,
        "bounds": bounds,
        "prior": None if prior is None else {"mean": prior.mean, "sd": prior.sd},
    }


def _comparison_json(comparison: Comparison) -> dict[str, Any]:
    shown = SHOWN[comparison.kind]
    e = comparison.errors
    film = comparison.kind == "film"
    measures = {
        f"rms_{shown.suffix}": finite(e.rms * shown.error_factor),
        "nrmse_pct": finite(e.nrmse_pct),
        "e_rms_thesis_pct": None if film else finite(e.e_rms_thesis_pct),
        "e_m_thesis_pct": finite(e.e_m_thesis_pct),
        f"max_{shown.suffix}": finite(e.max * shown.error_factor),
    }
    if film:
        measures["peak_pct"] = finite(e.peak_pct)
    return {
        "name": comparison.name,
        "role": comparison.role,
        "table": comparison.table,
        "row": comparison.row,
        "simulated": None if comparison.origin is None else comparison.origin.simulated,
        "samples": int(e.samples),
        **measures,
        **_noise_json(comparison.kind, (comparison,)),
        "published": _published_json(comparison.published),
        "ended_early": _end_json(comparison),
        "channels": _channels_json(comparison.channels),
        "band": _band_json(comparison),
        "warnings": list(comparison.warnings),
    }


def _band_json(comparison: Comparison) -> dict[str, Any] | None:
    error = comparison.measured - comparison.model
    return band_json(comparison.band, comparison.kind, error)


def _channels_json(channels: tuple[ChannelResult, ...]) -> list[dict[str, Any]]:
    """Electrical channels in SI units: RMS residual of a mean before and after, and its noise."""
    return [
        {
            "name": c.name,
            "unit": c.unit,
            "used": bool(c.used),
            "noise": finite(c.noise),
            "before": finite(c.before),
            "after": finite(c.after),
            "reason": c.reason or None,
        }
        for c in channels
    ]


def _end_json(comparison: Comparison) -> dict[str, Any] | None:
    end = comparison.ended
    if end is None:
        return None
    return {
        "kind": end.kind,
        "at_s": end.time,
        "cause": end.cause,
        "doubtful_from_s": end.doubtful_from,
        "cut": end.is_cut,
    }


def _published_json(published: Published | None) -> dict[str, Any] | None:
    if published is None:
        return None
    return {"e_rms_pct": finite(published.e_rms_pct), "e_m_pct": finite(published.e_m_pct)}


def _spring_json(candidate: SpringCandidate, kind: str) -> dict[str, Any]:
    shown = SHOWN[kind]

    def error(value: float | None) -> float | None:
        return None if value is None else finite(value * shown.error_factor)

    return {
        "spring": candidate.spring,
        "branches": int(candidate.branches),
        "free": int(candidate.free),
        "criterion": finite(candidate.criterion),
        "probability": finite(candidate.probability),
        f"train_rms_{shown.suffix}": error(candidate.train_rms),
        f"left_out_rms_{shown.suffix}": error(candidate.left_out_rms),
        f"validation_rms_{shown.suffix}": error(candidate.validation_rms),
        "validation_peak_pct": finite(candidate.validation_peak_pct),
        "chosen": bool(candidate.chosen),
    }


def _trial_json(trial: BranchTrial, kind: str) -> dict[str, Any]:
    shown = SHOWN[kind]
    validation = trial.validation_rms
    return {
        "branches": int(trial.branches),
        f"train_rms_{shown.suffix}": finite(trial.train_rms * shown.error_factor),
        "train_peak_pct": finite(trial.train_peak_pct),
        f"validation_rms_{shown.suffix}": None
        if validation is None
        else finite(validation * shown.error_factor),
        "validation_peak_pct": finite(trial.validation_peak_pct),
        "bic": finite(trial.bic),
        "chosen": bool(trial.chosen),
    }


# ---------------------------------------------------------------- a diagnosis


def diagnosis_json(outcome: DiagnoseOutcome) -> dict[str, Any]:
    """Numbers of ``outcome``, in the units that the keys end with."""
    # One piece: the document key by key, as the page on JSON lists it.
    from dearig.report.text.diagnosis import signatures_of

    finding, shown = outcome.finding, SHOWN[outcome.kind]
    before, after = outcome.before, outcome.after
    experiment = outcome.experiment
    residual_before, residual_after = signatures_of(outcome)
    return {
        "format": "dearig-diagnosis/1",
        "title": outcome.title,
        "kind": outcome.kind,
        "records": {
            "train": _names(before.train, after.train),
            "validation": _names(before.validation, after.validation),
        },
        f"noise_floor_{shown.suffix}": finite(outcome.noise * shown.error_factor),
        "noise_from": noise_from(outcome.before.train),
        "baseline": {"model": "thesis", **_stand_json(before)},
        "steps": [
            {
                "effect": step.effect,
                "family": step.family,
                "acts_on": step.acts_on,
                "parameters": [_effect_number_json(e) for e in step.estimates],
                "law": law_json(effect_named(step.effect)),
                "train": _measures_json(stand.train, outcome.kind),
                "selection": _selection_json(step.stage, stand.train, outcome.kind),
                "validation": _measures_json(stand.validation, outcome.kind),
                "indistinguishable_from": list(step.indistinguishable_from),
                "evidence": _evidence_json(step),
                "says": [
                    {"channel": s.channel, "verdict": s.verdict, "text": s.text} for s in step.says
                ],
                "nearest_named": step.nearest or None,
                "curve": _curve_json(step.curve),
            }
            for step, stand in zip(finding.steps, outcome.stands[1:], strict=False)
        ],
        "final": _stand_json(after),
        "residual_after": {
            "is_noise": all(s.is_noise for s in finding.after),
            "signature": {s.record: _signature_json(s, outcome.kind) for s in residual_after},
        },
        "residual_before": {s.record: _signature_json(s, outcome.kind) for s in residual_before},
        "verdict": outcome.verdict,
        "verdict_reasons": list(outcome.judgement.reasons),
        "recommended": "final" if outcome.recommends_final else "baseline",
        "validation_gain": finite(outcome.gain),
        "status": outcome.status,
        "events": [
            {
                "record": c.name,
                "kind": e.kind,
                "at_s": finite(e.time),
                "size": finite(e.size),
                "unit": e.unit,
            }
            for c in (*after.train, *after.validation)
            for e in c.events
        ],
        "recurring_events": [
            {"kind": e.kind, "at_s": finite(e.time), "size": finite(e.size), "unit": e.unit}
            for e in outcome.recurring
        ],
        "families": [
            {
                "family": f,
                "probability": p,
                "probability_missing": finite(outcome.marginals.get(f)),
            }
            for f, p in outcome.families
        ],
        "channels": [_displacement_json(outcome), *_channels_json(finding.channels)],
        "evidence_by_channel": [
            {"family": family, **{channel: finite(odds) for channel, odds in said}}
            for family, said in finding.channel_evidence
        ],
        "denied": [
            {"effect": d.effect, "family": d.family, "channel": d.channel, "text": d.text}
            for d in finding.denials
        ],
        "unnamed": None
        if finding.unnamed is None
        else {
            "acts_on": finding.unnamed.acts_on,
            "expression": finding.unnamed.expression,
            "signature": finding.unnamed.signature,
        },
        "experiment": None
        if experiment is None
        else {
            "separates": list(experiment.separates),
            "sequence": experiment.sequence,
            "rivals": list(experiment.rivals),
            "separation_over_noise": finite(experiment.separation),
            "seconds": finite(experiment.seconds),
            "average": experiment.average,
            "separation_by_channel": {n: finite(apart) for n, apart in experiment.by_channel},
        },
        "experiment_words": outcome.experiment_text,
        "excitation": _excitation_json(outcome),
        "bands": {
            c.name: _band_json(c)
            for c in (outcome.after if outcome.recommends_final else outcome.before).validation
        },
        "rounds": [
            {
                "base": list(r.base),
                "chosen": r.chosen,
                "reason": r.reason,
                "candidates": [_candidate_json(c, outcome) for c in r.candidates],
            }
            for r in finding.rounds
        ],
        "ended_early": {
            c.name: _end_json(c) for c in (*after.train, *after.validation) if c.ended is not None
        },
        "few_data": outcome.few_data,
        "assumed": outcome.assumed,
        "performed": list(outcome.performed),
        "parameters": [_effect_number_json(e) for e in finding.final.estimates],
        "sums": [_effect_number_json(e) for e in finding.final.sums],
        "covariance": covariance_table(finding.final.covariance_names, finding.final.covariance),
        "uncertainty_budget": budget_table(finding.final.budget),
        "intervals_conditional": outcome.is_rejected,
        "quality": list(outcome.quality),
        "notes": list(finding.notes),
        "interrupted": finding.interrupted,
        "model_path": outcome.model_path,
        "simulations": int(finding.simulations),
        "seconds": finite(outcome.seconds),
    }


def _displacement_json(outcome: DiagnoseOutcome) -> dict[str, Any]:
    """The displacement, or a film's stress, as a channel next to the electrical ones."""
    finding = outcome.finding
    return {
        "name": "displacement" if outcome.kind == "actuator" else "nominal_stress",
        "unit": "m" if outcome.kind == "actuator" else "Pa",
        "used": True,
        "noise": finite(outcome.noise),
        "before": finite(finding.baseline.train_rms),
        "after": finite(finding.final.train_rms),
        "reason": None,
    }


def _excitation_json(outcome: DiagnoseOutcome) -> dict[str, Any] | None:
    """What the validation recordings ask of the model, and what training shows of that."""
    tested, record = outcome.tested, outcome.determining
    if tested is None:
        return None
    return {
        "determined": not outcome.undetermined,
        "tested": {
            "voltage_kV": finite(tested.voltage / 1e3),
            "rate_kV_per_s": finite(tested.rate / 1e3),
            "from_Hz": finite(tested.low),
            "to_Hz": finite(tested.high),
        },
        "records": [
            {
                "record": asked.name,
                "open_over_noise": finite(asked.open_rms),
                "error_share": finite(asked.share),
                "error_share_beyond_training": finite(asked.above),
                "not_determined": [
                    {
                        "from_Hz": finite(band.low),
                        "to_Hz": finite(band.high),
                        "asked_over_noise": finite(band.asked),
                        "known_pct": finite(100.0 * band.known),
                    }
                    for band in asked.undetermined
                ],
            }
            for asked in outcome.excitation
        ],
        "parameters_um": [finite(error * 1e6) for error in outcome.prediction_errors],
        "record": None
        if record is None
        else {
            "name": record.name,
            "seconds": finite(record.seconds),
            "open_over_noise": finite(record.open_rms),
            "sequence": record.sequence,
        },
    }


def _names(*groups: tuple[Comparison, ...]) -> list[str]:
    """Each name once, also of a recording that one of the models could not follow."""
    return list(dict.fromkeys(c.name for group in groups for c in group))


def _stand_json(stand: Evaluation) -> dict[str, Any]:
    kind = stand.train[0].kind if stand.train else "actuator"
    by_record = {c.name: _measures_json((c,), kind) for c in stand.validation}
    return {
        "train": _measures_json(stand.train, kind),
        "validation": _measures_json(stand.validation, kind),
        "validation_by_record": by_record if stand.validation else None,
    }


def _measures_json(comparisons: tuple[Comparison, ...], kind: str) -> dict[str, Any] | None:
    """Errors pooled over recordings (see ``report.diagnosis.pooled_errors``); None without any."""
    from dearig.report.text.diagnosis_tables import pooled_errors

    errors = pooled_errors(comparisons)
    if errors is None:
        return None
    shown = SHOWN[kind]
    steady = pooled_steady_rms(comparisons)
    return {
        f"rms_{shown.suffix}": finite(errors.rms * shown.error_factor),
        f"rms_without_events_{shown.suffix}": finite(steady * shown.error_factor),
        "nrmse_pct": finite(errors.nrmse_pct),
        "e_rms_thesis_pct": None if kind == "film" else finite(errors.e_rms_thesis_pct),
        "e_m_thesis_pct": finite(errors.e_m_thesis_pct),
        f"max_{shown.suffix}": finite(errors.max * shown.error_factor),
    }


def _selection_json(stage: Stage, train: tuple[Comparison, ...], kind: str) -> dict[str, Any]:
    """Of a cross-validation: its errors, relative to the ranges of the training recordings."""
    from dearig.report.text.diagnosis import selection_rms
    from dearig.report.text.diagnosis_tables import pooled_errors

    shown, errors = SHOWN[kind], pooled_errors(train)
    rms = selection_rms(stage, train)

    def relative(of: float, known: float, value: float) -> float | None:
        return finite(of * value / known) if known > 0.0 else None

    return {
        f"rms_{shown.suffix}": finite(rms * shown.error_factor),
        "nrmse_pct": None if errors is None else relative(errors.nrmse_pct, errors.rms, rms),
        "e_rms_thesis_pct": None if kind == "film" else finite(rms * 1e5),
        "e_m_thesis_pct": None
        if errors is None
        else relative(errors.e_m_thesis_pct, errors.max, stage.selection_max),
        f"max_{shown.suffix}": finite(stage.selection_max * shown.error_factor),
    }


def _effect_number_json(estimate: Estimate) -> dict[str, Any]:
    fixed = estimate.is_fixed
    return {
        "name": estimate.name,
        "value": finite(estimate.value),
        "unit": estimate.unit,
        "ci95": [None, None] if fixed else [finite(estimate.low), finite(estimate.high)],
        "determined": bool(estimate.determined),
        "systematic": finite(estimate.systematic),
        "ci95_combined": [None, None] if fixed else [finite(end) for end in estimate.combined],
        "at_bound": bool(estimate.at_bound),
        "note": estimate.note,
        **_stated_json(estimate),
    }


def _curve_json(curve: Curve | None) -> dict[str, Any] | None:
    if curve is None:
        return None
    return {
        "axis": [finite(v) for v in curve.axis.tolist()],
        "values": [finite(v) for v in curve.values.tolist()],
        "axis_label": curve.axis_label,
        "values_label": curve.values_label,
    }


def _evidence_json(step: Step) -> dict[str, Any]:
    return {
        "sentences": list(step.evidence),
        "criterion": finite(step.stage.criterion),
        **{name: finite(value) for name, value in step.numbers},
    }


def _signature_json(signature: Signature, kind: str) -> dict[str, Any]:
    shown = SHOWN[kind]
    return {
        f"rms_{shown.suffix}": finite(signature.rms * shown.error_factor),
        "rms_over_noise": finite(signature.rms / signature.noise),
        "is_noise": bool(signature.is_noise),
        "ljung_box_p": finite(signature.ljung_box_p),
        "runs_p": finite(signature.runs_p),
        "noise_p": finite(signature.noise_p),
        "correlation_time_s": finite(signature.correlation_time),
        "explained": {d.quantity: finite(d.explained) for d in signature.dependences},
        "words": list(signature.words),
        "remarks": list(signature.words),
    }


def _candidate_json(candidate: Candidate, outcome: DiagnoseOutcome) -> dict[str, Any]:
    shown = SHOWN[outcome.kind]
    stage = candidate.stage
    return {
        "effect": candidate.effect,
        "family": candidate.family,
        "acts_on": candidate.acts_on,
        "verdict": candidate.verdict,
        "kept": any(s.effect == candidate.effect for s in outcome.finding.steps),
        f"train_rms_{shown.suffix}": finite(stage.train_rms * shown.error_factor),
        f"selection_rms_{shown.suffix}": finite(stage.selection_rms * shown.error_factor),
        "promised": finite(candidate.promised),
        "predicted_share": finite(candidate.promised),
        "gained": finite(candidate.gained),
        "explained_share": finite(candidate.gained),
        "gain": finite(candidate.gain),
        "behind": finite(candidate.behind),
        "criterion_behind_best": finite(candidate.behind),
        "note": candidate.note,
    }
