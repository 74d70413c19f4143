"""Run a dielectric-elastomer rig, record it, and find what its model lacks.

::

    import dearig

    run = dearig.record("thesis", rig="sim")
    fit = dearig.identify(run)
    fit.save("model.toml")

``open``, ``record``, ``identify``, ``validate``, ``simulate``, ``sense``, ``diagnose``,
``invert``, ``track``, ``hold``, ``study`` and ``trends`` take objects or paths and return values
that a notebook displays and that have ``plot``, ``to_html`` and ``save``. Nothing is printed;
errors are ``DearigError``, each a sentence that says what to do.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from dearig.api.analysis import diagnose, identify, simulate, validate
    from dearig.api.holding import HoldOptions, HoldResult, hold
    from dearig.api.models import Model, export_model
    from dearig.api.predictions import Prediction
    from dearig.api.recordings import Recording, open, record  # noqa: A004
    from dearig.api.results import DiagnoseResult, IdentifyResult, ValidateResult
    from dearig.api.sensing import SenseResult, sense
    from dearig.api.sequences import Sequence
    from dearig.api.studies import StudyResult, TrendsResult, study, trends
    from dearig.api.tracking import Inversion, TrackResult, invert, track
    from dearig.errors import (
        DearigError,
        DiskFault,
        InputError,
        InstrumentFault,
        Interrupted,
        NotSafe,
        SafetyStop,
    )

    __version__: str

__all__ = [
    "DearigError",
    "DiagnoseResult",
    "DiskFault",
    "HoldOptions",
    "HoldResult",
    "IdentifyResult",
    "InputError",
    "InstrumentFault",
    "Interrupted",
    "Inversion",
    "Model",
    "NotSafe",
    "Prediction",
    "Recording",
    "SafetyStop",
    "SenseResult",
    "Sequence",
    "StudyResult",
    "TrackResult",
    "TrendsResult",
    "ValidateResult",
    "__version__",
    "diagnose",
    "export_model",
    "hold",
    "identify",
    "invert",
    "open",
    "record",
    "sense",
    "simulate",
    "study",
    "track",
    "trends",
    "validate",
]

# each name is imported when it is first used: ``import dearig`` takes no time
_MODULES = {
    "dearig.api.analysis": ("diagnose", "identify", "simulate", "validate"),
    "dearig.api.holding": ("HoldOptions", "HoldResult", "hold"),
    "dearig.api.models": ("Model", "export_model"),
    "dearig.api.predictions": ("Prediction",),
    "dearig.api.recordings": ("Recording", "open", "record"),
    "dearig.api.results": ("DiagnoseResult", "IdentifyResult", "ValidateResult"),
    "dearig.api.sensing": ("SenseResult", "sense"),
    "dearig.api.sequences": ("Sequence",),
    "dearig.api.studies": ("StudyResult", "TrendsResult", "study", "trends"),
    "dearig.api.tracking": ("Inversion", "TrackResult", "invert", "track"),
    "dearig.errors": (
        "DearigError",
        "DiskFault",
        "InputError",
        "InstrumentFault",
        "Interrupted",
        "NotSafe",
        "SafetyStop",
    ),
}
_HOME = {name: module for module, names in _MODULES.items() for name in names}


def __getattr__(name: str) -> object:
    """Import what ``name`` stands for."""
    import importlib

    if name == "__version__":
        from importlib.metadata import version

        return version("dearig")
    if name not in _HOME:
        raise AttributeError(f"module 'dearig' has no attribute {name!r}")
    value = getattr(importlib.import_module(_HOME[name]), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    """Return the names of the interface."""
    return sorted(__all__)
