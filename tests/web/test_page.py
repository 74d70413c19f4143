"""What the page shows, who may read it, and that nothing can be changed through it."""

from __future__ import annotations

import asyncio
import re
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("starlette", reason='takes the extra "web"')

from dearig.batch.watching import Bins, SourceWatch
from dearig.drivers.rig import Block, Event
from dearig.web.app import watch_app
from dearig.web.feed import Feed
from dearig.web.server import token_from
from dearig.web.state import look
from tests.tools.asgi import ask, asked
from tests.tools.command import dearig, refused
from tests.tools.played import Bench, Killed
from tests.tools.recordings import run_counts, writer

TOKEN = "a token that no one guesses".replace(" ", "-")
HOSTILE = "<img src=x onerror=alert(1)>\u202e"


def shown(source: Path, host: str = "127.0.0.1", token: str | None = None):
    watch = SourceWatch(source)
    return watch_app(Feed(lambda: look(watch), 0.0), host, 8642, token)


@pytest.fixture
def page(made_runs, tmp_path: Path):
    """The page of a folder with one recording of a run that was finished."""
    (tmp_path / "run.h5").write_bytes(made_runs[0].read_bytes())
    return shown(tmp_path)


def test_the_page_and_its_files_come_from_here_alone(page) -> None:
    html = asked(page).text
    files = re.findall(r'(?:href|src)="([^"]+)"', html)
    assert len(files) == 5
    for file in files:
        assert asked(page, file).status == 200, file
    assert not re.search(r"<script(?![^>]* src=)|<style|\son\w+=|style=|https?:", html)
    assert "innerHTML" not in asked(page, "/page.js").text
    policy = asked(page).headers["content-security-policy"]
    assert "default-src 'none'" in policy
    assert "unsafe" not in policy


def test_the_stream_has_values_lines_and_the_age_of_the_newest_sample(made_runs, tmp_path) -> None:
    path = tmp_path / "run.h5"
    recorder = writer(path, samples_expected=3000)
    recorder.append(Block(0, run_counts(3000)[:, :1500], (Event(9, "fault", f"trip {HOSTILE}"),)))
    recorder._flush_all(1.8e9)
    answer = asked(shown(path), "/live")
    assert answer.headers["content-type"].startswith("text/event-stream")
    (event,) = answer.events
    assert event["age_s"] < 60.0
    recording = event["state"]["recording"]
    assert (recording["status"], recording["simulated"]) == ("recording", True)
    assert (recording["time_s"], recording["duration_s"]) == (1.499, pytest.approx(3.0, abs=2e-3))
    assert [c["label"] for c in recording["channels"]][:2] == ["command", "monitor"]
    assert [len(plot["lines"]) for plot in recording["plots"]] == [2, 1, 1]
    line = recording["plots"][0]["lines"][0]["recent"]
    assert len(line["low"]) == pytest.approx(1.5 / line["width"], abs=1)
    assert all(low <= high for low, high in zip(line["low"], line["high"], strict=True))
    # texts of files are data, and what would turn the text round is seen
    assert event["state"]["alarms"] == [r"At 0.01 s: trip <img src=x onerror=alert(1)>\u202e"]
    recorder.close()


def test_a_campaign_is_shown_with_the_run_that_was_killed(bench: Bench) -> None:
    bench.fates["three-0002"] = "killed"
    with pytest.raises(Killed):
        bench.play()
    (event,) = asked(shown(bench.out), "/live").events
    campaign = event["state"]["campaign"]
    assert (campaign["name"], campaign["status"]) == ("three", "killed")
    assert campaign["counts"] == {"done": 1, "failed": 0, "waiting": 2, "skipped": 0}
    assert [run["cells"][:2] for run in campaign["runs"]][1] == ["three-0002", "running"]
    assert any("killed" in alarm for alarm in event["state"]["alarms"])
    assert event["state"]["recording"]["name"] == "three-0002.h5"


def test_a_folder_without_a_recording_is_waited_for(tmp_path: Path) -> None:
    (event,) = asked(shown(tmp_path), "/live").events
    assert "neither a campaign nor a recording" in event["state"]["trouble"]
    assert event["age_s"] is None


def test_nothing_outside_of_the_folder_is_shown(made_runs, bench: Bench) -> None:
    bench.play()
    journal = bench.out / "campaign.jsonl"
    outside = bench.folder / "secret.h5"
    outside.write_bytes(made_runs[0].read_bytes())
    journal.write_text(journal.read_text().replace('"three-0003.h5"', '"../secret.h5"'))
    (event,) = asked(shown(bench.out), "/live").events
    assert event["state"]["campaign"]["counts"]["done"] == 3
    assert event["state"]["recording"] is None


@pytest.mark.parametrize("path", ["/run.h5", "/../run.h5", "/assets/page.js", "/%2e%2e/run.h5"])
def test_no_other_path_leads_to_a_file(page, path: str) -> None:
    assert asked(page, path).status == 404


@pytest.mark.parametrize("method", ["POST", "PUT", "DELETE", "PATCH", "OPTIONS", "HEAD"])
@pytest.mark.parametrize("path", ["/", "/live"])
def test_no_command_can_be_sent(page, path: str, method: str) -> None:
    assert asked(page, path, method).status == 405


def test_a_websocket_is_refused(page) -> None:
    sent = []

    async def send(message) -> None:
        sent.append(message["type"])

    asyncio.run(page({"type": "websocket", "headers": []}, lambda: None, send))
    assert sent == ["websocket.close"]


@pytest.mark.parametrize(
    ("host", "served"),
    [
        ("127.0.0.1:8642", True), ("localhost:8642", True), ("[::1]:8642", True),
        ("evil.example:8642", False), ("127.0.0.1.evil.example", False), ("", False),
        ("192.0.2.7:8642", False), ("[::1", False),
    ],
)  # fmt: skip
def test_only_names_of_the_loopback_are_answered(page, host: str, served: bool) -> None:
    """Another name could have been pointed at the loopback by its owner (DNS rebinding)."""
    for path in ("/", "/live"):
        answer = asked(page, path, host=host)
        assert answer.status == (200 if served else 421)
        assert answer.headers["x-content-type-options"] == "nosniff"


def test_another_page_is_not_answered(page) -> None:
    assert asked(page, "/live", origin="http://evil.example").status == 403
    assert asked(page, "/live", origin="null").status == 403
    assert asked(page, "/live", origin="http://127.0.0.1:8642").status == 200


def test_an_address_that_others_reach_needs_the_token(made_runs, tmp_path: Path) -> None:
    (tmp_path / "run.h5").write_bytes(made_runs[0].read_bytes())
    page = shown(tmp_path, "192.0.2.7", TOKEN)
    at = {"host": "192.0.2.7:8642"}
    for path in ("/", "/live", "/page.js", "/nothing", "/?token=", f"/?token={TOKEN}x"):
        answer = asked(page, path, **at)
        assert answer.status == 401, path
        assert TOKEN not in answer.text
    first = asked(page, f"/?token={TOKEN}", **at)
    assert (first.status, first.headers["location"]) == (303, "/")
    cookie = first.headers["set-cookie"]
    assert "HttpOnly" in cookie
    assert asked(page, "/live", cookie=cookie.partition(";")[0], **at).status == 200
    assert asked(page, "/live", authorization=f"Bearer {TOKEN}", **at).status == 200
    assert asked(page, "/", cookie="dearig_watch_8642=\u00e9", **at).status == 401
    assert asked(page, "/", host="evil.example", authorization=f"Bearer {TOKEN}").status == 421


def test_a_slow_watcher_delays_no_other_one() -> None:
    """It is passed over, and gets the newest state when it has taken the one before."""
    states = iter(range(1000))
    feed = Feed(lambda: ({"n": next(states)}, None), 0.0)

    async def both() -> tuple[list[str], str]:
        slow, fast = feed.stream(), feed.stream()
        first = await anext(slow)
        taken = [await anext(fast) for _ in range(20)]
        later = await anext(slow)
        await slow.aclose()
        await fast.aclose()
        assert '"n":0' in first
        return taken, later

    taken, later = asyncio.run(both())
    numbers = [int(text.partition('"n":')[2].partition("}")[0]) for text in taken]
    assert numbers == sorted(set(numbers))
    assert int(later.partition('"n":')[2].partition("}")[0]) >= numbers[-1]


def test_what_is_watched_is_read_once_for_all_and_not_without_watchers(page, made_runs) -> None:
    looks = []
    feed = Feed(lambda: (looks.append(1) or {"n": 1}, None), 3600.0)
    app = watch_app(feed, "127.0.0.1", 8642, None)

    async def several() -> None:
        answers = await asyncio.gather(*(ask(app, "/live") for _ in range(5)))
        assert {a.status for a in answers} == {200}

    assert not looks
    asyncio.run(several())
    assert len(looks) == 1


def test_a_watcher_who_comes_after_all_have_left_gets_no_old_state() -> None:
    states = iter(range(1000))
    feed = Feed(lambda: ({"n": next(states)}, 0.0), 0.0, clock=lambda: 5.0)

    async def twice() -> list[str]:
        found = []
        for _ in range(2):
            stream = feed.stream()
            found.append(await anext(stream))
            await stream.aclose()
            while not feed._task.done():
                await asyncio.sleep(0)
        return found

    first, second = asyncio.run(twice())
    assert first == 'data: {"age_s": 5.0, "state": {"n":0}}\n\n'
    assert '"n":0' not in second
    assert '"state"' in second


def test_bins_of_pieces_are_those_of_the_whole() -> None:
    rng = np.random.default_rng(3)
    time, values = np.arange(5000) / 1000.0, rng.normal(size=5000)
    whole = Bins(0.05, 400)
    whole.add(time, values, values)
    pieces = Bins(0.05, 400)
    for part in np.split(np.arange(5000), [7, 8, 1300, 4999]):
        pieces.add(time[part], values[part], values[part])
    for one, other in zip(whole.extremes, pieces.extremes, strict=True):
        np.testing.assert_array_equal(one, other)
    start, low, high = whole.dense()
    assert (start, low.size) == (0.0, 100)
    assert low[3] == values[150:200].min()
    assert high[3] == values[150:200].max()


def test_bins_keep_the_newest_part_or_grow_wider() -> None:
    time = np.arange(1000) * 1.0
    newest, all_of_it = Bins(1.0, 100), Bins(1.0, 100, whole=True)
    for bins in (newest, all_of_it):
        bins.add(time, time, time)
    assert newest.extremes[0][[0, -1]].tolist() == [900.0, 999.0]
    at, low, high = all_of_it.extremes
    assert (at[0], low[0], high[-1]) == (0.0, 0.0, 999.0)
    assert at.size <= 100
    assert all_of_it.width == 16.0


@pytest.mark.parametrize(
    "text", ["", "short", "x" * 300, "a token with blanks in it", "\u00e9" * 20]
)
def test_a_token_that_is_not_safe_is_refused(tmp_path: Path, text: str) -> None:
    (tmp_path / "token").write_text(text, "utf-8")
    refused(dearig("watch", tmp_path, "--port", "0", "--token-file", tmp_path / "token"), "token")
    (tmp_path / "token").write_text(TOKEN + "\n", "utf-8")
    assert token_from(tmp_path / "token") == TOKEN


def test_options_that_exclude_each_other_are_refused(tmp_path: Path) -> None:
    refused(dearig("watch", tmp_path, "--host", "192.0.2.7"), "--port")
    refused(dearig("watch", tmp_path, "--port", "0", "--once"), "--once")
    refused(dearig("watch", tmp_path, "--port", "0", "--host", "192.0.2.7"), "cannot be shown")


def test_a_missing_extra_is_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(__import__("sys").modules, "uvicorn", None)
    refused(dearig("watch", tmp_path, "--port", "0"), "dearig[web]")
