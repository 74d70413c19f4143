"""Numbers that compiled code parses: the nearest doubles, or left to others."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from dearig.recording.importers.formats import text_file
from dearig.recording.importers.formats.number_block import numbers_of
from dearig.recording.importers.formats.text_file import TextFile

RNG = np.random.default_rng(0)


def parsed(
    text: str, delimiter: str | None = ",", decimal: str = ".", places: tuple[int, ...] = (0,),
    cells: int = 1,
) -> tuple[list[list[float]], list[bool]] | None:  # fmt: skip
    room = np.empty((len(places), text.count("\n") + 1))
    found = numbers_of(text.encode(), delimiter, decimal, places, cells, room)
    return None if found is None else (room[:, : found[0]].tolist(), found[1].tolist())


WORDS = {
    "repr": [repr(float(x)) for x in np.exp(RNG.uniform(-500, 500, 5000))],
    "fixed": [f"{x:.6f}" for x in RNG.normal(size=5000)],
    "short exponent": [f"{x:.3e}" for x in np.exp(RNG.uniform(-600, 600, 5000))],
    "many digits": [f"{x:.18e}" for x in np.exp(RNG.uniform(-100, 100, 5000))],
    "odd": ["-0.0", "0", "-5", "+3.25", "1.", ".5", "1e5", "1E-3", "9007199254740993",
            "4503599627370497.5", "4503599627370496.5", "0000000000000000000000001.5",
            "0.00000000000000000000000015"],
    # halfway between two doubles
    "ties": [str((2 * (2**52 + int(m)) + 1) * 2**3) for m in RNG.integers(0, 2**52, 2000)]
    + [str((2 * (2**52 + int(m)) + 1) // 4) + {1: ".25", 3: ".75"}[(2 * int(m) + 1) % 4]
       for m in RNG.integers(0, 2**52, 2000)],
}  # fmt: skip


@pytest.mark.parametrize("kind", WORDS)
def test_numbers_are_the_nearest_doubles(kind: str) -> None:
    words = [word for word in WORDS[kind] if 1e-290 < abs(float(word)) < 1e290 or float(word) == 0]
    found = parsed("\n".join(words))
    assert found is not None
    expected = np.array([float(word) for word in words])
    assert np.array(found[0][0]).tobytes() == expected.tobytes()


@pytest.mark.parametrize(
    "text",
    ["1,2\n3\n", "1,2\n3,\n", "1,a\n", "1,2,3\n", '1,"2"\n', "1,2 #\n", "1 2,3\n", "1;2\n",
     "1,--2\n", "1,1e\n", "1,1.2.3\n", "1,\n", ",1\n", "1,nan\n", "1,1e400\n", "1,1e-310\n",
     "1,12345678901234567890\n", "1,0x10\n", "1,2\xa0\n"],
)  # fmt: skip
def test_what_is_not_plain_is_left_to_others(text: str) -> None:
    assert parsed(text, places=(0, 1), cells=2) is None


def test_other_columns_blank_lines_and_signs() -> None:
    assert parsed("1,5;x y;-7\n\n 2;;3e1 ", ";", ",", (2, 0), 3) == (
        [[-7.0, 30.0], [1.5, 2.0]],
        [True, True],
    )
    assert parsed(" 1  2\t3\n4 5 6\n", None, ".", (0, 2), 3) == (
        [[1.0, 4.0], [3.0, 6.0]],
        [False, False],
    )


def test_a_long_file_is_read_as_a_short_one(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path, rows = tmp_path / "run.csv", 60_000
    volts = RNG.normal(size=rows)
    lines = [f"{n / 1000:.3f},{volt:.5f},{n}" for n, volt in enumerate(volts)]
    lines[50_000] = '50.000,"1.5",50000'  # for pandas
    path.write_text("time_s,voltage_V,displacement_um\n" + "\n".join(lines) + "\n", "utf-8")
    names = ("displacement_um", "time_s", "voltage_V")
    short = TextFile(path).read(names)
    monkeypatch.setattr(text_file, "LONG", 1000)
    long = TextFile(path)
    found = long.read(names)
    for name in names:
        np.testing.assert_allclose(found[name], short[name], rtol=1e-15)
        assert found[name].size == rows
    assert found["voltage_V"][50_000] == 1.5
    assert long.row(50_000) == "line 50002"
