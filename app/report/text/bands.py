"""Sentences on the band of a prediction: what it consists of, and where it may be too narrow."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from dearig.report.text.excitation import bands_text
from dearig.report.text.numbers import significant
from dearig.report.text.sentences import listed
from dearig.units import SHOWN

if TYPE_CHECKING:
    import numpy as np

    from dearig.analysis.readings.band import PredictionBand

__all__ = ["NO_BAND", "band_json", "band_texts"]

#: Of a model whose file has no covariance.
NO_BAND = (
    "no band: the model file has no covariance of its parameters, which a fit with intervals writes"
)
_NAMED = 3  # recordings that are named


def band_texts(band: PredictionBand, kind: str, error: np.ndarray | None = None) -> tuple[str, ...]:
    """Return sentences on a ``band`` of a recording of ``kind``.

    ``error`` (N,) in m or Pa is measured less model, where that is known; NaN is not a reading.
    """
    from dearig.analysis.readings.band import TRAINING

    shown = SHOWN[kind]

    def size(value: float) -> str:
        return f"{significant(value * shown.error_factor)} {shown.error_unit}"

    holds = ""
    if error is not None:
        holds = f"; it holds {significant(100.0 * band.inside(error))} % of them"
    law = "the error of the law is not known"
    if band.law_of:
        names = listed(band.law_from[:_NAMED])
        more = len(band.law_from) - _NAMED
        names += f" and {more} more" if more > 0 else ""
        law = f"law {size(band.law)}, by the errors on {names}"
        if band.law_of == TRAINING:
            law += ", to which the model was fitted: on others it may be larger"
    said = [
        f"95 % band of a reading{holds}",
        f"standard deviations: parameters {size(band.parameters_rms)} RMS, "
        f"noise {size(band.noise)}, {law}",
    ]
    if band.beyond is not None:
        where = []
        if band.beyond.levels:
            where.append("voltages or displacements that they do not reach")
        if band.beyond.bands:
            where.append(f"motion {bands_text(band.beyond.bands)}")
        said.append(
            f"the drive goes beyond what the training recordings show ({' and '.join(where)}): "
            f"there the band may be too narrow"
        )
    return tuple(f"{text[0].upper()}{text[1:]}." for text in said)


def band_json(
    band: PredictionBand | None, kind: str, error: np.ndarray | None = None
) -> dict[str, Any] | None:
    """Return standard deviations and caveats of a ``band`` as plain values; None without one."""
    if band is None:
        return None
    shown = SHOWN[kind]
    parts = {
        "parameters": band.parameters_rms,
        "noise": band.noise,
        "law": band.law if band.law_of else None,
    }
    beyond = band.beyond
    return {
        **{
            f"{name}_{shown.suffix}": None if size is None else size * shown.error_factor
            for name, size in parts.items()
        },
        "law_of": band.law_of or None,
        "law_from": list(band.law_from),
        "inside_pct": None if error is None else 100.0 * band.inside(error),
        "beyond_training": None
        if beyond is None
        else {"levels": beyond.levels, "bands_Hz": [[b.low, b.high] for b in beyond.bands]},
    }
