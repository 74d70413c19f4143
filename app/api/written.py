"""What the values of the interface share: files by the ending of a name, and a page."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path

from dearig.errors import InputError
from dearig.recording.files import check_output

__all__ = ["HasFiles", "HasPage", "Writers"]

#: For each ending of a name what such a file holds, and what writes it to a path that has been
#: checked; its second argument says that a file which exists is replaced.
Writers = Mapping[str, tuple[str, Callable[[Path, bool], object]]]


class HasFiles:
    """A value that is saved to files."""

    def _writers(self) -> Writers:
        raise NotImplementedError

    def save(self, path: str | Path, *, overwrite: bool = False) -> Path:
        """Write this value to a file.

        Parameters
        ----------
        path : str or Path
            The file. The ending of its name says what is written; the description of the class
            lists the endings.
        overwrite : bool
            Replace a file that exists.

        Returns
        -------
        Path
            The path that was written.

        Raises
        ------
        InputError
            If the file exists, cannot be written, or has another ending.
        """
        out, writers = check_output(path, overwrite), self._writers()
        if out.suffix not in writers:
            choice = " or ".join(f"{ending} for {holds}" for ending, (holds, _) in writers.items())
            raise InputError(f"{path}: end the name in {choice}")
        writers[out.suffix][1](out, overwrite)
        return out


class HasPage:
    """A value that is shown as a page."""

    def _write_page(self, path: Path) -> Path:
        raise NotImplementedError

    def to_html(self, path: str | Path) -> Path:
        """Write this value as a page.

        Parameters
        ----------
        path : str or Path
            The page, which works offline; a file that exists is replaced.

        Returns
        -------
        Path
            The path that was written.

        Raises
        ------
        InputError
            If the file cannot be written.
        """
        return self._write_page(Path(path))
