"""Loop and spectra of a run in progress."""

from __future__ import annotations

from functools import cached_property

import numpy as np
from PySide6.QtCore import Qt
from PySide6.QtWidgets import QSplitter, QVBoxLayout, QWidget

from dearig.analysis.loops import loops_of
from dearig.analysis.spectrum import amplitude_density
from dearig.window.plots.loop_plot import LoopPlot
from dearig.window.plots.spectrum_plot import Density, SpectrumPlot
from dearig.window.run.live import Live
from dearig.window.session.state import Session

__all__ = ["ANALYSES", "LiveAnalysis"]

#: Name of each view and what a menu calls it.
ANALYSES = {
    "loop": "Displacement against voltage",
    "spectrum": "Spectrum of displacement and residual",
}


class LiveAnalysis(QWidget):
    """Displacement against voltage, and spectra, of the newest samples; hidden at first.

    A view is made when it is first shown.
    """

    def __init__(self, session: Session, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._session = session
        self._split = QSplitter(Qt.Orientation.Vertical)
        self._split.setChildrenCollapsible(False)
        outer = QVBoxLayout(self)
        outer.setContentsMargins(0, 0, 0, 0)
        outer.addWidget(self._split)
        self.hide()

    @cached_property
    def loop(self) -> LoopPlot:
        """Displacement against voltage, above the spectra."""
        made = LoopPlot(self._session)
        made.hide()
        self._split.insertWidget(0, made)
        return made

    @cached_property
    def spectrum(self) -> SpectrumPlot:
        """Spectra of displacement and residual."""
        made = SpectrumPlot(self._session)
        made.hide()
        self._split.addWidget(made)
        return made

    @property
    def shown(self) -> tuple[str, ...]:
        """Names of the views that are shown."""
        made = vars(self)  # only a view that was made is in it
        return tuple(name for name in ANALYSES if name in made and not made[name].isHidden())

    def show_view(self, name: str, shown: bool) -> None:
        """Show or hide a view of ``ANALYSES``."""
        view = self.loop if name == "loop" else self.spectrum
        view.setVisible(shown)
        self.setVisible(bool(self.shown))

    def clear(self) -> None:
        """Show no run."""
        if "loop" in vars(self):
            self.loop.show_loops(())
        if "spectrum" in vars(self):
            self.spectrum.show_densities(())

    def draw(self, live: Live, seconds: float | None) -> None:
        """Draw the newest ``seconds`` s of the run, None for all, as far as they are kept."""
        now = live.now()
        if now is None or not self.shown:
            return
        longest = now.total / now.rate if seconds is None else seconds
        moved = live.newest("displacement", longest)
        span = f"last {moved.size / now.rate:.3g} s"
        if "loop" in self.shown:
            volts = live.newest("command", longest)
            time = np.arange(volts.size) / now.rate
            self.loop.show_loops([loops_of(time, volts, moved, span)], keep_range=True)
        if "spectrum" in self.shown:
            found = [Density(f"measured, {span}", "measured", *amplitude_density(moved, now.rate))]
            for i, model in enumerate(self._session.overlays):
                left = amplitude_density(live.newest(f"residual {i}", longest), now.rate)
                found.append(Density(f"residual of {model.name}", f"residual {i}", *left))
            self.spectrum.show_densities(found, "run spectrum")
