"""Figures of what was measured, what the model says, and what lies between."""

from __future__ import annotations

import io
import math
import re
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Any
from xml.sax.saxutils import quoteattr

import numpy as np

from dearig.analysis.decimate import decimate, decimate_path
from dearig.analysis.residual import autocorrelation, even, spectrum
from dearig.report.numbers import power_of_ten, significant, symbol
from dearig.units import SHOWN, Shown, parameter_unit

if TYPE_CHECKING:  # matplotlib takes most of a second to load: only a command that draws waits
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes
    from matplotlib.axis import Axis
    from matplotlib.figure import Figure, SubFigure

    from dearig.analysis.outcomes import BranchTrial, Comparison
    from dearig.model.fitting import Estimate, Identification

__all__ = [
    "COLUMNS",
    "DRIVE",
    "MARK",
    "NOISE",
    "UNSURE",
    "WIDTH",
    "blank",
    "branches_figure",
    "comparison_figure",
    "decimated_log",
    "drawable",
    "few_ticks",
    "legend",
    "log_axis",
    "loop_figure",
    "overview_figure",
    "parameters_figure",
    "residual_figure",
    "residual_panels",
    "save_png",
    "style",
    "svg",
]

#: Okabe and Ito's colours: told apart with every kind of colour vision, and in grey.
MEASURED = "#0072B2"
MODEL = "#D55E00"
ERROR = "#667085"
MARK = "#1A1A1A"
DRIVE = "#4D4D4D"
NOISE = "#C9CED6"
THESIS = "#009E73"
UNSURE = "#8A8A8A"

#: Width in inches of a figure that stays legible on a phone, where it shrinks to three quarters.
WIDTH = 4.8
#: Pixels along a time axis; a phone or a sheet of paper shows no more.
COLUMNS = 600

_STYLE = MappingProxyType(
    {
        "axes.axisbelow": True,
        "axes.edgecolor": "#404040",
        "axes.grid": True,
        "axes.labelcolor": "#111111",
        "axes.labelsize": 9.5,
        "axes.linewidth": 0.7,
        "axes.spines.right": False,
        "axes.spines.top": False,
        "axes.titlesize": 9.5,
        "axes.unicode_minus": True,
        "figure.facecolor": "white",
        "font.family": "sans-serif",
        "font.sans-serif": ["DejaVu Sans"],  # comes with matplotlib: the same everywhere
        "font.size": 9.5,
        "grid.color": "#E3E6EA",
        "grid.linewidth": 0.6,
        "legend.borderaxespad": 0.2,
        "legend.columnspacing": 1.4,
        "legend.fontsize": 9.0,
        "legend.frameon": False,
        "legend.handlelength": 1.7,
        "lines.solid_capstyle": "round",
        "path.simplify": True,
        "savefig.facecolor": "white",
        "svg.fonttype": "none",
        "svg.hashsalt": "dearig",
        "text.color": "#111111",
        "text.parse_math": False,  # a file's name may hold a dollar sign
        "xtick.color": "#404040",
        "xtick.labelcolor": "#111111",
        "xtick.labelsize": 9.0,
        "ytick.color": "#404040",
        "ytick.labelcolor": "#111111",
        "ytick.labelsize": 9.0,
    }
)


@contextmanager
def style() -> Iterator[None]:
    """Fonts, colours and lines of every figure, while it is drawn or saved."""
    from matplotlib import rc_context

    settings: Any = dict(_STYLE)  # matplotlib types its keys only in some versions
    with rc_context(settings):
        yield


def blank(width: float, height: float) -> Figure:
    """An empty figure of ``width`` and ``height`` in inches."""
    from matplotlib.figure import Figure

    return Figure(figsize=(width, height), layout="constrained")


# ---------------------------------------------------------------- handing figures on


def save_png(figure: Figure, path: str | Path, dpi: int = 200) -> Path:
    """Write ``figure`` as PNG; the file appears as a whole or not at all. Raises ``InputError``."""
    from dearig.recording.files import check_output, replaced_when_done

    path = check_output(path, overwrite=True)
    picture = io.BytesIO()
    with style():
        figure.savefig(picture, format="png", dpi=dpi)
    with replaced_when_done(path) as partial:
        partial.write_bytes(picture.getvalue())
    return path


def svg(figure: Figure, prefix: str, label: str) -> str:
    """``figure`` as an SVG element to stand inside an HTML page.

    ``prefix`` keeps its identifiers apart from other figures of that page, ``label`` says in words
    what is seen. It has no fixed size, takes the page's font, and refers to nothing outside.
    """
    stream = io.StringIO()
    with style():
        figure.savefig(stream, format="svg", metadata={"Date": None, "Creator": None})
    text = stream.getvalue()
    text = text[text.index("<svg") :]
    text = re.sub(r"\s*<metadata>.*?</metadata>", "", text, flags=re.DOTALL)
    text = re.sub(r"\s*<style [^>]*>.*?</style>", "", text, flags=re.DOTALL)
    text = re.sub(r"\s*<!--.*?-->", "", text, flags=re.DOTALL)
    # matplotlib's identifiers differ from run to run; only those that something refers to are kept
    text = re.sub(r"\bxlink:href=", "href=", text)
    used = dict.fromkeys(re.findall(r'(?:href="|url\()#([^")]+)', text))
    short = {name: f"{prefix}-{i}" for i, name in enumerate(used)}
    text = re.sub(r' id="([^"]*)"', lambda d: f' id="{short[d[1]]}"' if d[1] in short else "", text)
    text = re.sub(r'(href="|url\()#([^")]+)', lambda d: f"{d[1]}#{short[d[2]]}", text)
    text = re.sub(r' d="[^"]*"', lambda d: _rounded(d[0]), text)
    text = text.replace("'DejaVu Sans', sans-serif", "inherit").replace("'DejaVu Sans'", "inherit")
    box = re.search(r'viewBox="[^"]*"', text)
    if box is None:
        raise ValueError("the SVG that was drawn has no viewBox")
    head = (
        f'<svg {box[0]} role="img" aria-label={quoteattr(label)} '
        f'style="stroke-linejoin:round;stroke-linecap:butt">'
    )
    return head + text[text.index(">") + 1 :].strip()


def _rounded(path: str) -> str:
    """Path data to a hundredth of a point: half the bytes, and nothing that could be seen."""
    return re.sub(r"-?\d+\.\d{3,}", lambda n: f"{float(n[0]):.2f}", path)


# ---------------------------------------------------------------- figures


def comparison_figure(comparison: Comparison) -> Figure:
    """Drive, measurement beside model, and error of one recording over time (thesis Fig. 10-16)."""
    with style():
        figure = blank(WIDTH, 5.0)
        axes = figure.subplots(3, 1, sharex=True, height_ratios=(1.0, 1.7, 1.2))
        _stack(list(axes), comparison)
        figure.align_ylabels(axes)
    return figure


def loop_figure(comparison: Comparison) -> Figure:
    """Measured quantity and model against the drive: loops, whose area is what was dissipated."""
    shown = SHOWN[comparison.kind]
    with style():
        figure = blank(WIDTH, 3.4)
        ax = figure.subplots()
        drive = comparison.drive * shown.drive_factor
        for values, name, look in (
            (comparison.measured, "measured", _measured_look()),
            (comparison.model, "model", _model_look()),
        ):
            ax.plot(*decimate_path(drive, values * shown.factor, COLUMNS // 2), label=name, **look)
        ax.set_xlabel(shown.drive_label)
        ax.set_ylabel(shown.label)
        legend(ax)
    return figure


def residual_figure(comparison: Comparison) -> Figure:
    """The residual in one row: its histogram, its correlation with itself, its spectrum."""
    with style():
        figure = blank(1.6 * WIDTH, 2.7)
        for ax, draw in zip(figure.subplots(1, 3), _RESIDUAL_PANELS, strict=True):
            draw(ax, comparison)
    return figure


def residual_panels(comparison: Comparison) -> tuple[Figure, Figure, Figure]:
    """The panels of ``residual_figure`` one by one, for a page that sets them as it has room."""
    figures = []
    with style():
        for draw in _RESIDUAL_PANELS:
            figure = blank(0.6 * WIDTH, 2.5)
            draw(figure.subplots(), comparison)
            figures.append(figure)
    return figures[0], figures[1], figures[2]


def parameters_figure(fit: Identification) -> Figure:
    """Every parameter with its 95 % interval; open ends are arrows, undetermined ones are grey.

    A network of the thesis's make stands beside the thesis's Table 3.
    """
    groups = _groups(fit)
    rows = [len(g) for g in groups.values()]
    with style():
        figure = blank(WIDTH, 0.75 + 0.27 * sum(rows) + 0.62 * len(rows))
        axes = figure.subplots(len(rows), 1, squeeze=False, height_ratios=[n + 0.6 for n in rows])[
            :, 0
        ]
        for ax, (label, estimates) in zip(axes, groups.items(), strict=True):
            _intervals(ax, label, estimates, fit)
        handles: dict[str, Artist] = {}
        for ax in axes:
            for handle, name in zip(*ax.get_legend_handles_labels(), strict=True):
                handles.setdefault(name, handle)
        names = [name for name in _PARAMETER_LOOKS if name in handles]
        figure.legend([handles[name] for name in names], names, loc="outside upper left", ncols=2)
        figure.align_ylabels(axes)
    return figure


def branches_figure(trials: Sequence[BranchTrial], kind: str) -> Figure:
    """Training and validation error, and the information criterion, against number of branches."""
    shown = SHOWN[kind]
    n = np.array([t.branches for t in trials])
    train = np.array([t.train_rms for t in trials]) * shown.error_factor
    validation = np.array(
        [math.nan if t.validation_rms is None else t.validation_rms for t in trials]
    )
    bic = np.array([t.bic for t in trials])
    with style():
        figure = blank(WIDTH, 4.2)
        upper, lower = figure.subplots(2, 1, sharex=True, height_ratios=(1.5, 1.0))
        upper.plot(n, train, "o-", color=MEASURED, label="training", markersize=5)
        if np.isfinite(validation).any():
            upper.plot(
                n, validation * shown.error_factor, "s--", color=MODEL, label="validation",
                markersize=5,
            )  # fmt: skip
        finite = np.concatenate((train, validation * shown.error_factor))
        finite = finite[np.isfinite(finite)]
        if finite.size and finite.min() > 0.0 and finite.max() > 8.0 * finite.min():
            log_axis(upper, "y", 0.8 * finite.min(), 1.25 * finite.max())
        else:
            upper.set_ylim(bottom=0.0)
        upper.set_ylabel(f"RMS error ({shown.error_unit})")
        above = bic - np.nanmin(np.where(np.isfinite(bic), bic, np.nan))
        lower.plot(n, above, "D-", color=MARK, markersize=4.5)
        # the decision is made among the smallest values, while the first can be thousands above
        lower.set_yscale("symlog", linthresh=10.0)
        _log_ticks(lower.yaxis)
        lower.set_ylim(bottom=-2.0)
        lower.set_ylabel("BIC above\nits minimum")
        lower.set_xlabel("Number of branches")
        lower.set_xticks(n)
        for i, ax in enumerate((upper, lower)):
            for trial in trials:
                if trial.chosen:
                    ax.axvline(
                        trial.branches, color=THESIS, linewidth=7, alpha=0.25, zorder=0,
                        label="chosen" if i == 0 else None,
                    )  # fmt: skip
        legend(upper, 3)
        figure.align_ylabels([upper, lower])
    return figure


def overview_figure(train: Comparison, validation: Sequence[Comparison]) -> Figure:
    """One picture of a whole identification: its training run, and its error on every other."""
    bars = len(validation)
    with style():
        figure = blank(1.2 * WIDTH, 5.6 + (0.9 + 0.24 * bars if bars else 0.0))
        upper: Figure | SubFigure = figure
        if bars:
            halves = figure.subfigures(2, 1, squeeze=False, height_ratios=(5.6, 0.9 + 0.24 * bars))[
                :, 0
            ]
            upper = halves[0]
            _validation_bars(halves[1].subplots(), train, validation)
        stacked = list(upper.subplots(3, 1, sharex=True, height_ratios=(1.0, 1.7, 1.2)))
        _stack(stacked, train)
        upper.align_ylabels(stacked)
    return figure


# ---------------------------------------------------------------- panels


def _measured_look() -> dict[str, Any]:
    return {"color": MEASURED, "linewidth": 1.9}


def _model_look() -> dict[str, Any]:
    # thin and dashed on top of thick and solid: where they agree, both are seen
    return {"color": MODEL, "linewidth": 1.1, "dashes": (4, 1.6)}


def _stack(axes: list[Axes], comparison: Comparison) -> None:
    shown = SHOWN[comparison.kind]
    drive, both, error = axes
    time = comparison.time
    log = _is_hold(comparison)
    if log:
        time = time - time[0]

    def curve(values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        # the first sample lies at time zero, where a logarithmic axis never gets
        return decimated_log(time[1:], values[1:]) if log else decimate(time, values, COLUMNS)

    drive.plot(*curve(comparison.drive * shown.drive_factor), color=DRIVE, linewidth=1.2)
    drive.set_ylabel(shown.drive_label)
    both.plot(*curve(comparison.measured * shown.factor), label="measured", **_measured_look())
    both.plot(*curve(comparison.model * shown.factor), label="model", **_model_look())
    both.set_ylabel(shown.label)
    legend(both)
    _noise_band(error, comparison, shown)
    error.plot(
        *curve((comparison.measured - comparison.model) * shown.error_factor),
        color=ERROR,
        linewidth=0.8,
    )
    error.set_ylabel(shown.error_label)
    if log:
        error.set_xlabel("Time since the start (s)")
        log_axis(error, "x", time[1], time[-1])
    else:
        error.set_xlabel("Time (s)")
        error.set_xlim(time[0], time[-1])
    for ax in axes:
        few_ticks(ax, y=5)


def _is_hold(comparison: Comparison) -> bool:
    """Whether the drive stood still for nearly all of a film's record, as in a relaxation test.

    There everything happens early, and is only seen over the logarithm of time.
    """
    if comparison.kind != "film" or comparison.time.size < 3:
        return False
    drive = comparison.drive
    moving = np.flatnonzero(np.abs(drive - drive[-1]) > 0.01 * float(np.ptp(drive)))
    if moving.size == 0:
        return False
    since = comparison.time - comparison.time[0]
    return bool(since[moving[-1]] < 0.1 * since[-1])


def _noise_band(ax: Axes, comparison: Comparison, shown: Shown) -> None:
    if comparison.noise is not None:
        floor = comparison.noise * shown.error_factor
        ax.axhspan(-floor, floor, color=NOISE, linewidth=0, zorder=0.5)
        for i, edge in enumerate((-floor, floor)):
            # on top as well: where the error is nothing but noise, it covers the band
            ax.axhline(
                edge, color=MARK, linewidth=0.8, linestyle=(0, (3, 2)), zorder=4,
                label=None if i else
                f"\N{PLUS-MINUS SIGN} noise floor, {significant(floor)} {shown.error_unit}",
            )  # fmt: skip
        legend(ax)
    ax.axhline(0.0, color=UNSURE, linewidth=0.6, zorder=0.6)


def _histogram(ax: Axes, comparison: Comparison) -> None:
    shown = SHOWN[comparison.kind]
    residual = _residual(comparison) * shown.error_factor
    # a few stray samples must not squeeze everything else into one bar
    centre = float(np.median(residual))
    reach = min(4.5 * float(np.std(residual)), 1.1 * float(np.max(np.abs(residual - centre))))
    noise = None if comparison.noise is None else comparison.noise * shown.error_factor
    reach = max(reach, 4.0 * noise if noise else 0.0) or 1.0
    bins = int(np.clip(math.sqrt(residual.size), 12, 60))
    counts, edges = np.histogram(residual, bins, (centre - reach, centre + reach))
    width = edges[1] - edges[0]
    ax.bar(
        edges[:-1], counts / (residual.size * width), width, align="edge", color=MEASURED,
        label="residual",
    )  # fmt: skip
    if noise:
        x = np.linspace(edges[0], edges[-1], 201)
        bell = np.exp(-0.5 * (x / noise) ** 2) / (noise * math.sqrt(2.0 * math.pi))
        ax.plot(x, bell, color=MODEL, linewidth=1.4, label="noise")
        # noise far below the residual is a needle: cut it, rather than flatten the histogram
        tallest = float(counts.max()) / (residual.size * width)
        ax.set_ylim(0.0, 1.08 * max(tallest, min(float(bell.max()), 2.0 * tallest)))
    ax.set_xlim(edges[0], edges[-1])
    ax.set_xlabel(shown.error_label)
    ax.set_ylabel(f"Density (1/{shown.error_unit})")
    few_ticks(ax, x=4, y=4)
    legend(ax)


def _correlation(ax: Axes, comparison: Comparison) -> None:
    step, residual = even(comparison.time, _residual(comparison))
    lag, correlation = autocorrelation(step, residual)
    chance = 2.0 / math.sqrt(residual.size)
    ax.axhspan(-chance, chance, color=NOISE, linewidth=0, zorder=0.5, label="chance, 95 %")
    ax.axhline(0.0, color=UNSURE, linewidth=0.6, zorder=0.6)
    ax.plot(*decimated_log(lag, correlation), color=MEASURED, linewidth=1.1)
    log_axis(ax, "x", lag[0], lag[-1])
    ax.set_ylim(min(-0.25, 1.1 * float(correlation.min())), 1.05)
    ax.set_yticks([-0.5, 0.0, 0.5, 1.0] if correlation.min() < -0.4 else [0.0, 0.5, 1.0])
    ax.set_xlabel("Lag (s)")
    ax.set_ylabel("Autocorrelation")
    legend(ax)


def _spectrum(ax: Axes, comparison: Comparison) -> None:
    shown = SHOWN[comparison.kind]
    step, residual = even(comparison.time, _residual(comparison) * shown.error_factor)
    frequency, density = spectrum(step, residual)
    ax.plot(*decimated_log(frequency, density), color=MEASURED, linewidth=1.1)
    if comparison.noise:
        level = comparison.noise * shown.error_factor * math.sqrt(2.0 * step)
        ax.axhline(level, color=MODEL, linewidth=1.4, label="white noise")
        legend(ax)
    log_axis(ax, "x", frequency[0], frequency[-1])
    highest = float(density.max())
    if highest > 0.0:
        log_axis(ax, "y", 0.7 * max(float(density.min()), 1e-5 * highest), 1.4 * highest)
    ax.set_xlabel("Frequency (Hz)")
    ax.set_ylabel(f"Density ({shown.error_unit}/\N{SQUARE ROOT}Hz)")


_RESIDUAL_PANELS: tuple[Callable[[Axes, Comparison], None], ...] = (
    _histogram,
    _correlation,
    _spectrum,
)


def _residual(comparison: Comparison) -> np.ndarray:
    residual = comparison.measured - comparison.model
    return np.where(np.isfinite(residual), residual, 0.0)


def _groups(fit: Identification) -> dict[str, list[Estimate]]:
    """Estimates by what they are, under the label of their axis."""
    labels = {"mu": "Modulus", "J": "Locking limit", "T": "Relaxation time"}
    groups: dict[str, list[Estimate]] = {}
    for e in fit.estimates:
        what = labels.get(e.name.partition("_")[0], e.name)
        unit = parameter_unit(e.unit)[1]
        groups.setdefault(f"{what} ({unit})" if unit else what, []).append(e)
    return groups


_FITTED = "fitted, with 95 % interval"
_BARE = "fitted, no interval"
_FOLLOWS = "follows from other numbers"
_UNDETERMINED = "not determined by these data"
_TABLE_3 = "thesis, Table 3"
_PARAMETER_LOOKS = (_FITTED, _BARE, _FOLLOWS, _UNDETERMINED, _TABLE_3)


def _intervals(ax: Axes, label: str, estimates: Sequence[Estimate], fit: Identification) -> None:
    from dearig.report.thesis import table_3

    known = fit.covariance.size > 0
    published = table_3(fit.model)
    factor = parameter_unit(estimates[0].unit)[0]
    beside = [published[e.name] for e in estimates if e.name in published]
    ends = np.array([x for e in estimates for x in (e.value, e.low, e.high)] + beside) * factor
    ends = ends[np.isfinite(ends)]
    log = not (ends < 0.0).any()
    if log:
        ends = ends[ends > 0.0] if (ends > 0.0).any() else np.array([1.0])
        left, right = ends.min() / 2.5, ends.max() * 2.5
        # a whole decade at least, or the axis would have no label
        spare = max(0.0, 1.2 - math.log10(right / left)) / 2.0
        left, right = left * 10.0**-spare, right * 10.0**spare
    else:
        margin = 0.1 * float(np.ptp(ends)) or 1.0
        left, right = ends.min() - margin, ends.max() + margin
    for row, e in enumerate(estimates):
        colour = MEASURED if e.determined or not known else UNSURE
        value = float(np.clip(e.value * factor, left, right))
        if e.free and known:
            _interval(ax, row, e.low * factor, e.high * factor, (left, right), colour)
        if not e.free:
            marker, name = "s", _FOLLOWS
        elif e.determined or not known:
            marker, name = "o", _FITTED if known else _BARE
        else:
            marker, name = "o", _UNDETERMINED
        hollow = known and not e.determined
        ax.plot(
            [value], [row], marker, color=colour, markersize=5.5, label=name, linestyle="none",
            markerfacecolor="white" if hollow else colour, zorder=3,
        )  # fmt: skip
        if e.name in published:
            ax.plot(
                [published[e.name] * factor], [row + 0.27], "D", color=THESIS, markersize=3.6,
                label=_TABLE_3, linestyle="none", zorder=2.5,
            )  # fmt: skip
    if log:
        log_axis(ax, "x", left, right)
    else:
        ax.set_xlim(left, right)
    ax.set_ylim(len(estimates) - 0.4, -0.6)
    ax.set_yticks(range(len(estimates)), [drawable(symbol(e.name), 18) for e in estimates])
    ax.grid(visible=False, axis="y")
    ax.set_xlabel(drawable(label, 60), labelpad=1.5)


def _interval(
    ax: Axes, row: int, low: float, high: float, limits: tuple[float, float], colour: str
) -> None:
    """A bar with an end stop where the interval ends, and an arrow where it does not."""
    left, right = limits
    ends = (left if low == 0.0 else low, right if math.isinf(high) else high)
    ax.plot(ends, [row, row], color=colour, linewidth=1.6, solid_capstyle="butt", zorder=2)
    for end, is_open, arrow in (
        (ends[0], low == 0.0, "<"),
        (ends[1], math.isinf(high), ">"),
    ):
        ax.plot(
            [end], [row], arrow if is_open else "|", color=colour, markersize=6, zorder=2.2,
            clip_on=False, linestyle="none",
        )  # fmt: skip


def _validation_bars(ax: Axes, train: Comparison, validation: Sequence[Comparison]) -> None:
    shown = SHOWN[train.kind]
    names = {"A": "one frequency", "B": "one amplitude", "": "other recordings"}
    colours = {"A": MEASURED, "B": "#E69F00", "": DRIVE}
    rms = np.array([c.errors.rms for c in validation]) * shown.error_factor
    finite = rms[np.isfinite(rms)]
    floors = [c.noise for c in validation if c.noise is not None]
    longest = float(finite.max()) if finite.size else 1.0
    labelled = set()
    for row, comparison in enumerate(validation):
        length = rms[row] if math.isfinite(rms[row]) else longest
        ax.barh(
            row, length, height=0.68, color=colours[comparison.table],
            label=None if comparison.table in labelled else names[comparison.table],
        )  # fmt: skip
        labelled.add(comparison.table)
        ax.annotate(
            significant(float(rms[row])), (length, row), (3, 0), textcoords="offset points",
            va="center", fontsize=8.5,
        )  # fmt: skip
    if floors:
        floor = float(np.median(floors)) * shown.error_factor
        ax.axvline(floor, color=MARK, linewidth=1.1, linestyle=(0, (3, 2)), label="noise floor")
    ax.set_yticks(range(len(validation)), [drawable(c.row or c.name, 24) for c in validation])
    ax.set_ylim(len(validation) - 0.4, -0.6)
    ax.set_xlim(0.0, 1.12 * longest or 1.0)
    ax.grid(visible=False, axis="y")
    ax.set_xlabel(f"RMS error on recordings the fit did not see ({shown.error_unit})")
    legend(ax, 4)


# ---------------------------------------------------------------- small parts


def legend(ax: Axes, columns: int = 2) -> None:
    """A legend above the axes, where no curve can run through it."""
    ax.legend(loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=columns)


def few_ticks(ax: Axes, x: int | None = None, y: int | None = None) -> None:
    """At most about ``x`` and ``y`` ticks."""
    from matplotlib.ticker import MaxNLocator

    if x is not None:
        ax.xaxis.set_major_locator(MaxNLocator(x))
    if y is not None:
        ax.yaxis.set_major_locator(MaxNLocator(y, min_n_ticks=3))


def log_axis(ax: Axes, which: str, low: float, high: float) -> None:
    """A logarithmic axis from ``low`` to ``high`` > 0, with a few labels but at least two."""
    from matplotlib.ticker import LogLocator, NullFormatter

    low, high = float(low), max(float(high), 1.1 * float(low))
    axis = ax.xaxis if which == "x" else ax.yaxis
    (ax.set_xscale if which == "x" else ax.set_yscale)("log")
    (ax.set_xlim if which == "x" else ax.set_ylim)(low, high)
    decades = math.floor(math.log10(high)) - math.ceil(math.log10(low)) + 1
    axis.set_major_locator(LogLocator(subs=(1.0,) if decades > 1 else (1.0, 2.0, 5.0), numticks=6))
    axis.set_minor_locator(LogLocator(subs=range(2, 10), numticks=12))
    axis.set_minor_formatter(NullFormatter())
    _log_ticks(axis)


def _log_ticks(axis: Axis) -> None:
    """Labels 0.1, 1, 10 where the axis stays among such numbers, else powers of ten."""
    from matplotlib.ticker import FuncFormatter

    def label(value: float, _: int | None) -> str:
        low, high = axis.get_view_interval()
        if value == 0.0 or (abs(high) < 3e4 and (low <= 0.0 or low > 3e-4)):
            return f"{value:g}"
        exponent = math.floor(math.log10(abs(value)) + 1e-9)
        mantissa = value / 10.0**exponent
        power = power_of_ten(exponent)
        return power if abs(mantissa - 1.0) < 1e-6 else f"{mantissa:.3g}\N{MIDDLE DOT}{power}"

    axis.set_major_formatter(FuncFormatter(label))


def decimated_log(x: np.ndarray, y: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """A curve for a logarithmic axis of ``x`` (N,) > 0, made short."""
    log_x, kept = decimate(np.log(x), y, COLUMNS // 2)
    return np.exp(log_x), kept


def drawable(text: str, longest: int) -> str:
    """``text`` with what the font has, and no longer than there is room for.

    The full name, in any script, stands in the page around the figure.
    """
    kept = "".join(
        c if c.isprintable() and (ord(c) < 0x530 or 0x2000 <= ord(c) < 0x2100) else "?"
        for c in text
    )
    if len(kept) <= longest:
        return kept
    half = (longest - 1) // 2
    return f"{kept[:half]}\N{HORIZONTAL ELLIPSIS}{kept[len(kept) - (longest - 1 - half) :]}"
