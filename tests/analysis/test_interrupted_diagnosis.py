"""Ctrl-C in the seconds after a search loses nothing of what it has found."""

from __future__ import annotations

import signal

import pytest

from dearig.analysis import diagnose


def test_the_first_one_after_the_search_lets_the_outcome_be_computed(monkeypatch):
    found = object()

    def outcome(*given: object) -> object:
        signal.raise_signal(signal.SIGINT)
        return given[2]

    monkeypatch.setattr(diagnose, "read_all", lambda *_: ([], []))
    monkeypatch.setattr(diagnose, "_prepared", lambda *_: (None, ()))
    monkeypatch.setattr(diagnose, "_search", lambda *_: found)
    monkeypatch.setattr(diagnose, "_budgeted", lambda finding, *_: finding)
    monkeypatch.setattr(diagnose, "_outcome", outcome)
    assert diagnose.diagnose_recordings([]) is found


def test_the_second_one_ends_it(monkeypatch):
    def outcome(*_: object) -> None:
        signal.raise_signal(signal.SIGINT)
        signal.raise_signal(signal.SIGINT)

    monkeypatch.setattr(diagnose, "read_all", lambda *_: ([], []))
    monkeypatch.setattr(diagnose, "_prepared", lambda *_: (None, ()))
    monkeypatch.setattr(diagnose, "_search", lambda *_: None)
    monkeypatch.setattr(diagnose, "_budgeted", lambda *_: None)
    monkeypatch.setattr(diagnose, "_outcome", outcome)
    with pytest.raises(KeyboardInterrupt):
        diagnose.diagnose_recordings([])
