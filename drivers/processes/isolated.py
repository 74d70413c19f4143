"""Start of a child process that imports nothing from the folder in which the operator works.

It is run by its path with ``python -I``; ``MODULE JSON ARGUMENT`` calls ``MODULE.main(ARGUMENT)``.
The JSON has ``packages``, names and folders, each imported from that folder, and ``path``, entries
appended to ``sys.path``: neither can replace a module of the standard library or of an installed
distribution. ``processes.isolated_command`` writes this command.
"""

from __future__ import annotations

import importlib
import importlib.util
import json
import sys
from pathlib import Path


def main() -> int:
    """Import the packages, then the module, and call its ``main``; returns the exit code."""
    name, places, *arguments = sys.argv[1:]
    settings = json.loads(places)
    sys.path += [entry for entry in settings["path"] if entry not in sys.path]
    for package, folder in settings["packages"].items():
        _import_from(package, Path(folder))
    code: int = importlib.import_module(name).main(*arguments)
    return code


def _import_from(package: str, folder: Path) -> None:
    spec = importlib.util.spec_from_file_location(
        package, folder / "__init__.py", submodule_search_locations=[str(folder)]
    )
    if spec is None or spec.loader is None:
        raise ImportError(f"{folder} is not a package")
    module = sys.modules[package] = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    parent, _, child = package.rpartition(".")
    if parent:
        setattr(sys.modules[parent], child, module)


if __name__ == "__main__":
    sys.exit(main())
