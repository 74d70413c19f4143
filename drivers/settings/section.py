"""Common base of all tables of a rig file."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field, field_validator

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


#: In any unit of a rig file, far below what an instrument or a film may have. Smaller numbers are
#: slips, and make infinities where something is divided by them.
_LEAST = 1e-12


class Section(BaseModel):
    """Table of a rig file: immutable, no unknown keys, no text for numbers, no NaN or inf."""

    model_config = ConfigDict(frozen=True, extra="forbid", strict=True, allow_inf_nan=False)

    @field_validator("*")
    @classmethod
    def _is_no_trace(cls, value: object) -> object:
        if isinstance(value, float) and 0.0 < abs(value) < _LEAST:
            raise ValueError("it is too small to be meant")
        return value
