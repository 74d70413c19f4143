"""Every write boundary of a small run; ``python -m tests.crash`` does the same of longer ones."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.crash.__main__ import replay
from tests.crash.changes import able
from tests.deep import mostly_deep


@pytest.mark.slow
@pytest.mark.skipif(not able(), reason="writes are noted with a C compiler on Linux only")
@pytest.mark.parametrize("every", mostly_deep([1, 8], [8]))
def test_no_crash_point_loses_what_was_flushed(tmp_path: Path, every: int) -> None:
    points, rich = replay(tmp_path, blocks=2, size=200, overwrite=True, torn=False, every=every)
    assert points > rich > 30 // every
