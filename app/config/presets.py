"""Presets: the sequences of the thesis, and a richer one."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType

from dearig.model.simulation.excitation import THESIS_AMPLITUDES, THESIS_FREQUENCIES

__all__ = ["PRESETS", "VALIDATION_A", "VALIDATION_B"]


def _thesis(name: str, amplitudes_kV: list[float], frequencies_Hz: list[float]) -> str:
    return (
        f'name = "{name}"\n'
        f"[[segment]]\n"
        f'kind = "thesis"\n'
        f"amplitudes_kV = {amplitudes_kV}\n"
        f"frequencies_Hz = {frequencies_Hz}\n"
        f"periods = 2\n"
    )


_AMPLITUDES = [a / 1e3 for a in THESIS_AMPLITUDES]
_FREQUENCIES = list(THESIS_FREQUENCIES)

#: Table 4: the identification amplitudes at one frequency. Preset name to its frequency in Hz.
VALIDATION_A: Mapping[str, float] = MappingProxyType(
    {f"validation-a-{f:.1f}": f for f in _FREQUENCIES}
)
#: Table 5: one amplitude at the identification frequencies. Preset name to its amplitude in kV.
VALIDATION_B: Mapping[str, float] = MappingProxyType(
    {f"validation-b-{a:.1f}": a for a in _AMPLITUDES}
)

_RICH = """\
name = "rich"
[[segment]]
kind = "thesis"
periods = 1
[[segment]]
kind = "ramp"
to_kV = 4.0
duration_s = 1.0
[[segment]]
kind = "chirp"
amplitude_kV = 3.5
from_Hz = 0.5
to_Hz = 12.0
duration_s = 12.0
[[segment]]
kind = "ramp"
to_kV = 0.0
duration_s = 1.0
[[segment]]
kind = "steps"
levels_kV = [3.0, 7.0, 5.0, 8.0, 2.0, 6.0, 0.0]
dwell_s = 1.5
rise_s = 0.02
[[segment]]
kind = "hold"
duration_s = 2.0
"""

#: TOML of every preset by name.
PRESETS: Mapping[str, str] = MappingProxyType(
    {
        "thesis": _thesis("thesis identification", _AMPLITUDES, _FREQUENCIES),
        **{
            name: _thesis(f"validation A, f = {f} Hz", _AMPLITUDES, [f] * 5)
            for name, f in VALIDATION_A.items()
        },
        **{
            name: _thesis(f"validation B, a = {a} kV", [a] * 5, _FREQUENCIES)
            for name, a in VALIDATION_B.items()
        },
        "rich": _RICH,
    }
)
