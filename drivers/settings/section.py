"""Common base of all tables of a rig file."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field

__all__ = [
    "Action",
    "AnalogInput",
    "AnalogOutput",
    "DigitalLine",
    "InputRange",
    "Section",
    "Wiring",
]

AnalogInput = Annotated[str, Field(pattern=r"^ai[0-9]{1,2}$")]
DigitalLine = Annotated[str, Field(pattern=r"^port[0-9]/line[0-9]{1,2}$")]
AnalogOutput = Annotated[str, Field(pattern=r"^ao[0-9]{1,2}$")]
InputRange = Annotated[float, Field(ge=0.1, le=10.0)]
Wiring = Literal["DIFF", "RSE", "NRSE"]
Action = Literal["ramp", "at once"]


class Section(BaseModel):
    """Table of a rig file: immutable, no unknown keys, no text for numbers, no NaN or inf."""

    model_config = ConfigDict(frozen=True, extra="forbid", strict=True, allow_inf_nan=False)
