from __future__ import annotations

import shutil
import subprocess
from pathlib import Path

import pytest

from dearig.errors import InputError
from dearig.report.pages import pdf
from dearig.report.pages.html import write_page
from dearig.report.pages.pdf import print_report, write_pdf

PAGE = '<!DOCTYPE html><head><meta charset="utf-8"><meta name="generator" content="dearig"></head>'


@pytest.fixture
def prints(monkeypatch):
    """A browser that prints the length of the page; returns the pages that it was given."""
    pages: list[str] = []

    def run(command, **_):
        out = next(a.partition("=")[2] for a in command if a.startswith("--print-to-pdf="))
        source = Path(out).with_name("report.html")
        assert command[-1] == source.as_uri()
        pages.append(source.read_text("utf-8"))
        Path(out).write_bytes(b"%PDF")
        return subprocess.CompletedProcess(command, 0, b"", b"")

    monkeypatch.setattr(shutil, "which", lambda name: name if name == "chromium" else None)
    monkeypatch.setattr(pdf.subprocess, "run", run)
    monkeypatch.delenv(pdf.BROWSER, raising=False)
    return pages


def test_a_report_is_printed_beside_itself_and_nothing_is_left(tmp_path, prints):
    (tmp_path / "report.html").write_text(PAGE, encoding="utf-8")
    print_report(tmp_path / "report.html", tmp_path / "report.pdf")
    assert prints == [PAGE]
    assert sorted(p.name for p in tmp_path.iterdir()) == ["report.html", "report.pdf"]


def test_only_reports_of_this_program_are_printed(tmp_path, prints):
    (tmp_path / "page.html").write_text("<script>1</script>", encoding="utf-8")
    with pytest.raises(InputError, match="is no report of this program"):
        print_report(tmp_path / "page.html", tmp_path / "page.pdf")
    assert prints == []


def test_a_browser_that_prints_nothing_is_told(tmp_path, prints, monkeypatch):
    failed = subprocess.CompletedProcess([], 1, b"", b"first\nno display")
    monkeypatch.setattr(pdf.subprocess, "run", lambda *_, **__: failed)
    with pytest.raises(InputError, match="chromium printed no PDF: no display"):
        write_pdf(PAGE, tmp_path / "report.pdf")
    assert list(tmp_path.iterdir()) == []


def test_without_a_browser_one_sentence_says_what_to_install(tmp_path, monkeypatch):
    monkeypatch.setattr(shutil, "which", lambda _: None)
    monkeypatch.delenv(pdf.BROWSER, raising=False)
    with pytest.raises(InputError, match="apt install chromium"):
        # before any figure is drawn
        write_page(tmp_path / "report.pdf", "report.html.j2", dict)
    monkeypatch.setenv(pdf.BROWSER, "netscape")
    with pytest.raises(InputError, match="DEARIG_BROWSER names netscape"):
        pdf.check_browser()
