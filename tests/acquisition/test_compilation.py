"""The kernels of a call are known before they are compiled, and counted while they are."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from dearig.acquisition.compilation import compilation_reported, kernels_of
from dearig.model.compiled.jit import inlined, jit
from dearig.model.kernel.drive import drive_by_voltage

PROGRAM = """\
import json
from dearig.acquisition.warm_up import compile_kernels
stages = []
compile_kernels(lambda stage, part: stages.append(stage))
print(json.dumps(stages))
"""


def _made():
    """Return kernels that call each other, and a function of Python that enters them."""

    @jit
    def square(x: float) -> float:
        return x * x

    @inlined
    def doubled(x: float) -> float:
        return 2.0 * square(x)

    @jit
    def never(x: float) -> float:
        return x

    @jit
    def outer(x: float) -> float:
        return doubled(x) + 1.0

    return square, doubled, never, outer


def test_kernels_of_a_call_are_those_that_it_reaches_but_for_inlined_ones() -> None:
    square, doubled, never, outer = _made()
    assert kernels_of(outer) == {outer, square}
    assert kernels_of(doubled) == {square}
    assert kernels_of(never, square) == {never, square}
    assert kernels_of(len) == set()
    # through a function of Python, which numba does not see
    assert len(kernels_of(drive_by_voltage)) > 100


def test_kernels_are_counted_until_all_are_ready() -> None:
    square, _, _, outer = _made()
    seen: list[tuple[int, int]] = []
    with compilation_reported(lambda *told: seen.append(told), (outer,)):
        assert outer(3.0) == 19.0
    ready, needed = np.array(seen).T
    assert len(set(needed)) == 1  # known from the first on
    assert np.all(np.diff(ready) >= 0)
    assert ready[-1] - ready[0] == 2
    before = len(seen)
    with compilation_reported(lambda *told: seen.append(told), (outer,)):
        assert square(2.0) == 4.0  # compiled already
    assert len(seen) == before


@pytest.mark.deep
def test_the_number_of_kernels_at_a_first_start_is_right_from_the_first_on(tmp_path: Path) -> None:
    tmp_path.chmod(0o700)
    done = subprocess.run(
        [sys.executable, "-c", PROGRAM],
        env={**os.environ, "NUMBA_CACHE_DIR": str(tmp_path)},
        capture_output=True,
        text=True,
        check=True,
    )
    counted = [(int(w[1]), int(w[3])) for w in map(str.split, json.loads(done.stdout))]
    assert counted[-1][0] == counted[-1][1] == len(list(tmp_path.rglob("*.nbi")))
    assert counted[0][1] > 0.9 * counted[-1][1]
