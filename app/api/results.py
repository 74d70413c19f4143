"""Results of identification, validation and diagnosis: numbers, figures, pages and files."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from dearig.analysis.outcomes import (
    Comparison,
    DiagnoseOutcome,
    IdentifyOutcome,
    ValidateOutcome,
)
from dearig.api.display import card, drawing, table_html
from dearig.api.models import Model
from dearig.api.rows import Parameter, RecordingErrors, Rows, errors_of, parameters_of
from dearig.api.sequences import Sequence as VoltageSequence
from dearig.api.written import HasFiles, HasPage, Writers
from dearig.errors import InputError
from dearig.recording.json_file import write_json
from dearig.report.as_json import result_json
from dearig.report.figures import recordings as figures
from dearig.report.figures.diagnosis import bars_figure, before_after_figure
from dearig.report.figures.parameters import branches_figure, parameters_figure
from dearig.report.figures.residual import residual_figure
from dearig.report.pages.page import write_report
from dearig.report.text import diagnosis as words
from dearig.report.text.diagnosis_tables import before_after_table
from dearig.report.text.estimates import effect_table
from dearig.report.text.sentences import (
    fit_is_rejected,
    identify_summary,
    validate_summary,
    warnings_of,
)
from dearig.report.text.tables import error_table, parameter_table

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["DiagnoseResult", "IdentifyResult", "ValidateResult"]


def _named(comparisons: Sequence[Comparison], name: str, others: Sequence[str]) -> Comparison:
    """The comparison called ``name``. Raises ``InputError``, which lists what can be plotted."""
    for comparison in comparisons:
        if name == comparison.name:
            return comparison
    known = (*others, *(c.name for c in comparisons))
    raise InputError(f"{name!r} cannot be plotted; what can is {', '.join(known)}")


class _Reported(HasFiles, HasPage):
    """What all results have: the residual on each recording, and a report."""

    outcome: IdentifyOutcome | ValidateOutcome | DiagnoseOutcome

    @property
    def _comparisons(self) -> tuple[Comparison, ...]:
        """The recordings with the final model, those that were fitted first."""
        raise NotImplementedError

    def residual(self, name: str) -> tuple[np.ndarray, np.ndarray]:
        """Return the residual on one recording.

        Parameters
        ----------
        name : str
            The name of the recording.

        Returns
        -------
        time, residual : numpy.ndarray
            Both (N,), in s and in m or Pa: measured minus model, NaN where a reading must not be
            used.

        Raises
        ------
        InputError
            If no recording has that name.
        """
        for comparison in self._comparisons:
            if comparison.name == name:
                return comparison.time, comparison.measured - comparison.model
        known = ", ".join(c.name for c in self._comparisons)
        raise InputError(f"there is no recording {name!r} in this result; it has {known}")

    def _writers(self) -> Writers:
        return {".json": ("all numbers", lambda out, _: write_json(result_json(self.outcome), out))}

    def _write_page(self, path: Path) -> Path:
        return write_report(self.outcome, path)


@dataclass(frozen=True, eq=False, repr=False)
class IdentifyResult(_Reported):
    """Result of an identification, saved as ``.toml`` (its model) or ``.json`` (all numbers).

    Attributes
    ----------
    outcome : IdentifyOutcome
        All numbers of the fit, in SI units.
    """

    outcome: IdentifyOutcome

    @property
    def _comparisons(self) -> tuple[Comparison, ...]:
        return (*self.outcome.train, *self.outcome.validation)

    @property
    def model(self) -> Model:
        """The fitted model."""
        return Model.of(self.outcome.model)

    @property
    def parameters(self) -> Rows[Parameter]:
        """The parameters in SI units with their 95 % intervals."""
        return Rows(parameters_of(self.outcome.fit.estimates))

    @property
    def errors(self) -> Rows[RecordingErrors]:
        """The errors on every recording, those that were fitted first."""
        return errors_of(self._comparisons)

    @property
    def warnings(self) -> tuple[str, ...]:
        """What the operator should know of the recordings and the fit."""
        return warnings_of(self.outcome)

    @property
    def covariance(self) -> np.ndarray:
        """The covariance (f, f) of the fitted parameters in SI units, without intervals (0, 0)."""
        return self.outcome.fit.covariance

    @property
    def covariance_names(self) -> tuple[str, ...]:
        """The names of the parameters that ``covariance`` is of."""
        return self.outcome.fit.covariance_names

    def plot(self, what: str = "overview") -> Figure:
        """Plot the fit.

        Parameters
        ----------
        what : str
            ``overview``, ``parameters``, ``branches`` (where several numbers were fitted),
            ``residual`` (of the first recording) or the name of a recording.

        Returns
        -------
        matplotlib.figure.Figure
            The figure, with axes in the units that its labels name.

        Raises
        ------
        InputError
            If nothing of that name can be plotted.
        """
        outcome = self.outcome
        if what == "overview":
            return figures.overview_figure(outcome.train[0], outcome.validation)
        if what == "parameters":
            return parameters_figure(outcome.fit)
        if what == "residual":
            return residual_figure(outcome.train[0])
        others = ["overview", "parameters", "residual"]
        if outcome.trials:
            others.append("branches")
            if what == "branches":
                return branches_figure(outcome.trials, outcome.kind)
        return figures.comparison_figure(_named(self._comparisons, what, others))

    def _writers(self) -> Writers:
        def model(out: Path, overwrite: bool) -> None:
            self.model.save(out, overwrite=overwrite)

        return {".toml": ("the model", model), **super()._writers()}

    def __repr__(self) -> str:
        """Return the summary in sentences."""
        return "\n".join(identify_summary(self.outcome))

    def _repr_html_(self) -> str:
        outcome = self.outcome
        every = self._comparisons
        return card(
            f"Identification: {outcome.title}",
            table_html(parameter_table(outcome.fit, fit_is_rejected(outcome))),
            table_html(error_table("", every)),
            drawing(self.plot(outcome.train[0].name), f"Measurement and model, {outcome.title}"),
            sentences=[*identify_summary(outcome)[1:], *self.warnings],
        )


@dataclass(frozen=True, eq=False, repr=False)
class ValidateResult(_Reported):
    """Result of a validation, saved as ``.json`` (all numbers).

    Attributes
    ----------
    outcome : ValidateOutcome
        All numbers of the comparison, in SI units.
    """

    outcome: ValidateOutcome

    @property
    def _comparisons(self) -> tuple[Comparison, ...]:
        return self.outcome.comparisons

    @property
    def errors(self) -> Rows[RecordingErrors]:
        """The errors on every recording; ``role`` is train for one that the model was fitted to."""
        return errors_of(self._comparisons)

    @property
    def warnings(self) -> tuple[str, ...]:
        """What the operator should know of the recordings."""
        return warnings_of(self.outcome)

    def plot(self, what: str = "") -> Figure:
        """Plot measurement and model.

        Parameters
        ----------
        what : str
            The name of a recording, by default the one with the largest error; or ``residual`` for
            the residual of that one.

        Returns
        -------
        matplotlib.figure.Figure
            The figure, with axes in the units that its labels name.

        Raises
        ------
        InputError
            If nothing of that name can be plotted.
        """
        every = self._comparisons
        worst = max(every, key=lambda c: c.errors.rms)
        if what == "residual":
            return residual_figure(worst)
        return figures.comparison_figure(_named(every, what or worst.name, ["residual"]))

    def __repr__(self) -> str:
        """Return the summary in sentences."""
        return "\n".join(validate_summary(self.outcome))

    def _repr_html_(self) -> str:
        outcome = self.outcome
        return card(
            f"Validation: {outcome.title}",
            table_html(error_table("", outcome.comparisons)),
            drawing(self.plot(), f"Measurement and model, {outcome.title}"),
            sentences=[*validate_summary(outcome), *self.warnings],
        )


@dataclass(frozen=True, eq=False, repr=False)
class DiagnoseResult(_Reported):
    """Result of a diagnosis, finished or interrupted.

    It is saved as ``.toml`` (its model) or ``.json`` (all numbers).

    Attributes
    ----------
    outcome : DiagnoseOutcome
        All numbers of the search, in SI units.
    """

    outcome: DiagnoseOutcome

    @property
    def _comparisons(self) -> tuple[Comparison, ...]:
        return (*self.outcome.after.train, *self.outcome.after.validation)

    @property
    def verdict(self) -> str:
        """``nothing_missing``, ``explained``, ``partly_explained`` or ``unexplained``."""
        return self.outcome.verdict

    @property
    def status(self) -> str:
        """How the search ended: ``complete``, ``stopped`` or ``budget``."""
        return self.outcome.status

    @property
    def headline(self) -> str:
        """The verdict as a sentence."""
        return words.headline(self.outcome)

    @property
    def model(self) -> Model:
        """The model with the effects that were found."""
        return Model.of(self.outcome.model)

    @property
    def effects(self) -> tuple[str, ...]:
        """The effects that were found, in the order in which they were added."""
        return tuple(step.effect for step in self.outcome.finding.steps)

    @property
    def parameters(self) -> Rows[Parameter]:
        """The parameters of the effects that were found, in SI units with 95 % intervals."""
        steps = self.outcome.finding.steps
        return Rows(p for step in steps for p in parameters_of(step.estimates, step.effect))

    @property
    def errors(self) -> Rows[RecordingErrors]:
        """The errors of the final model; ``errors_before`` are those of the thesis's model."""
        return errors_of(self._comparisons)

    @property
    def errors_before(self) -> Rows[RecordingErrors]:
        """The errors of the thesis's model."""
        return errors_of((*self.outcome.before.train, *self.outcome.before.validation))

    @property
    def experiment(self) -> VoltageSequence | None:
        """The sequence that separates what these data do not; None if there is none."""
        found = self.outcome.experiment
        return None if found is None else VoltageSequence.from_toml(found.sequence)

    @property
    def warnings(self) -> tuple[str, ...]:
        """What the operator should know of the recordings and the search."""
        return words.warnings(self.outcome)

    @property
    def covariance(self) -> np.ndarray:
        """The covariance (f, f) of the fitted parameters in SI units, without intervals (0, 0)."""
        return self.outcome.finding.final.covariance

    @property
    def covariance_names(self) -> tuple[str, ...]:
        """The names of the parameters that ``covariance`` is of."""
        return self.outcome.finding.final.covariance_names

    def plot(self, what: str = "errors") -> Figure:
        """Plot errors or a recording before and after.

        Parameters
        ----------
        what : str
            ``errors`` (RMS of every recording before and after) or the name of a recording.

        Returns
        -------
        matplotlib.figure.Figure
            The figure, with axes in the units that its labels name.

        Raises
        ------
        InputError
            If nothing of that name can be plotted.
        """
        before, after = self.outcome.before, self.outcome.after
        first = {c.name: c for c in (*before.train, *before.validation)}
        last = (*after.train, *after.validation)
        pairs = [(first[c.name], c) for c in last if c.name in first]
        if what == "errors":
            return bars_figure(pairs, self.outcome.kind)
        chosen = _named([after for _, after in pairs], what, ["errors"])
        return before_after_figure(first[chosen.name], chosen)

    def _writers(self) -> Writers:
        def model(out: Path, overwrite: bool) -> None:
            self.model.save(out, overwrite=overwrite)

        return {".toml": ("the model", model), **super()._writers()}

    def __repr__(self) -> str:
        """Return the verdict in sentences."""
        return "\n".join([f"{self.headline}.", *words.summary(self.outcome)])

    def _repr_html_(self) -> str:
        outcome = self.outcome
        parts = [
            table_html(before_after_table(title, before, after, outcome.kind))
            for title, before, after in (
                ("Untouched recordings", outcome.before.validation, outcome.after.validation),
                ("Training recordings", outcome.before.train, outcome.after.train),
            )
            if before and after
        ]
        if self.effects:
            parts.insert(0, table_html(effect_table(outcome)))
        if outcome.after.train:
            parts.append(drawing(self.plot(), "RMS errors before and after"))
        return card(self.headline, *parts, sentences=[*words.summary(outcome), *self.warnings])
