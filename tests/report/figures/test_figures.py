from __future__ import annotations

import math
import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from dearig.analysis.decimate import decimate, decimate_path
from dearig.analysis.residual import autocorrelation, even, spectrum
from dearig.errors import InputError
from dearig.report.figures import recordings as figures
from dearig.report.figures import style as figure_style
from dearig.report.figures.export import save_png, svg
from dearig.report.figures.parameters import (
    branches_figure,
    correlation_columns,
    correlation_figure,
    parameters_figure,
    starts_columns,
    starts_figure,
)
from dearig.report.figures.residual import residual_figure, residual_panels
from tests.deep import mostly_deep
from tests.tools.reports import (
    TRIALS,
    actuator_comparison,
    film_comparison,
    fit,
    validation_runs,
    without_intervals,
)


def line(axes, label: str):
    return next(found for found in axes.lines if found.get_label() == label)


class TestDecimation:
    values = hnp.arrays(
        np.float64,
        st.integers(1, 3000),
        elements=st.floats(-1e6, 1e6) | st.just(math.nan),
        fill=st.floats(-1.0, 1.0),
    )

    @settings(max_examples=60)
    @given(values, st.integers(1, 200), st.booleans())
    def test_keeps_extremes_ends_and_order(self, y, columns, uneven):
        x = np.arange(float(y.size)) ** (1.7 if uneven else 1.0)
        kept_x, kept_y = decimate(x, y, columns)
        assert kept_x.size == kept_y.size <= max(2 * columns + 2, 1)
        assert np.all(np.diff(kept_x) > 0.0)
        assert (kept_x[0], kept_x[-1]) == (x[0], x[-1])
        rows = np.searchsorted(x, kept_x)
        np.testing.assert_array_equal(y[rows], kept_y)
        if np.isfinite(y).any():
            assert np.nanmin(kept_y) == np.nanmin(y)
            assert np.nanmax(kept_y) == np.nanmax(y)

    @settings(max_examples=40)
    @given(st.integers(100, 5000), st.integers(1, 40), st.integers(0, 10_000))
    def test_keeps_extremes_of_every_column(self, size, columns, seed):
        x = np.sort(np.random.default_rng(seed).uniform(0.0, 1.0, size))
        x[0], x[-1] = 0.0, 1.0
        x = np.unique(x)
        y = np.random.default_rng(seed + 1).standard_normal(x.size)
        kept_x, kept_y = decimate(x, y, columns)
        column = np.minimum((x * columns).astype(int), columns - 1)
        kept_column = np.minimum((kept_x * columns).astype(int), columns - 1)
        for c in np.unique(column):
            assert y[column == c].min() == kept_y[kept_column == c].min()
            assert y[column == c].max() == kept_y[kept_column == c].max()

    def test_one_spike_in_a_million_samples_is_kept(self):
        y = np.zeros(1_000_000)
        y[765_432] = 3.0
        x, kept = decimate(np.arange(y.size) * 1e-4, y, 600)
        assert kept.size <= 1202
        assert x[np.argmax(kept)] == pytest.approx(76.5432)

    def test_a_gap_breaks_the_line(self):
        y = np.ones(10_000)
        y[4000:6000] = np.inf
        _, kept = decimate(np.arange(10_000.0), y, 100)
        assert np.isnan(kept).any()
        assert not np.isinf(kept).any()

    def test_a_loop_keeps_the_extremes_of_both(self):
        angle = np.linspace(0.0, 2.0 * np.pi, 50_000)
        x, y = decimate_path(np.cos(angle), np.sin(angle), 100)
        assert x.size <= 402
        assert (x.min(), x.max()) == (np.cos(angle).min(), np.cos(angle).max())
        assert (y.min(), y.max()) == (np.sin(angle).min(), np.sin(angle).max())

    @pytest.mark.parametrize(
        ("x", "y", "columns", "words"),
        [
            (np.zeros(3), np.zeros(4), 5, "one length"),
            (np.arange(3.0), np.zeros(3), 0, "1 or more"),
            (np.zeros(99), np.zeros(99), 5, "must increase"),
        ],
    )
    def test_refuses(self, x, y, columns, words):
        with pytest.raises(ValueError, match=words):
            decimate(x, y, columns)


class TestResidual:
    def test_noise_is_uncorrelated_and_flat(self):
        noise = np.random.default_rng(3).standard_normal(20_000)
        lag, correlation = autocorrelation(0.01, noise)
        assert lag[0] == pytest.approx(0.01)
        assert np.abs(correlation).max() < 0.05
        frequency, density = spectrum(0.01, noise)
        assert frequency[-1] == pytest.approx(50.0)
        assert np.sqrt(np.mean(density**2)) == pytest.approx(math.sqrt(2.0 * 0.01), rel=0.03)

    def test_a_constant_is_correlated_with_itself(self):
        _, correlation = autocorrelation(1.0, np.ones(4000))
        assert correlation[0] == pytest.approx(1.0, abs=1e-3)

    def test_zero_residual(self):
        _, correlation = autocorrelation(1.0, np.zeros(50))
        assert not correlation.any()

    def test_uneven_sampling_is_evened(self):
        time = np.concatenate((np.linspace(0.0, 1.0, 50), np.linspace(1.1, 10.0, 50)))
        step, values = even(time, 2.0 * time)
        np.testing.assert_allclose(values, 2.0 * step * np.arange(values.size), atol=1e-9)


class TestComparison:
    def test_actuator_axes_are_labelled_and_scaled(self):
        comparison = actuator_comparison()
        drive, both, error = figures.comparison_figure(comparison).axes
        assert drive.get_ylabel() == "Voltage (kV)"
        assert both.get_ylabel() == "Displacement (mm)"
        assert error.get_ylabel() == "Error (µm)"
        assert error.get_xlabel() == "Time (s)"
        assert drive.lines[0].get_ydata().max() == pytest.approx(8.0, rel=1e-3)
        for name in ("measured", "model"):
            drawn = line(both, name).get_ydata()
            assert drawn.max() == pytest.approx(getattr(comparison, name).max() * 1e3)
        residual = (comparison.measured - comparison.model) * 1e6
        drawn = max((found.get_ydata() for found in error.lines), key=len)
        assert np.max(drawn) == pytest.approx(residual.max())
        assert np.min(drawn) == pytest.approx(residual.min())

    def test_noise_band(self):
        error = figures.comparison_figure(actuator_comparison()).axes[2]
        assert error.patches[0].get_height() == pytest.approx(2.0)
        assert "1.00 µm" in error.get_legend().get_texts()[0].get_text()
        unknown = figures.comparison_figure(actuator_comparison(noise=None)).axes[2]
        assert unknown.get_legend() is None

    def test_film_axes(self):
        comparison = film_comparison()
        drive, both, error = figures.comparison_figure(comparison).axes
        assert drive.get_ylabel() == "Stretch"
        assert both.get_ylabel() == "Nominal stress (kPa)"
        assert error.get_ylabel() == "Error (kPa)"
        assert drive.lines[0].get_ydata().max() == pytest.approx(2.0)
        assert line(both, "measured").get_ydata().max() == pytest.approx(
            comparison.measured.max() * 1e-3
        )
        assert error.get_xscale() == "linear"

    def test_a_relaxation_is_shown_over_the_logarithm_of_time(self):
        time = np.linspace(0.0, 1000.0, 5001)
        stretch = np.minimum(1.0 + time, 2.0)
        stress = 1e4 * stretch * (1.0 + np.exp(-time / 10.0))
        comparison = film_comparison(time=time, drive=stretch, measured=stress, model=stress)
        error = figures.comparison_figure(comparison).axes[2]
        assert error.get_xscale() == "log"
        assert error.get_xlim() == pytest.approx((0.2, 1000.0))

    def test_loop(self):
        ax = figures.loop_figure(film_comparison()).axes[0]
        assert (ax.get_xlabel(), ax.get_ylabel()) == ("Stretch", "Nominal stress (kPa)")
        assert line(ax, "model").get_xdata().max() == pytest.approx(2.0)

    def test_a_diverging_model_can_be_drawn(self):
        comparison = actuator_comparison()
        model = comparison.model.copy()
        model[600:] = np.nan
        broken = actuator_comparison(model=model)
        svg(figures.comparison_figure(broken), "f1", "broken")
        svg(residual_figure(broken), "f2", "broken")


class TestResidualFigure:
    def test_row(self):
        histogram, correlation, density = residual_figure(actuator_comparison()).axes
        assert histogram.get_xlabel() == "Error (µm)"
        area = sum(p.get_width() * p.get_height() for p in histogram.patches)
        assert area == pytest.approx(1.0, abs=0.01)
        assert correlation.get_xlabel() == "Lag (s)"
        assert correlation.get_ylabel() == "Autocorrelation"
        assert density.get_xlabel() == "Frequency (Hz)"
        assert density.get_ylabel() == "Density (µm/√Hz)"
        level = line(density, "white noise").get_ydata()[0]
        assert level == pytest.approx(math.sqrt(2.0 * 0.01))

    def test_panels_are_the_same_axes(self):
        panels = residual_panels(film_comparison())
        assert [f.axes[0].get_xlabel() for f, _ in panels] == [
            "Error (kPa)",
            "Lag (s)",
            "Frequency (Hz)",
            "Normal quantile (standard deviations)",
            "Lag behind the drive (s)",
        ]

    def test_correlations_of_parameters_are_those_of_their_covariance(self):
        covariance = np.array([[4.0, -1.2, 0.0], [-1.2, 1.0, 0.0], [0.0, 0.0, 0.0]])
        figure = correlation_figure(("mu_1", "T_1", "J_1"), covariance)
        (cells,) = figure.axes[0].collections
        np.testing.assert_allclose(
            cells.get_array(), [[1.0, -0.6, 0.0], [-0.6, 1.0, 0.0], [0.0, 0.0, 0.0]]
        )
        assert "<image" not in svg(figure, "f1", "matrix")  # a page may show none
        assert "-0.60" in [text.get_text() for text in figure.axes[0].texts]
        names, *columns = correlation_columns(("mu_1", "T_1", "J_1"), covariance)
        assert names == ("parameter", ["mu_1", "T_1", "J_1"])
        assert [name for name, _ in columns] == ["mu_1", "T_1", "J_1"]

    def test_starts_are_drawn_in_their_order(self):
        searched = replace(fit(), starts=((1.0, True), (1.1, True), (3.0, False)))
        figure = starts_figure(searched)
        joined, ends, left = figure.axes[0].lines
        np.testing.assert_allclose(joined.get_ydata(), [1.0, 1.1, 3.0])
        np.testing.assert_allclose(ends.get_xdata(), [1, 2])
        np.testing.assert_allclose(left.get_xdata(), [3])
        assert figure.axes[0].get_yscale() == "log"
        columns = dict(starts_columns(searched))
        assert columns["mean_square_over_noise"] == [1.0, 1.1, 3.0]
        assert columns["followed_to_its_end"] == ["yes", "yes", "no"]
        assert len(starts_figure(replace(searched, starts=searched.starts[:2])).axes[0].lines) == 2

    @pytest.mark.parametrize("noise", mostly_deep([None, 0.0, 1e-12], [0.0]))
    def test_perfect_models_and_odd_noise(self, noise):
        comparison = actuator_comparison(noise=noise)
        for model in (comparison.measured, comparison.model):
            drawn = residual_figure(actuator_comparison(noise=noise, model=model))
            svg(drawn, "f1", "odd")

    @pytest.mark.parametrize("size", mostly_deep([2, 3, 10], [2]))
    def test_few_samples(self, size):
        comparison = actuator_comparison()
        short = {
            name: getattr(comparison, name)[300 : 300 + size]
            for name in ("time", "drive", "measured", "model")
        }
        for draw in (figures.comparison_figure, residual_figure, figures.loop_figure):
            svg(draw(actuator_comparison(**short)), "f1", "short")


class TestParameters:
    def test_intervals_arrows_and_grey(self):
        figure = parameters_figure(fit())
        moduli, limits, times = figure.axes
        assert moduli.get_xlabel() == "Modulus (kPa)"
        assert limits.get_xlabel() == "Locking limit"
        assert times.get_xlabel() == "Relaxation time (s)"
        assert all(ax.get_xscale() == "log" for ax in figure.axes)
        assert [t.get_text() for t in times.get_yticklabels()] == ["T₁", "T₂", "T₃"]
        fitted = [f for f in moduli.lines if f.get_label() == "fitted, with 95 % interval"]
        assert fitted[0].get_xdata()[0] == pytest.approx(45.7724)
        bars = [f for f in moduli.lines if len(f.get_xdata()) == 2]
        assert any(list(f.get_xdata()) == pytest.approx([45.65, 45.89]) for f in bars)
        arrows = [f.get_marker() for f in limits.lines if f.get_marker() in "<>"]
        assert sorted(arrows) == ["<", ">", ">"]
        undetermined = line(limits, "not determined by these data")
        assert undetermined.get_color() == figure_style.UNSURE
        assert undetermined.get_markerfacecolor() == "white"

    def test_table_3_stands_beside_by_relaxation_time(self):
        times = parameters_figure(fit()).axes[2]
        beside = [f.get_xdata()[0] for f in times.lines if f.get_label() == "thesis, Table 3"]
        assert beside == pytest.approx([0.33969, 0.39802, 8.3874])

    def test_without_intervals_no_arrow_pretends_there_are(self):
        for ax in parameters_figure(without_intervals()).axes:
            assert not [f for f in ax.lines if f.get_marker() in "<>|"]


class TestOtherFigures:
    def test_branches(self):
        upper, lower = branches_figure(TRIALS, "film").axes
        assert upper.get_ylabel() == "RMS error (kPa)"
        assert lower.get_xlabel() == "Number of branches"
        np.testing.assert_allclose(line(upper, "training").get_ydata(), [5.66, 2.53, 2.24])
        np.testing.assert_allclose(line(upper, "validation").get_ydata(), [11.4, 11.2, 10.5])
        np.testing.assert_allclose(lower.lines[0].get_ydata(), [1340.0, 172.0, 0.0])
        assert line(upper, "chosen").get_xdata()[0] == 3

    def test_overview(self):
        runs = validation_runs()
        figure = figures.overview_figure(actuator_comparison(), runs)
        bars = next(ax for ax in figure.axes if ax.get_xlabel().startswith("RMS error"))
        assert [p.get_width() for p in bars.patches[: len(runs)]] == pytest.approx(
            [c.errors.rms * 1e6 for c in runs]
        )
        assert line(bars, "noise floor").get_xdata()[0] == pytest.approx(1.0)
        assert bars.get_yticklabels()[0].get_text() == "f = 0.2 Hz"

    def test_overview_without_validation(self):
        assert len(figures.overview_figure(actuator_comparison(), ()).axes) == 3

    @pytest.mark.parametrize(
        "name",
        mostly_deep(
            ["$x^2$ & co.h5", "测量-一.h5", "<script>alert(1)</script>", "long" * 40],
            ["$x^2$ & co.h5"],
        ),
    )
    def test_any_name_can_be_drawn(self, name, tmp_path):
        figure = figures.overview_figure(
            actuator_comparison(), (actuator_comparison(name, "validation"),)
        )
        save_png(figure, tmp_path / "overview.png", dpi=40)
        drawing = svg(figure, "f1", name)
        assert "<script" not in drawing


class TestOutput:
    def test_png_is_written_as_a_whole(self, tmp_path):
        path = save_png(figures.loop_figure(film_comparison()), tmp_path / "a.png", dpi=50)
        assert path.read_bytes().startswith(b"\x89PNG")
        assert list(tmp_path.iterdir()) == [path]

    def test_png_into_no_folder_is_refused(self, tmp_path):
        with pytest.raises(InputError, match="no folder"):
            save_png(figures.loop_figure(film_comparison()), tmp_path / "no" / "a.png")

    def test_svg_stands_alone_and_stays_small(self):
        comparison = actuator_comparison(rate=20_000.0)
        drawing = svg(figures.comparison_figure(comparison), "f7", 'a "run"')
        assert len(drawing) < 120_000
        assert "http" not in drawing
        assert 'role="img"' in drawing
        assert "width=" not in drawing.partition(">")[0]
        used = {part.partition(")")[0] for part in drawing.split("url(#")[1:]}
        assert used
        assert all(name.startswith("f7-") and f'id="{name}"' in drawing for name in used)

    def test_drawing_twice_gives_the_same(self):
        first, second = (
            svg(figures.comparison_figure(actuator_comparison()), "f1", "x") for _ in range(2)
        )
        assert first == second

    def test_drawing_leaves_no_trace_in_the_settings_and_the_figure(self):
        import matplotlib as mpl

        figure = figures.loop_figure(film_comparison())
        before = (dict(mpl.rcParams), figure.canvas, figure.dpi)
        svg(figure, "f1", "x")
        assert (dict(mpl.rcParams), figure.canvas, figure.dpi) == before

    def test_matplotlib_waits_until_something_is_drawn(self):
        code = (
            "import sys, dearig.cli.terminal, dearig.report.pages.html;"
            "import dearig.report.figures.recordings;"
            "sys.exit(bool({'matplotlib', 'jinja2', 'h5py', 'scipy', 'numba'} & set(sys.modules)))"
        )
        assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0
