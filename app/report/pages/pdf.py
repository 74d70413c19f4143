"""Reports as PDF: printed by a browser that the computer has, as a person would print them."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

from dearig.errors import InputError
from dearig.input_file import read_input
from dearig.printable import printable
from dearig.report.pages.seal import check_page

__all__ = ["check_browser", "is_pdf", "print_report", "write_pdf"]

#: Environment variable with the program that prints; without it the first that is found does.
BROWSER = "DEARIG_BROWSER"
_NAMES = (
    "chromium", "chromium-browser", "google-chrome", "google-chrome-stable", "chrome",
    "microsoft-edge", "microsoft-edge-stable", "msedge",
)  # fmt: skip
#: Places of browsers that are in no folder of PATH.
_PLACES = (
    "%ProgramFiles(x86)%\\Microsoft\\Edge\\Application\\msedge.exe",
    "%ProgramFiles%\\Microsoft\\Edge\\Application\\msedge.exe",
    "%ProgramFiles%\\Google\\Chrome\\Application\\chrome.exe",
    "%LocalAppData%\\Google\\Chrome\\Application\\chrome.exe",
    "/Applications/Google Chrome.app/Contents/MacOS/Google Chrome",
    "/Applications/Chromium.app/Contents/MacOS/Chromium",
    "/Applications/Microsoft Edge.app/Contents/MacOS/Microsoft Edge",
)
#: Seconds that a browser may take: it needs one for a report, and some to start on a busy computer.
_PATIENCE = 180.0
_LARGEST = 2**28  # bytes of a report, at most: some hundred times those of a diagnosis
#: No page that is printed reaches a network, whatever is in it.
_ALONE = (
    "--proxy-server=127.0.0.1:9", "--proxy-bypass-list=<-loopback>",
    "--host-resolver-rules=MAP * ~NOTFOUND", "--disable-background-networking", "--disable-sync",
    "--disable-component-update", "--disable-default-apps",
)  # fmt: skip


def is_pdf(path: str | Path) -> bool:
    """Return True for a path that ends in ``.pdf``, in small or capital letters."""
    return Path(path).suffix.lower() == ".pdf"


def check_browser() -> str:
    """Return the program that prints pages. Raises ``InputError`` where there is none."""
    asked = os.environ.get(BROWSER, "")
    if asked:
        found = shutil.which(asked)
        if found is None:
            raise InputError(f"{BROWSER} names {asked}, which is not a program that can be started")
        return found
    for name in (*_NAMES, *(os.path.expandvars(place) for place in _PLACES)):
        found = shutil.which(name)
        if found is not None:
            return found
    raise InputError(
        f"a report in PDF is printed by Chromium, Chrome or Edge, and none of them was found: "
        f"install one (Debian and Ubuntu: apt install chromium), name it in {BROWSER}, or write "
        f"the report as .html and print it in any browser"
    )


def print_report(report: str | Path, out: str | Path, overwrite: bool = False) -> Path:
    """Print the report in the HTML file ``report`` to the PDF file ``out``; return its path.

    Raises ``InputError`` for a file that is not a report of this program, or cannot be printed.
    """
    from dearig.recording.files import check_output

    report = Path(report)
    out = check_output(out, overwrite, report)
    try:
        page = read_input(report, "report", _LARGEST).decode("utf-8")
    except ValueError as error:
        raise InputError(f"the report {report} cannot be read: it is not text") from error
    return write_pdf(page, out, overwrite, str(report))


def write_pdf(page: str, out: Path, overwrite: bool = True, name: str = "the report") -> Path:
    """Print ``page``, the HTML of a report, to the PDF file ``out``. Raises ``InputError``.

    ``name`` is that of the page, for messages. A page that could run or load anything is refused.
    """
    from dearig.recording.files import replaced_when_done

    check_page(page, name)
    browser = check_browser()
    # next to the result and not in the folder for temporary files: a browser from a snap or a
    # flatpak is not allowed to see that
    with (
        tempfile.TemporaryDirectory(prefix="dearig-pdf-", dir=out.parent) as folder,
        tempfile.TemporaryDirectory(prefix="dearig-pdf-") as profile,
    ):
        source, printed = Path(folder) / "report.html", Path(folder) / "report.pdf"
        source.write_text(page, encoding="utf-8", errors="replace", newline="\n")
        said = _run(browser, profile, source, printed)
        if not printed.is_file() or printed.stat().st_size == 0:
            raise InputError(f"{browser} printed no PDF: {said}; write the report as .html")
        with replaced_when_done(out, overwrite) as partial:
            partial.write_bytes(printed.read_bytes())
    return out


def _run(browser: str, profile: str, source: Path, printed: Path) -> str:
    """Let ``browser`` print ``source`` to ``printed``; return the last line that it said."""
    command = [
        browser, "--headless", *_ALONE, "--disable-gpu", "--no-first-run", "--disable-extensions",
        f"--user-data-dir={profile}", "--no-pdf-header-footer", "--generate-pdf-document-outline",
        f"--print-to-pdf={printed.resolve()}", source.resolve().as_uri(),
    ]  # fmt: skip
    if sys.platform != "win32" and os.geteuid() == 0:
        # it refuses to start as root with a sandbox, as in containers; ``check_page`` has let
        # nothing through that could run
        command.insert(1, "--no-sandbox")
    try:
        done = subprocess.run(  # noqa: S603  (a browser of the computer, arguments of this program)
            command, capture_output=True, check=False, timeout=_PATIENCE
        )
    except subprocess.TimeoutExpired:
        return f"it did not end within {_PATIENCE:g} s"
    except OSError as error:
        return error.strerror or str(error)
    lines = done.stderr.decode("utf-8", errors="replace").strip().splitlines()
    return printable(lines[-1], most=300) if lines else f"it ended with code {done.returncode}"
