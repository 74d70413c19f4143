"""The documents as pages: all of them are found, packaged, named and built."""

from __future__ import annotations

import fnmatch
import re
import tomllib
from html.parser import HTMLParser
from pathlib import Path
from urllib.parse import unquote

import pytest

from dearig.docs import HOME, build, page_named, pages
from dearig.errors import InputError
from tests.tools.command import dearig, done

ROOT = Path(__file__).parents[2]
FOLDERS = ("app", "drivers", "model", "sim_backend")


class _Addresses(HTMLParser):
    """Targets of a page's links and pictures, and its anchors."""

    def __init__(self) -> None:
        super().__init__()
        self.targets: list[str] = []
        self.anchors: set[str] = set()

    def handle_starttag(self, _tag: str, attrs: list[tuple[str, str | None]]) -> None:
        for name, value in attrs:
            if name in ("href", "src") and value:
                self.targets.append(value)
            if name == "id" and value:
                self.anchors.add(value)


def addresses(html: Path) -> _Addresses:
    found = _Addresses()
    found.feed(html.read_text(encoding="utf-8"))
    return found


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    return build(tmp_path_factory.mktemp("site"))


def test_every_markdown_file_of_the_packages_is_a_page() -> None:
    files = {
        file.relative_to(ROOT).as_posix()
        for name in FOLDERS
        for file in (ROOT / name).rglob("*.md")
    }
    assert {page.path for page in pages()} == files


def test_every_page_and_picture_is_package_data() -> None:
    setuptools = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["tool"]["setuptools"]
    packaged: set[Path] = set()
    for package in setuptools["packages"]:
        base, rest = _base(package, setuptools["package-dir"])
        folder = ROOT / "/".join([setuptools["package-dir"][base], *rest])
        for name, patterns in setuptools["package-data"].items():
            if fnmatch.fnmatch(package, name):
                packaged |= {file for pattern in patterns for file in folder.glob(pattern)}
    missing = [page.path for page in pages() if page.file not in packaged]
    assert missing == []
    pictures = set((ROOT / "app" / "docs" / "pictures").rglob("*.png"))
    assert pictures
    assert pictures <= packaged


def _base(package: str, folders: dict[str, str]) -> tuple[str, list[str]]:
    """The longest package with a folder of its own, and what follows it."""
    base = max((b for b in folders if f"{package}.".startswith(f"{b}.")), key=len)
    return base, package.removeprefix(base).strip(".").split(".") if package != base else []


def test_the_first_page_comes_first_and_sections_stay_together() -> None:
    assert pages()[0].path == HOME
    sections = [page.section for page in pages()]
    assert len(set(sections)) == sum(
        a != b for a, b in zip([None, *sections], sections, strict=False)
    )


def test_every_built_link_and_anchor_resolves(site: dict[str, Path]) -> None:
    broken = []
    found = {html: addresses(html) for html in site.values()}
    for html, page in found.items():
        for target in page.targets:
            if re.match(r"https?:|mailto:", target):
                continue
            where, _, anchor = unquote(target).partition("#")
            file = (html.parent / where).resolve() if where else html
            if not file.is_file() or (anchor and anchor not in found[file].anchors):
                broken.append(f"{html}: {target}")
    assert broken == []


def test_pages_need_no_network(site: dict[str, Path]) -> None:
    for html in site.values():
        text = html.read_text(encoding="utf-8")
        assert not re.search(r"<(script|link)\b|@import|url\(", text)
        assert 'src="http' not in text


@pytest.mark.parametrize(
    ("name", "path"),
    [
        ("tutorial", "app/docs/tutorial.md"),
        ("SAFETY", "drivers/SAFETY.md"),
        ("drivers", "drivers/README.md"),
        ("drivers/safety.md", "drivers/SAFETY.md"),
        ("window", "app/docs/window.md"),
        ("app/docs/README.md", HOME),
        ("readme", HOME),
    ],
)
def test_a_page_is_found_by_a_short_name(name: str, path: str) -> None:
    assert page_named(name).path == path


def test_an_unknown_page_is_refused_with_the_nearest_names() -> None:
    with pytest.raises(InputError, match=r"no document is named 'tutorail'.*tutorial"):
        page_named("tutorail")


def test_docs_writes_the_pages_and_says_where(tmp_path: Path) -> None:
    answer = done("docs", "safety", "--no-browser", "--out", tmp_path / "site")
    opened = Path(answer.out.strip())
    assert opened == (tmp_path / "site" / "drivers" / "SAFETY.html").resolve()
    assert "hardware interlock" in opened.read_text(encoding="utf-8")


@pytest.mark.deep
def test_docs_opens_the_first_page_in_the_browser(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    opened: list[str] = []
    monkeypatch.setattr("webbrowser.open", lambda address: opened.append(address) or True)
    done("docs", "--out", tmp_path / "site")
    assert opened == [(tmp_path / "site" / "app" / "docs" / "README.html").resolve().as_uri()]


def test_docs_refuses_a_folder_that_holds_something(tmp_path: Path) -> None:
    (tmp_path / "mine.txt").write_text("kept", encoding="utf-8")
    answer = dearig("docs", "--no-browser", "--out", tmp_path)
    assert answer.code == 2
    assert "is not empty" in answer.err
    assert [p.name for p in tmp_path.iterdir()] == ["mine.txt"]
