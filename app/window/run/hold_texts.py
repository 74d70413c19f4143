"""Texts on a hold, before and during its run."""

from __future__ import annotations

import math

from dearig.analysis.hold import HoldPlan
from dearig.model.control import HoldAnswer
from dearig.report.text.numbers import seconds

__all__ = ["answer_text", "hold_text"]


def hold_text(planned: HoldPlan) -> str:
    """Return a sentence on a hold before its run."""
    feedback = planned.feedback
    return (
        f"Feedback holds {feedback.setpoint * 1e3:.4g} mm for "
        f"{seconds(feedback.stop - feedback.start)} and corrects the voltage by up to "
        f"{feedback.authority:.3g} of it. Any change of the sequence, the rig or the film removes "
        f"it."
    )


def answer_text(answer: HoldAnswer) -> tuple[str, str]:
    """Return a sentence on the newest answer of a feedback, and its role."""
    # + 0.0 turns a negative zero into zero
    off = round(answer.error * 1e6, 1) + 0.0
    error = "no usable reading" if math.isnan(off) else f"{off:+.1f} µm"
    said = f"Hold: error {error}, correction {round(answer.correction, 4) + 0.0:+.2%}"
    states = {
        "limited": " · the correction stands at its limit: the displacement is not held",
        "frozen": " · the readings cannot be used: the correction stays as it is",
    }
    return f"{said}{states.get(answer.state, '')}", "" if answer.state == "holding" else "warn"
