"""Loops and spectra of the selected recordings, computed in another process when they are seen."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import Any

from PySide6.QtCore import QObject, Signal

from dearig.analysis.loops import Loops, loops
from dearig.analysis.summary import Spectra, spectra
from dearig.window.jobs.worker import Job
from dearig.window.plots.loop_plot import LoopPlot
from dearig.window.plots.spectrum_plot import Density, SpectrumPlot
from dearig.window.recordings.library import Library
from dearig.window.session.state import Session

__all__ = ["RecordingAnalysis"]


class RecordingAnalysis(QObject):
    """Fills a plot of loops and one of spectra; ``trouble`` says what cannot be shown, and why.

    Of several selected recordings only the first has its spectra shown: those of others would hide
    them.
    """

    trouble = Signal(str)

    def __init__(self, session: Session, library: Library, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self._session = session
        self._library = library
        self.loop = LoopPlot(session)
        self.spectrum = SpectrumPlot(session)
        self._asked: dict[str, tuple[object, ...]] = {}
        self._jobs: list[Job] = []

    def show_loops(self, paths: Sequence[Path]) -> None:
        """Draw displacement against voltage of the recordings ``paths``."""
        if not self._is_new("loop", *paths):
            return
        found: dict[Path, Loops] = {}

        def take(one: Loops, path: Path) -> None:
            found[path] = one
            self.loop.show_loops([found[p] for p in paths if p in found])

        self.loop.show_loops(())
        for path in paths:
            self._submit("loop", partial(take, path=path), loops, path)

    def show_spectra(self, paths: Sequence[Path]) -> None:
        """Draw the spectra of the first of the recordings ``paths``."""
        model, drive = self._library.model, self._session.overlay_drive
        if self._is_new("spectrum", *paths[:1], model, drive):
            self.spectrum.show_densities(())
            for path in paths[:1]:
                self._submit("spectrum", self._take_spectra, spectra, path, model, drive)

    def forget(self) -> None:
        """Compute everything again when it is asked for next: the recordings have changed."""
        self._asked.clear()

    def _take_spectra(self, found: Spectra) -> None:
        shown = [Density(f"displacement of {found.name}", "measured", *found.measured)]
        if found.residual is not None:
            shown.append(Density("residual", "residual 0", *found.residual))
        self.spectrum.show_densities(shown, f"{found.name} spectrum")

    def _is_new(self, view: str, *asked: object) -> bool:
        new = self._asked.get(view) != asked
        self._asked[view] = asked
        return new

    def _submit(
        self, view: str, take: Callable[[Any], None], function: Callable[..., Any], *given: object
    ) -> None:
        asked = self._asked[view]

        def finished(found: Any) -> None:
            if self._asked.get(view) == asked:
                take(found)

        def failed(words: str) -> None:
            if self._asked.get(view) == asked:
                self.trouble.emit(words)

        job = self._library.submit(function, *given)
        job.finished.connect(finished)
        job.failed.connect(failed)
        self._jobs = [*self._jobs[-20:], job]
