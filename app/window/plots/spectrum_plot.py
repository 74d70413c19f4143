"""Plot of amplitude spectral densities."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from PySide6.QtCore import Slot
from PySide6.QtWidgets import QVBoxLayout, QWidget

from dearig.window.plots.area import PlotArea
from dearig.window.session.state import Session

__all__ = ["Density", "SpectrumPlot"]

_LABEL = "Amplitude density (\N{MICRO SIGN}m/\N{SQUARE ROOT}Hz)"
_SCALE = 1e6  # um for each m


@dataclass(frozen=True)
class Density:
    """Amplitude spectral density (n,) in m/√Hz over ``frequency`` (n,) in Hz, and its name.

    ``use`` is "measured" or "residual 0", "residual 1", ...: it gives the colour.
    """

    name: str
    use: str
    frequency: np.ndarray
    density: np.ndarray


class SpectrumPlot(QWidget):
    """Shows spectra of the displacement and of residuals."""

    def __init__(self, session: Session, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._session = session
        self._shown: tuple[Density, ...] = ()
        self.area = PlotArea(session, "Spectrum")
        self.plot = self.area.add_plot(
            0, left=_LABEL, bottom="Frequency (Hz)", group="frequency", log=(True, True)
        )
        outer = QVBoxLayout(self)
        outer.setContentsMargins(0, 0, 0, 0)
        outer.addWidget(self.area)
        session.theme_changed.connect(self._draw)

    def show_densities(self, densities: Sequence[Density], stem: str = "spectrum") -> None:
        """Draw ``densities``; ``stem`` is the name that is proposed for saved files."""
        self._shown = tuple(densities)
        self.area.file_stem = stem
        self._draw()
        self.area.fit()

    @Slot()
    def _draw(self) -> None:
        theme = self._session.theme
        self.plot.clear_all()
        for found in self._shown:
            colour = theme.measured
            if found.use.startswith("residual"):
                colour = theme.models[int(found.use.split()[1]) % len(theme.models)]
            curve = self.plot.add_curve(found.name, colour)
            curve.set_points(found.frequency, found.density * _SCALE)
