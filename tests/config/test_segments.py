"""Kinds of segment: the contract, the generated example and page, kinds of other distributions."""

from __future__ import annotations

from pathlib import Path
from typing import cast

import numpy as np
import pytest

from dearig.acquisition.plan import plan
from dearig.config.rigfile import RigFile
from dearig.config.segments import SEGMENT_KINDS, SegmentTable
from dearig.config.segments.contract import check_segment
from dearig.config.segments.levels import HoldSegment
from dearig.config.sequence_example import example, page
from dearig.config.sequencefile import parse_sequence
from dearig.drivers.registry import EntryError
from dearig.model.simulation.excitation import Segment
from tests.tools.plugins import run_with_distribution

WAVEFORM = "time_s,voltage_kV\n0,0\n1,3\n2,0\n"


@pytest.mark.parametrize("kind", SEGMENT_KINDS)
def test_every_kind_keeps_the_contract(tmp_path: Path, kind: str) -> None:
    (tmp_path / "waveform.csv").write_text(WAVEFORM, encoding="utf-8")
    check_segment(kind, SEGMENT_KINDS[kind], tmp_path)


class Jumping(HoldSegment):
    """A hold that says it ends elsewhere than it does."""

    def build(self, folder: Path) -> Segment:
        built = super().build(folder)

        class Wrong:
            duration, start, voltage = built.duration, built.start, built.voltage
            end = 1000.0

            def after(self, end: float) -> Segment:  # noqa: ARG002
                return self  # type: ignore[return-value]

        return Wrong()


class Noisy(HoldSegment):
    """A hold with noise that is drawn again whenever it is computed."""

    def build(self, folder: Path) -> Segment:
        built = super().build(folder)
        generator = np.random.default_rng(0)

        class Wrong:
            duration, start, end = built.duration, built.start, built.end

            def after(self, end: float) -> Segment:  # noqa: ARG002
                return cast("Segment", self)

            def voltage(self, t: np.ndarray) -> np.ndarray:
                return built.voltage(t) + 1e-6 * generator.standard_normal(t.size)

        return cast("Segment", Wrong())


class Undescribed(HoldSegment):
    """A kind with a key that no one explains."""

    level_kV: float = 0.0


class Refused(HoldSegment):
    """A kind whose example lacks a key."""

    example = {}  # noqa: RUF012


@pytest.mark.parametrize(
    ("kind", "match"),
    [
        (Jumping, "0 V at the end, and end is 1000 V"),
        (Noisy, "other values when it is asked again"),
        (Undescribed, "the key level_kV has no description"),
        (Refused, "its example is refused"),
    ],
)
def test_the_contract_finds_a_fault(tmp_path: Path, kind: type[SegmentTable], match: str) -> None:
    with pytest.raises(EntryError, match=match):
        check_segment("hold", kind, tmp_path)


def test_the_example_plays_every_kind_within_the_default_limits() -> None:
    text = example()
    loaded = parse_sequence(text, "example", Path())
    assert set(loaded.sequence.labels) == set(SEGMENT_KINDS) - {"csv"}
    assert plan(loaded, RigFile(), None, "").admitted().samples


def test_the_example_with_its_comments_removed_is_the_same_sequence(tmp_path: Path) -> None:
    (tmp_path / "waveform.csv").write_text(WAVEFORM, encoding="utf-8")
    # keys with a default stand there as "# key = value  # meaning"; headers and hints do not parse
    lines = [
        line.removeprefix("# ") if _is_setting(line) or _is_csv(line) else line
        for line in example().splitlines()
    ]
    full = parse_sequence("\n".join(lines), "example", tmp_path).sequence
    short = parse_sequence(example(), "example", tmp_path).sequence
    assert full.labels == (*short.labels, "csv")
    assert full.segments[:-1] == short.segments


def _is_setting(line: str) -> bool:
    key, _, value = line.removeprefix("# ").partition(" = ")
    return line.startswith("# ") and key.isidentifier() and not value.startswith(" #")


def _is_csv(line: str) -> bool:
    return line == "# [[segment]]"


def test_the_page_explains_every_key_of_every_kind() -> None:
    text = page()
    for name, kind in SEGMENT_KINDS.items():
        section = text.split(f"\n## {name}\n", 1)[1].split("\n## ", 1)[0]
        for key, info in kind.model_fields.items():
            if key != "kind":
                assert f"| `{key}` | {info.description} |" in section


def readme_example() -> str:
    """Return the kind that the how-to writes, so that the how-to is tested."""
    text = (Path(__file__).parents[2] / "app/config/segments/README.md").read_text("utf-8")
    return text.split("```python\n", 1)[1].split("```", 1)[0]


def test_a_kind_of_another_distribution_is_found_everywhere(tmp_path: Path) -> None:
    found = run_with_distribution(
        tmp_path,
        {"sawtooth.py": readme_example()},
        {"dearig.segments": {"sawtooth": "sawtooth:Sawtooth"}},
        """
        from pathlib import Path
        import sawtooth  # whoever imports the kind first must not break the registry
        from dearig.config.segments import SEGMENT_KINDS
        from dearig.config.segments.contract import check_segment
        from dearig.config.sequence_example import example, page
        from dearig.config.sequencefile import parse_sequence
        check_segment("sawtooth", SEGMENT_KINDS["sawtooth"], Path())
        print("## sawtooth" in page(), 'kind = "sawtooth"' in example(), SEGMENT_KINDS.left_out)
        text = 'name = "x"\\nlead_in_s = 0\\n[[segment]]\\nkind = "sawtooth"\\n'
        text += "amplitude_kV = 3.0\\nrise_s = 0.5\\n"
        print(parse_sequence(text, "x", Path()).sample(1000.0)[1].max())
        """,
    )
    assert found.splitlines() == ["True True ()", "3000.0"]


#: Kinds that cannot be used: the object that is named, its module, and what is said.
UNUSABLE = {
    "hold": ("Thing", "Thing = 1", "the name 'hold' is already taken"),
    "number": ("Thing", "Thing = 1", "not a subclass of dearig.config.segments.Segment"),
    "absent": ("Thing", "import no_such_module_at_all", "no_such_module_at_all"),
    "leaving": ("Thing", "raise SystemExit(3)", "3"),
    "nameless": ("Gone", "Thing = 1", "Gone"),
    "other": (
        "Thing",
        "from dearig.config.segments.levels import HoldSegment as Thing",
        'must be of the type Literal["other"]',
    ),
}


def test_kinds_that_cannot_be_used_are_left_out_with_a_sentence(tmp_path: Path) -> None:
    found = run_with_distribution(
        tmp_path,
        {f"bad_{name}.py": source for name, (_, source, _) in UNUSABLE.items()},
        {"dearig.segments": {name: f"bad_{name}:{made[0]}" for name, made in UNUSABLE.items()}},
        """
        from dearig.config.segments import SEGMENT_KINDS
        print(len(SEGMENT_KINDS), SEGMENT_KINDS["hold"].__module__)
        print(*SEGMENT_KINDS.left_out, sep="\\n")
        """,
    )
    count, *sentences = found.splitlines()
    assert count == f"{len(SEGMENT_KINDS)} dearig.config.segments.levels"
    begins = "the plug-in {} (dearig.segments) of made is left out: "
    for name, (_, _, words) in UNUSABLE.items():
        (sentence,) = (said for said in sentences if said.startswith(begins.format(name)))
        assert words in sentence.removeprefix(begins.format(name))
    assert len(sentences) == len(UNUSABLE)
