"""Plot of amplitude spectral densities."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from PySide6.QtWidgets import QVBoxLayout, QWidget

from dearig.window.plot_area import PlotArea
from dearig.window.plot_item import Plot
from dearig.window.session import Session
from dearig.window.theme import Theme

__all__ = ["DENSITY_LABEL", "FREQUENCY_LABEL", "Density", "SpectrumPlot", "draw_densities"]

DENSITY_LABEL = "Amplitude density (\N{MICRO SIGN}m/\N{SQUARE ROOT}Hz)"
FREQUENCY_LABEL = "Frequency (Hz)"
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


def draw_densities(plot: Plot, densities: Sequence[Density], theme: Theme) -> None:
    """Draw ``densities`` in a logarithmic ``plot`` in place of what it shows."""
    plot.clear_all()
    for found in densities:
        colour = theme.measured
        if found.use.startswith("residual"):
            colour = theme.models[int(found.use.split()[1]) % len(theme.models)]
        plot.add_curve(found.name, colour).set_points(found.frequency, found.density * _SCALE)


class SpectrumPlot(QWidget):
    """Shows spectra of the displacement and of residuals."""

    def __init__(self, session: Session, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._session = session
        self._shown: tuple[Density, ...] = ()
        self.area = PlotArea(session, "Spectrum")
        self.plot = self.area.add_plot(
            0, left=DENSITY_LABEL, bottom=FREQUENCY_LABEL, group="frequency", log=(True, True)
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
        self.area.auto_range()

    def _draw(self) -> None:
        draw_densities(self.plot, self._shown, self._session.theme)
