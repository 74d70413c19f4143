"""Tags of recordings, in a file next to them."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from dearig.errors import InputError
from dearig.recording.reading.tags import (
    TAGS_FILE,
    Tagged,
    clean_tags,
    read_tags,
    tags_of,
    write_tags,
)


def test_tags_are_separated_by_commas_or_semicolons_and_each_is_kept_once() -> None:
    assert clean_tags(" good, film 7 ;good,,  new   grease ") == ("good", "film 7", "new grease")
    assert clean_tags("") == ()
    assert clean_tags("a\x1b[2Jb") == ("a\\x1b[2Jb",)
    with pytest.raises(InputError, match="at most 40"):
        clean_tags("x" * 41)
    with pytest.raises(InputError, match="at most 20"):
        clean_tags(",".join(map(str, range(21))))


def test_tags_stay_with_a_renamed_recording_and_do_not_go_to_another(tmp_path: Path) -> None:
    assert read_tags(tmp_path) == ()
    write_tags(tmp_path, [Tagged("a.h5", "one", ("good",)), Tagged("b.h5", "two", ("bad",))])
    known = read_tags(tmp_path)
    assert tags_of(known, "renamed.h5", "one") == ("good",)
    assert tags_of(known, "a.h5", "three") == ()
    # a file that cannot be read has no identifier: its name has to do
    assert tags_of(known, "a.h5", "") == ("good",)


def test_other_tags_stay_when_some_are_changed_or_removed(tmp_path: Path) -> None:
    write_tags(tmp_path, [Tagged("a.h5", "one", ("good",)), Tagged("b.h5", "two", ("bad",))])
    write_tags(tmp_path, [Tagged("c.h5", "one", ("best", "kept"))])
    assert read_tags(tmp_path) == (
        Tagged("b.h5", "two", ("bad",)),
        Tagged("c.h5", "one", ("best", "kept")),
    )
    write_tags(tmp_path, [Tagged("b.h5", "two", ())])
    assert [row.file for row in read_tags(tmp_path)] == ["c.h5"]


@pytest.mark.parametrize(
    "content",
    [
        "", "[]", "{}", "[" * 5000, '{"format": "dearig-tags/9", "recordings": []}',
        '{"format": "dearig-tags/1"}', '{"format": "dearig-tags/1", "recordings": [{"file": 1}]}',
        json.dumps({
            "format": "dearig-tags/1",
            "recordings": [{"file": "a", "identifier": "", "tags": ["x" * 99]}],
        }),
    ],
)  # fmt: skip
def test_a_file_that_is_none_is_refused_and_not_overwritten(tmp_path: Path, content: str) -> None:
    path = tmp_path / TAGS_FILE
    path.write_text(content)
    with pytest.raises(InputError):
        read_tags(tmp_path)
    with pytest.raises(InputError):
        write_tags(tmp_path, [Tagged("a.h5", "one", ("good",))])
    assert path.read_text() == content
