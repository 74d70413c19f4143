"""Print what every hostile input costs: ``python -m tests.security [WORD...]``.

The tests assert memory and answers; seconds depend on the machine and are only shown here.
"""

from __future__ import annotations

import sys
import tempfile
from pathlib import Path

from tests.security.cases import CASES
from tests.security.cost import measuring


def _size(folder: Path) -> int:
    return sum(path.stat().st_size for path in folder.rglob("*") if path.is_file())


def main() -> None:
    words = sys.argv[1:]
    print(f"{'input':45} {'code':>4} {'s':>7} {'MB':>7} {'file MB':>8}  answer")
    with measuring() as measured:
        for name, case in CASES.items():
            if words and not any(word in name for word in words):
                continue
            with tempfile.TemporaryDirectory() as made:
                argv = case.make(Path(made))
                size = _size(Path(made))
                cost = measured.run(argv)
            told = (cost.err or cost.out).decode("utf-8", "replace").strip().replace("\n", " / ")
            told = told.replace(made, "")
            print(
                f"{name:45} {cost.code:4} {cost.seconds:7.2f} {cost.bytes / 1e6:7.0f} "
                f"{size / 1e6:8.2f}  {told[:150]}",
                flush=True,
            )


if __name__ == "__main__":
    main()
