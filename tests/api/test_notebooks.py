"""The notebooks of the documents run, and every cell that ends with a value shows it."""

from __future__ import annotations

import ast
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

import dearig.docs
from tests.deep import mostly_deep

if TYPE_CHECKING:
    import nbformat

FOLDER = Path(dearig.docs.__file__).parent / "notebooks"
NOTEBOOKS = sorted(path.name for path in FOLDER.glob("*.ipynb"))


def read(name: str) -> nbformat.NotebookNode:
    """The notebook ``name`` as it is kept."""
    import nbformat

    return nbformat.read(FOLDER / name, as_version=4)


@pytest.fixture(scope="module", params=mostly_deep(NOTEBOOKS, []))
def executed(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory):
    """A notebook after all its cells ran, in an empty folder."""
    from nbclient import NotebookClient

    notebook = read(request.param)
    # no time-out of a cell: the test run has one, and the machine may be busy
    client = NotebookClient(
        notebook, timeout=None, kernel_name="python3",
        resources={"metadata": {"path": str(tmp_path_factory.mktemp("notebook"))}},
    )  # fmt: skip
    return request.param, client.execute()


def values(notebook: nbformat.NotebookNode) -> list[dict[str, str]]:
    """What cells showed as their value, by MIME type."""
    return [
        output.data
        for cell in notebook.cells
        if cell.cell_type == "code"
        for output in cell.outputs
        if output.output_type == "execute_result"
    ]


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore")  # of the kernel's own packages
def test_a_notebook_runs_and_shows_its_values(executed) -> None:
    name, notebook = executed
    streams = [
        output
        for cell in notebook.cells
        if cell.cell_type == "code"
        for output in cell.outputs
        if output.output_type in ("stream", "error")
    ]
    assert not streams, f"{name} prints {streams}"
    shown = values(notebook)
    assert sum("<svg" in data.get("text/html", "") for data in shown) >= 3
    if name.startswith("closed-loop"):
        (compared,) = [d["text/plain"] for d in shown if "target_mm" in d["text/plain"]]
        told = ast.literal_eval(compared)
        assert told["reached_mm"] == pytest.approx(told["target_mm"], abs=0.02)
        (diagnosed,) = [d["text/plain"] for d in shown if "verdict" in d["text/plain"]]
        told = ast.literal_eval(diagnosed)
        assert told["verdict"] == "explained"
        assert told["after"] < 0.8 * told["before"]
    else:
        assert sum("image/png" in data for data in shown) == 2


@pytest.mark.parametrize("name", NOTEBOOKS)
def test_a_notebook_is_kept_without_results(name: str) -> None:
    notebook = read(name)
    code = [cell for cell in notebook.cells if cell.cell_type == "code"]
    assert all(not cell.outputs and cell.execution_count is None for cell in code)


def test_there_are_notebooks_on_recordings_and_on_a_closed_loop() -> None:
    assert NOTEBOOKS == ["analysis-of-recordings.ipynb", "closed-loop-on-the-simulated-rig.ipynb"]
