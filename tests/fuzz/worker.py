"""Reads inputs in a process that may crash or hang: ``python -m tests.fuzz.worker TARGET ...``."""

from __future__ import annotations

import hashlib
import random
import sys
import traceback
import warnings
from pathlib import Path

from dearig.errors import InputError
from tests.fuzz.targets import TARGETS, seeds_of

__all__ = ["complaint", "input_of"]

#: Bytes of address space besides what the libraries take: what a small file may cost.
MEMORY = 2**31
#: Longer than this no sentence is.
SENTENCE = 3000


def input_of(name: str, seeds: list[bytes], seed: int, index: int) -> bytes:
    """Input ``index`` of the target ``name``: the same whenever it is asked for."""
    return TARGETS[name].mutate(random.Random(f"{name} {seed} {index}"), seeds)  # noqa: S311


def complaint(name: str, path: Path) -> str | None:
    """What is wrong with how ``path`` was read; None if it was, or was refused in a sentence."""
    try:
        TARGETS[name].read(path)
    except InputError as error:
        text = str(error)
        if "\n" in text:
            return f"more than one line: {text!r}"
        if len(text) > SENTENCE:
            return f"a sentence of {len(text)} characters: {text[:200]!r}"
        if path.name not in text:
            return f"the file is not named: {text!r}"
    except Exception:  # noqa: BLE001  (what is looked for)
        return traceback.format_exc()
    return None


def limit_memory() -> None:
    """Where the system can: this process gets no more than it has and ``MEMORY``."""
    if sys.platform == "linux":
        import resource

        pages = int(Path("/proc/self/statm").read_text("ascii").split()[0])
        limit = pages * resource.getpagesize() + MEMORY
        resource.setrlimit(resource.RLIMIT_AS, (limit, limit))


def main(name: str, seed: int, first: int, last: int, folder: Path) -> None:
    target = TARGETS[name]
    seeds = seeds_of(name)
    current = folder / f"current{target.suffix}"
    for raw in seeds:
        current.write_bytes(raw)
        if (found := complaint(name, current)) is not None:
            raise SystemExit(f"a good file of {name} is not read: {found}")
    warnings.simplefilter("ignore")
    limit_memory()
    for index in range(first, last):
        raw = input_of(name, seeds, seed, index)
        current.write_bytes(raw)
        # the parent sees a crash or a hang by where this stands still
        print(index, flush=True)
        if (found := complaint(name, current)) is not None:
            key = hashlib.sha256(found.splitlines()[-1].encode()).hexdigest()[:8]
            stem = folder / f"{name.replace(' ', '-')}-{key}"
            if not stem.with_suffix(".txt").exists():
                stem.with_suffix(target.suffix).write_bytes(raw)
                stem.with_suffix(".txt").write_text(f"{name} {seed} {index}\n{found}", "utf-8")


if __name__ == "__main__":
    main(sys.argv[1], int(sys.argv[2]), int(sys.argv[3]), int(sys.argv[4]), Path(sys.argv[5]))
