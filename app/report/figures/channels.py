"""Figures of electrical channels: readings with predictions, and what each says of families."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from dearig.analysis.decimate import decimate
from dearig.report.figures import style as base
from dearig.report.figures.defaults import style, text_size
from dearig.report.text.channels import channel_title
from dearig.report.text.numbers import significant
from dearig.units import SHOWN_CHANNELS

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from dearig.model.fitting.channels import ChannelCurve

__all__ = ["channel_figure", "evidence_figure"]

_NAME = 30
#: Colours of the channels, by their order in the evidence.
_COLOURS = ("#0072B2", "#E69F00", "#009E73")
#: Linear part of the axis of evidence: where one explanation is not preferred to another.
_LINEAR = 10.0


def channel_figure(curves: Sequence[tuple[str, str, ChannelCurve]]) -> Figure:
    """Draw the readings of one channel with predictions, and the residual of each.

    ``curves`` are (name, colour, curve) of the models, of the same readings.
    """
    first = curves[0][2]
    shown = SHOWN_CHANNELS[first.name]
    with style():
        figure = base.blank(base.WIDTH, 2.2 + 1.1 * len(curves))
        axes = figure.subplots(
            1 + len(curves), 1, sharex=True, height_ratios=(1.7, *(1.0 for _ in curves))
        )
        both = axes[0]
        both.plot(
            *decimate(first.time, first.measured * shown.factor, base.COLUMNS),
            color=base.MARK, linewidth=2.0, alpha=0.4, label="measured",
        )  # fmt: skip
        dashes = ((4, 1.6), (1.5, 1.2))
        for ax, (name, colour, curve), dash in zip(axes[1:], curves, dashes, strict=False):
            both.plot(
                *decimate(curve.time, curve.predicted * shown.factor, base.COLUMNS),
                color=colour, linewidth=1.0, dashes=dash, label=name,
            )  # fmt: skip
            noise = curve.noise * shown.error_factor
            for edge in (-noise, noise):
                ax.axhline(edge, color=base.MARK, linewidth=0.8, linestyle=(0, (3, 2)), zorder=4)
            ax.axhline(0.0, color=base.UNSURE, linewidth=0.6, zorder=0.6)
            ax.plot(
                *decimate(curve.time, curve.residual * shown.error_factor, base.COLUMNS),
                color=colour, linewidth=0.8,
            )  # fmt: skip
            left = significant(curve.rms * shown.error_factor)
            ax.set_title(
                f"{name}: {left} {shown.error_unit} RMS",
                loc="left", fontsize=text_size(9.0), pad=2.5,
            )  # fmt: skip
            ax.set_ylabel(shown.error_label.replace(" (", "\n("))
        both.set_ylabel(shown.label.replace(" (", "\n("))
        base.legend(both, 3)
        axes[-1].set_xlabel("Time (s)")
        axes[-1].set_xlim(first.time[0], first.time[-1])
        for ax in axes:
            base.few_ticks(ax, y=4)
        figure.align_ylabels(axes)
    return figure


def evidence_figure(
    evidence: Sequence[tuple[str, Sequence[tuple[str, float]]]],
) -> Figure:
    """Draw what each channel adds to the criterion of each leading family.

    ``evidence`` are (family, ((channel, gain), ...)). The axis is linear up to 10 and logarithmic
    beyond, as one channel may say a thousand times as much as another.
    """
    channels = tuple(dict.fromkeys(name for _, said in evidence for name, _ in said))
    rows, height = np.arange(len(evidence)), 0.8 / len(channels)
    with style():
        figure = base.blank(base.WIDTH, 0.9 + (0.16 + 0.17 * len(channels)) * len(evidence))
        ax = figure.subplots()
        largest = _LINEAR
        for i, (name, colour) in enumerate(zip(channels, _COLOURS, strict=False)):
            values = np.array([dict(said).get(name, 0.0) for _, said in evidence])
            places = rows + (i - 0.5 * (len(channels) - 1)) * height
            ax.barh(places, values, height=0.9 * height, color=colour, label=channel_title(name))
            largest = max(largest, float(values.max()))
            for place, value in zip(places, values, strict=True):
                ax.annotate(
                    f"{value:+,.0f}" if abs(value) >= 0.5 else "0",
                    (value, place), (3 if value >= 0.0 else -3, 0), textcoords="offset points",
                    va="center", ha="left" if value >= 0.0 else "right", fontsize=text_size(8.0),
                )  # fmt: skip
        ax.axvline(0.0, color=base.UNSURE, linewidth=0.8)
        least = min((v for _, said in evidence for _, v in said), default=0.0)
        _evidence_axis(ax, min(least, 0.0), largest)
        # of two families each has its line
        names = [
            " +\n".join(base.drawable(part, _NAME) for part in family.split(" + "))
            for family, _ in evidence
        ]
        ax.set_yticks(rows, names)
        ax.set_ylim(len(evidence) - 0.5, -0.5)
        ax.grid(visible=False, axis="y")
        ax.set_xlabel("Gain of the criterion\nover the plain model")
        base.legend(ax, 3)
    return figure


def _evidence_axis(ax: Axes, low: float, high: float) -> None:
    """Make the horizontal axis linear up to 10 and logarithmic beyond, with room for numbers."""
    from matplotlib.ticker import FixedLocator, NullLocator

    ax.set_xscale("symlog", linthresh=_LINEAR)
    ends = (-_LINEAR if low > -1.0 else -max(500.0 * -low, 500.0), 200.0 * high)
    decades = math.log10(max(high, -low) / _LINEAR)
    step = max(1, math.ceil(decades / 2.0))
    ticks = [_LINEAR * 10.0 ** (step * i) for i in range(int(decades / step) + 1)]
    inside = [t for t in (0.0, *ticks, *(-t for t in ticks)) if 1.2 * low <= t <= 1.2 * high]
    ax.xaxis.set_major_locator(FixedLocator(inside))
    ax.xaxis.set_minor_locator(NullLocator())
    ax.xaxis.set_major_formatter(lambda value, _: f"{value:,.0f}")
    ax.set_xlim(*ends)
