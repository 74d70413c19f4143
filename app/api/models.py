"""Models: opened from a file, or taken from a result."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any, Protocol

from dearig.api.display import card, facts, table_html
from dearig.config.modelfile import ModelFile, load_model, model_toml, save_model
from dearig.model.film.material import Spring
from dearig.model.simulation.actuator import Actuator
from dearig.report.model_export.write import write_export
from dearig.report.text.numbers import NO_VALUE, significant
from dearig.report.text.sentences import describe_model
from dearig.report.text.tables import Row, Table

__all__ = ["Model", "ModelSource", "as_model_file", "export_model", "read_model"]


class Model(ModelFile):
    """A fitted model.

    Attributes
    ----------
    name : str
        Name of the model.
    model : Actuator or Strip
        Film, load, springs and effects, in SI units.
    history : mapping
        Origin of the model: recordings with their checksums, and settings.

    Examples
    --------
    >>> import dearig
    >>> model = dearig.Model.open("model.toml")
    """

    @classmethod
    def open(cls, path: str | Path) -> Model:
        """Read a model file.

        Parameters
        ----------
        path : str or Path
            A model file (TOML).

        Returns
        -------
        Model
            The model in the file.

        Raises
        ------
        InputError
            If the file is not a model that can be read.
        """
        return cls.of(load_model(path))

    @classmethod
    def of(cls, file: ModelFile) -> Model:
        """Return the content of a model file as a model for a notebook.

        Parameters
        ----------
        file : ModelFile
            Content of a model file.

        Returns
        -------
        Model
            The same model, with ``save`` and a display.
        """
        return file if isinstance(file, cls) else cls(file.name, file.model, file.history)

    def to_toml(self) -> str:
        """Return the text of a model file.

        Returns
        -------
        str
            The model in TOML, with units in the names of the keys.
        """
        return model_toml(self.name, self.model, self.history)

    def save(self, path: str | Path, *, overwrite: bool = False) -> Path:
        """Write a model file.

        Parameters
        ----------
        path : str or Path
            The file (``.toml``).
        overwrite : bool
            Replace a file that exists.

        Returns
        -------
        Path
            The path that was written.

        Raises
        ------
        InputError
            If the file exists, cannot be written.
        """
        return save_model(path, self.name, self.model, self.history, overwrite)

    def _repr_html_(self) -> str:
        network = self.model.network
        springs: list[tuple[str, Spring, float | None]] = []
        springs.append(("equilibrium", network.equilibrium, None))
        springs += [
            (f"branch {i + 1}", branch.spring, branch.relaxation_time)
            for i, branch in enumerate(network.branches)
        ]
        rows = tuple(
            Row(
                (
                    label,
                    significant(spring.modulus * 1e-3, 4),
                    significant(spring.limit, 4),
                    NO_VALUE if time is None else significant(time, 4),
                )
            )
            for label, spring, time in springs
        )
        head = (("", ""), ("Modulus", "kPa"), ("Limit J", ""), ("Relaxation time", "s"))
        return card(
            self.name,
            facts(self._facts()),
            table_html(Table("", head, rows)),
            sentences=[f"{describe_model(self.model)}."],
        )

    def _facts(self) -> list[tuple[str, str]]:
        rows = []
        if isinstance(self.model, Actuator):
            film, load = self.model.film, self.model.load
            size = " x ".join(f"{x * 1e3:.4g}" for x in (film.length, film.width, film.thickness))
            rows += [
                ("film", f"{size} mm, {film.kinematics}"),
                ("load", f"{load.mass * 1e3:.4g} g"),
            ]
        rows += [(name, _numbers(dict(values))) for name, values in self.model.effects]
        return rows


def _numbers(values: Mapping[str, float]) -> str:
    return ", ".join(f"{name} {significant(value, 4)}" for name, value in values.items())


class _HasModel(Protocol):
    @property
    def model(self) -> Any: ...


#: A model, a result that has one, or the path of a model file.
ModelSource = str | Path | ModelFile | _HasModel


def as_model_file(source: ModelSource) -> str | Path | ModelFile:
    """Return a model as the analysis takes it.

    Parameters
    ----------
    source : model, result or path
        A ``Model``, a result that has one, or the path of a model file.

    Returns
    -------
    str, Path or ModelFile
        A path unchanged, otherwise the model.

    Raises
    ------
    TypeError
        If ``source`` is neither.
    """
    if isinstance(source, str | Path | ModelFile):
        return source
    file = getattr(source, "model", None)
    if not isinstance(file, ModelFile):
        raise TypeError(
            f"a model is a path, a dearig.Model or a result with one, not {type(source).__name__}"
        )
    return file


def read_model(source: ModelSource) -> ModelFile:
    """Return a model, read from its file where a path is given.

    Parameters
    ----------
    source : model, result or path
        A ``Model``, a result that has one, or the path of a model file.

    Returns
    -------
    ModelFile
        The model.

    Raises
    ------
    InputError
        If the file is not a model that can be read.
    """
    given = as_model_file(source)
    return given if isinstance(given, ModelFile) else load_model(given)


def export_model(model: ModelSource, to: str, path: str | Path, *, overwrite: bool = False) -> Path:
    """Write a model for another program.

    Parameters
    ----------
    model : model, result or path
        A ``Model``, a result that has one, or the path of a model file.
    to : str
        ``"latex"``: a page of equations with numbers. ``"python"``: one file with a function
        ``simulate``, which needs NumPy alone. ``"prony"``: strain energy and Prony series for
        finite-element programs, with what they cannot express.
    path : str or Path
        The file.
    overwrite : bool
        Replace a file that exists.

    Returns
    -------
    Path
        The path that was written.

    Raises
    ------
    InputError
        If ``to`` is another word, the model cannot be read, or the file exists or cannot be
        written.

    Examples
    --------
    >>> import dearig
    >>> dearig.export_model("model.toml", "python", "model.py")
    """
    return write_export(read_model(model), to, path, overwrite)
