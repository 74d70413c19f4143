"""Child processes that import nothing from the folder in which the operator works.

Python puts the working folder on the path of ``python -c`` and ``python -m``. A file ``queue.py``
or ``numbers.py`` there would replace the standard library's module in a child process.
"""

from __future__ import annotations

import json
import os
import select
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from types import ModuleType
from typing import IO

import dearig
import dearig.drivers
from dearig.drivers.processes import isolated

__all__ = [
    "child_environment",
    "child_path",
    "has_unread",
    "isolated_command",
    "isolated_spawn",
]


def child_path() -> list[str]:
    """Return ``sys.path`` without the working folder, in whatever form it is written there.

    A working folder from which this program itself was imported stays: without it a child process
    could not start.
    """
    try:
        working = Path.cwd().resolve()
    except OSError:  # the working folder was deleted
        return [entry for entry in sys.path if Path(entry).is_absolute()]
    own = (Path(dearig.__path__[0]) / "__init__.py").resolve()
    serves = (working / "dearig" / "__init__.py").resolve() == own
    return [entry for entry in sys.path if entry and (serves or Path(entry).resolve() != working)]


def child_environment() -> dict[str, str]:
    """Return the environment for a child process, in which ``child_path`` is the whole path."""
    return {
        **os.environ,
        "PYTHONPATH": os.pathsep.join(child_path()),
        "PYTHONSAFEPATH": "1",  # as the option -P
    }


def isolated_command(module: str, *arguments: str) -> list[str]:
    """Return the command of a child process that calls ``module.main(*arguments)``.

    The child loads this package from the folder from which this process has it, and all else from
    the standard library and the installed distributions; the rest of ``child_path`` is searched
    last. ``-I`` keeps out the environment (``PYTHONPATH``, ``PYTHONSTARTUP``), the working folder
    and the user's own site folder.
    """
    packages = {
        package.__name__: str(Path(package.__path__[0]).resolve())
        for package in (dearig, dearig.drivers)
    }
    places = {"packages": packages, "path": [e for e in child_path() if Path(e).is_absolute()]}
    script = str(Path(isolated.__file__).resolve())
    command = [sys.executable, "-I", "-X", "utf8", script, module, json.dumps(places)]
    return [*command, *arguments]


def has_unread(pipe: IO[str] | None) -> bool:
    """Return True if ``pipe`` holds data that was not read yet; it never waits.

    On Windows it returns False: a look into a pipe waits there while another thread reads it.
    """
    if sys.platform == "win32" or pipe is None or pipe.closed:
        return False
    try:
        # not select(), which fails for files numbered 1024 and above
        poll = select.poll()
        poll.register(pipe, select.POLLIN)
        return any(event & select.POLLIN for _, event in poll.poll(0))
    except ValueError:  # closed by the thread that reads it
        return False


@contextmanager
def isolated_spawn() -> Iterator[None]:
    """Make ``multiprocessing`` spawn processes with ``child_environment`` within the body.

    ``multiprocessing`` has no parameters for these: it passes on ``sys.path`` and the environment
    as they are when a process starts. It also makes the child import the main module again, which
    fails for a module of the working folder (``python -m``): the child gets an empty one. The end
    of the body restores all of them.
    """
    main, sys.modules["__main__"] = sys.modules["__main__"], ModuleType("__main__")
    path, names = sys.path.copy(), ("PYTHONPATH", "PYTHONSAFEPATH")
    before = {name: os.environ.get(name) for name in names}
    wanted = child_environment()
    os.environ.update({name: wanted[name] for name in names})
    sys.path[:] = child_path()
    try:
        yield
    finally:
        sys.modules["__main__"] = main
        sys.path[:] = path
        for name, value in before.items():
            if value is None:
                del os.environ[name]
            else:
                os.environ[name] = value
