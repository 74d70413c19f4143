from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace

import pytest

import dearig
from dearig.errors import InputError
from dearig.report.pages import pdf
from dearig.report.pages.html import write_page
from dearig.report.pages.pdf import print_report, write_pdf
from dearig.report.pages.seal import _HEAD, sealed

PAGE = sealed(f"{_HEAD}<title>t</title></head><body><p>a &lt; b</p></body></html>\n")


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
    # of this module alone: libraries start programs while they are imported
    alone = SimpleNamespace(run=run, TimeoutExpired=subprocess.TimeoutExpired)
    monkeypatch.setattr(pdf, "subprocess", alone)
    monkeypatch.delenv(pdf.BROWSER, raising=False)
    return pages


def test_a_report_is_printed_beside_itself_and_nothing_is_left(tmp_path, prints):
    (tmp_path / "report.html").write_text(PAGE, encoding="utf-8")
    print_report(tmp_path / "report.html", tmp_path / "report.pdf")
    assert prints == [PAGE]
    assert sorted(p.name for p in tmp_path.iterdir()) == ["report.html", "report.pdf"]


def test_only_reports_of_this_program_are_printed(tmp_path, prints):
    for page, words in (
        ("<p>hello</p>", "is not a report of this program"),
        (PAGE.replace("a &lt;", "c &lt;"), "was changed after it was written"),
        (sealed("<p>x</p>" + _HEAD), "is not a report of this program"),
        (sealed(_HEAD.replace("&#39;none&#39;", "*", 1)), "is not a report of this program"),
    ):
        (tmp_path / "page.html").write_text(page, encoding="utf-8", newline="\n")
        with pytest.raises(InputError, match=words):
            print_report(tmp_path / "page.html", tmp_path / "page.pdf")
    assert prints == []


@pytest.mark.parametrize(
    "inside",
    [
        "<script>1</script>", "<IFRAME src=x>", "<!--><b>-->", '<meta http-equiv="refresh">',
        "<img src=x>", "<link rel=x>", "<object>", "<base href=x>", "<?xml ?>", "<![CDATA[ ]]>",
        "<foreignObject>", "<title><script>", "</ script>", "<form>", "<image href=x>", "<embed>",
    ],
)  # fmt: skip
def test_a_page_with_anything_that_acts_is_refused(tmp_path, prints, inside):
    page = PAGE.partition("<!-- dearig")[0].replace("a &lt; b", inside)
    (tmp_path / "page.html").write_text(sealed(page), encoding="utf-8", newline="\n")
    with pytest.raises(InputError, match="which no report has"):
        print_report(tmp_path / "page.html", tmp_path / "page.pdf")
    assert prints == []


@pytest.mark.skipif(sys.platform == "win32", reason="no pipes in folders")
def test_a_pipe_is_no_report(tmp_path, prints):
    os.mkfifo(tmp_path / "page.html")
    with pytest.raises(InputError, match="is a pipe, not a file"):
        print_report(tmp_path / "page.html", tmp_path / "page.pdf")
    assert prints == []


@pytest.mark.skipif(shutil.which("chromium") is None, reason="no chromium")
def test_chromium_prints_a_report(tmp_path):
    """With figures as a run's report has them, and with every switch that keeps it alone."""
    recording = dearig.record("validation-a-1.0", path=tmp_path / "r.h5")
    recording.to_html(tmp_path / "report.html")
    print_report(tmp_path / "report.html", tmp_path / "report.pdf")
    printed = (tmp_path / "report.pdf").read_bytes()
    assert printed.startswith(b"%PDF")
    assert printed.rstrip().endswith(b"%%EOF")


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
