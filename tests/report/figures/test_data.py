from __future__ import annotations

import csv
import io
from urllib.parse import unquote

import numpy as np
import pytest

from dearig.batch.table_file import read_table, write_csv
from dearig.report.figures.data import csv_url, figure_columns, to_csv
from dearig.report.figures.recordings import comparison_figure, overview_figure
from dearig.report.figures.residual import bin_text, residual_panels
from tests.tools.reports import NOISE, actuator_comparison, validation_runs


def read(text: str) -> tuple[list[str], list[list[str]]]:
    head, *rows = csv.reader(io.StringIO(text))
    assert {len(row) for row in rows} == {len(head)}
    return head, rows


def test_curves_are_named_with_unit_and_have_the_drawn_points():
    comparison = actuator_comparison()
    head, rows = read(to_csv(figure_columns(comparison_figure(comparison))))
    assert head[:5] == [
        "Time (s)", "Voltage (kV)", "Time (s)", "Displacement (mm): measured", "Time (s)"
    ]  # fmt: skip
    measured = np.array([float(row[3]) for row in rows if row[3]])
    assert measured.max() == pytest.approx(comparison.measured.max() * 1e3, rel=1e-6)
    assert any(name.startswith("Error (µm): ± noise floor") for name in head)


def test_bars_have_their_names():
    head, rows = read(to_csv(figure_columns(overview_figure(actuator_comparison(), ()))))
    assert "" not in head
    head, rows = read(
        to_csv(figure_columns(overview_figure(actuator_comparison(), validation_runs())))
    )
    assert "f = 0.2 Hz" in [row[head.index("")] for row in rows]


def test_no_cell_of_text_is_a_formula():
    texts = ["=1+2", "+1", "-1", "@x", "\t=1", "a;=1", 'say "x"', "\uff1d1"]
    _, rows = read(to_csv([("name", texts), ("value", [-1.5] * len(texts))]))
    assert [row[1] for row in rows] == ["-1.5"] * len(texts)
    for row, text in zip(rows, texts, strict=True):
        assert row[0] == ("'" + text if text[0] in "=+-@\uff1d" else row[0])
        assert row[0][0] not in "=+-@\t\uff1d"
    assert '"a;=1"' in to_csv([("a;=1", [])])


def test_the_link_holds_the_file():
    url = csv_url(to_csv([("a, µm", [1.5, float("nan")])]))
    kind, _, body = url.partition(",")
    assert kind == "data:text/csv;charset=utf-8"
    assert unquote(body) == '\ufeff"a, µm"\r\n1.5\r\n\r\n'


@pytest.mark.parametrize("step", [0.1e-6, 0.3e-6, 1.22e-6, 40e-6])
def test_bins_are_whole_converter_steps(step):
    comparison = actuator_comparison(step=step)
    bars = residual_panels(comparison)[0][0].axes[0].containers[0].patches
    widths = {round(bar.get_width() / (step * 1e6), 6) for bar in bars}
    assert len(widths) == 1
    assert widths.pop() % 1.0 == 0.0
    # between two steps, so that none lies on an edge
    assert bars[0].get_x() / (step * 1e6) % 1.0 == pytest.approx(0.5, abs=1e-6)
    assert "converter step" in bin_text(comparison)


def test_bins_of_readings_without_a_step_follow_the_spread():
    assert bin_text(actuator_comparison()) == ""
    bars = residual_panels(actuator_comparison())[0][0].axes[0].containers[0].patches
    assert 12 <= len(bars) <= 60
    assert bars[0].get_width() < 4.0 * NOISE * 1e6


def test_a_table_of_a_study_has_no_formula_and_is_read_as_it_was(tmp_path):
    rows = [{"film": "=1+2", "@x": -1.5}, {"film": "F1", "@x": 3.0}]
    write_csv(rows, tmp_path / "study.csv")
    lines = (tmp_path / "study.csv").read_text("utf-8").splitlines()
    assert lines[:2] == ["film,'@x", "'=1+2,-1.5"]
    assert read_table(tmp_path / "study.csv") == rows
