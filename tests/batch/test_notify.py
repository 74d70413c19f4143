"""Who is told that a run or a campaign has ended, and that telling stops nothing."""

from __future__ import annotations

import json
import logging
import sys
import threading
from collections.abc import Iterator
from dataclasses import dataclass, field
from http.server import BaseHTTPRequestHandler, HTTPServer
from pathlib import Path

import pytest

from dearig.batch.notify import Notifier, await_notifications
from dearig.cli.options import notify_from
from dearig.command_line import without_secrets
from dearig.config.notify import Notify
from dearig.errors import InputError, InstrumentFault, SafetyStop
from tests.tools.command import LOBE, SLOW_RIG, dearig, done, refused, write
from tests.tools.played import PLAN, UNKNOWN, Bench

PRIVATE = "T0p-Secret-Path"

#: Appends what it is told to the file that its argument names.
TELL = """
import sys
with open(sys.argv[1], "ab") as file:
    file.write(sys.stdin.buffer.read() + b"\\n")
"""


@dataclass
class Told:
    """A command that notes what it is told in ``file``."""

    folder: Path
    file: Path = field(init=False)
    command: tuple[str, ...] = field(init=False)

    def __post_init__(self) -> None:
        self.file = self.folder / "told.jsonl"
        self.command = (
            sys.executable,
            "-S",
            str(write(self.folder / "tell.py", TELL)),
            str(self.file),
        )

    @property
    def all(self) -> list[dict]:
        """The notifications in the order of their times: their commands run at the same time."""
        await_notifications()
        return [json.loads(line) for line in self.file.read_text().splitlines()]

    def plan(self, on: str = "") -> str:
        return f"{PLAN}[notify]\ncommand = {json.dumps(self.command)}\n{on}\n"


@pytest.fixture
def told(tmp_path: Path) -> Told:
    return Told(tmp_path)


class Server(HTTPServer):
    """A webhook on the loopback, which answers ``status``."""

    status = 200

    def __init__(self) -> None:
        super().__init__(("127.0.0.1", 0), _Handler)
        self.got: list[tuple[str, dict]] = []

    @property
    def address(self) -> str:
        return f"http://127.0.0.1:{self.server_port}/{PRIVATE}"


class _Handler(BaseHTTPRequestHandler):
    server: Server

    def do_POST(self) -> None:
        body = self.rfile.read(int(self.headers["Content-Length"]))
        self.server.got.append((self.path, json.loads(body)))
        self.send_response(self.server.status)
        self.send_header("Location", "/elsewhere")
        self.end_headers()

    def log_message(self, *_: object) -> None:
        pass


@pytest.fixture
def server(monkeypatch: pytest.MonkeyPatch) -> Iterator[Server]:
    monkeypatch.setenv("no_proxy", "*")
    with Server() as made:
        thread = threading.Thread(target=made.serve_forever, args=(0.01,))
        thread.start()
        yield made
        made.shutdown()
        thread.join()


def test_a_command_is_told_of_every_run_and_of_the_end(bench: Bench, told: Told) -> None:
    bench.play(told.plan())
    found = told.all
    assert sorted(entry["event"] for entry in found) == ["queue-stopped", *["run-ended"] * 3]
    runs = {entry["run"]["name"]: entry for entry in found if entry["run"]}
    first = runs["three-0001"]
    assert first["format"] == "dearig-notification/1"
    assert (first["run"]["state"], first["run"]["output"]) == ("done", "confirmed")
    assert Path(first["run"]["recording"]).is_file()
    assert first["text"] == "Run three-0001 of campaign three: done"
    assert (first["campaign"]["done"], first["campaign"]["planned"]) == (1, 3)
    (end,) = [entry for entry in found if entry["event"] == "queue-stopped"]
    assert end["campaign"]["status"] == "complete"
    assert end["text"] == "Campaign three: complete, 3 of 3 runs done"


@pytest.mark.parametrize(
    "fate", [SafetyStop("6 kV is too much"), InstrumentFault("no card"), UNKNOWN]
)
def test_a_run_that_a_person_must_look_at_has_tripped(bench: Bench, told: Told, fate) -> None:
    if isinstance(fate, Exception):
        bench.fail("three-0002", fate)
    else:
        bench.fates["three-0002"] = fate
    with pytest.raises((SafetyStop, InstrumentFault)):
        bench.play(told.plan('on = ["tripped", "queue-stopped"]'))
    trip, end = sorted(told.all, key=lambda entry: entry["event"], reverse=True)
    assert (trip["event"], trip["run"]["name"]) == ("tripped", "three-0002")
    assert end["campaign"]["status"] == "halted"
    assert end["campaign"]["waiting"] == 1


@pytest.mark.parametrize(
    ("script", "words"),
    [
        ("raise SystemExit('no mail today')", "it ended with 1: no mail today"),
        ("import time; time.sleep(100)", "it was killed after 0.2 s"),
        ("", None),
    ],
)
def test_a_command_that_fails_is_logged(
    tmp_path: Path, caplog: pytest.LogCaptureFixture, script: str, words: str | None
) -> None:
    command = (sys.executable, "-S", "-c", script)
    notifier = Notifier(Notify(command, timeout=0.2 if "sleep" in script else 60.0))
    notifier.tell("run-ended", "x" * 200_000)  # more than a pipe holds
    await_notifications()
    warnings = [r.message for r in caplog.records if r.levelno >= logging.WARNING]
    assert len(warnings) == (words is not None)
    assert words is None or words in warnings[0]


def test_failures_neither_stop_nor_delay_a_campaign(
    bench: Bench, caplog: pytest.LogCaptureFixture
) -> None:
    """Of many failures in a row one is a warning."""
    failing = json.dumps([sys.executable, "-S", "-c", "raise SystemExit(3)"])
    plan = PLAN.replace("repeat = 3", "repeat = 8")
    plan += f'[notify]\ncommand = {failing}\nwebhook = "http://127.0.0.1:9/{PRIVATE}"\n'
    assert bench.play(plan).status == "complete"
    await_notifications()
    warned = [r.message for r in caplog.records if r.levelno == logging.WARNING]
    assert 1 <= len(warned) <= 3, warned
    assert PRIVATE not in caplog.text


def test_a_webhook_is_told(server: Server, bench: Bench) -> None:
    plan = f'{PLAN}[notify]\nwebhook = "{server.address}"\non = ["queue-stopped"]\n'
    bench.play(plan)
    await_notifications()
    ((path, body),) = server.got
    assert path == f"/{PRIVATE}"
    assert (body["event"], body["campaign"]["done"]) == ("queue-stopped", 3)


@pytest.mark.parametrize("status", [302, 307, 404, 500])
def test_an_answer_that_refuses_is_logged_without_the_address(
    server: Server, status: int, caplog: pytest.LogCaptureFixture
) -> None:
    server.status = status
    Notifier(Notify(webhook=server.address)).tell("tripped", "")
    await_notifications()
    assert [path for path, _ in server.got] == [f"/{PRIVATE}"]  # no redirection is followed
    assert f"it answered {status}" in caplog.text
    assert PRIVATE not in caplog.text


def test_a_variable_has_the_address(server: Server, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("LAB_HOOK", server.address)
    Notifier(Notify(webhook="env:LAB_HOOK")).tell("tripped", "")
    await_notifications()
    assert len(server.got) == 1
    assert server.address not in repr(Notify(webhook=server.address))


@pytest.mark.parametrize(
    ("notify", "words"),
    [
        (Notify(("no-such-program-here",)), "'no-such-program-here' is not there"),
        (Notify(webhook=f"ftp://example.org/{PRIVATE}"), "is not an address"),
        (Notify(webhook=f"https:///{PRIVATE}"), "is not an address"),
        (Notify(webhook=f"https://example.org/a b{PRIVATE}"), "is not an address"),
        (Notify(webhook=f"https://example.org:x/{PRIVATE}"), "is not an address"),
        (Notify(webhook=f"https://me:{PRIVATE}@example.org/"), "password"),
        (Notify(webhook="env:NO_SUCH_NAME_HERE"), "'NO_SUCH_NAME_HERE'"),
    ],
)
def test_what_could_never_be_told_is_refused_first(
    bench: Bench, notify: Notify, words: str
) -> None:
    with pytest.raises(InputError, match=words) as caught:
        Notifier(notify)
    assert PRIVATE not in str(caught.value)


def test_keys_of_the_plan_are_checked(bench: Bench) -> None:
    for text in ('on = ["sometimes"]', 'command = "mail me"', "webhok = 1"):
        with pytest.raises(InputError, match="notify"):
            bench.campaign(f"{PLAN}[notify]\n{text}\n")
    assert bench.campaign(f"{PLAN}[notify]\ntimeout_s = 5\n").notify.timeout == 5.0
    with pytest.raises(InputError, match="is not there"):
        bench.play(f'{PLAN}[notify]\ncommand = ["no-such-program-here"]\n')
    assert not bench.out.exists()


def test_options_come_before_the_plan() -> None:
    plan = Notify(("mail",), "https://example.org/a", ("tripped",), 5.0)
    assert notify_from(None, None, None, plan) == plan
    changed = notify_from('say "a run" now', None, None, plan)
    assert changed == Notify(("say", "a run", "now"), "https://example.org/a", ("tripped",), 5.0)
    with pytest.raises(InputError, match="quote"):
        notify_from('say "a run', None, None, plan)


def test_an_address_is_not_logged_with_the_arguments() -> None:
    for given in (["--notify-webhook", PRIVATE], [f"--notify-webhook={PRIVATE}"]):
        shown = without_secrets(["record", *given, "--rig", "sim"])
        assert PRIVATE not in " ".join(shown)
        assert shown[-2:] == ["--rig", "sim"]


def test_the_command_record_tells_of_its_run(tmp_path: Path, told: Told) -> None:
    lobe, rig = write(tmp_path / "lobe.toml", LOBE), write(tmp_path / "rig.toml", SLOW_RIG)
    command = " ".join(f'"{word}"' for word in told.command)
    given = ("record", lobe, "--rig-file", rig, "--out", tmp_path / "run.h5")
    done(*given, "--notify-command", command)
    (entry,) = told.all
    assert (entry["event"], entry["campaign"]) == ("run-ended", None)
    assert entry["run"]["recording"] == str(tmp_path / "run.h5")
    # what was refused has not ended
    refused(dearig(*given, "--notify-command", command), "exists")
    assert len(told.all) == 1


def test_what_a_plan_starts_is_said_before_it_is_played(tmp_path: Path, told: Told) -> None:
    write(tmp_path / "lobe.toml", LOBE)
    text = f'{PLAN}[notify]\ncommand = {json.dumps(told.command)}\non = ["queue-stopped"]\n'
    plan, rig = write(tmp_path / "plan.toml", text), write(tmp_path / "rig.toml", SLOW_RIG)
    answer = done("campaign", plan, "--rig-file", rig, "--out", tmp_path / "out")
    said = answer.out.splitlines()[0]
    assert "at queue-stopped this starts " in said
    assert told.command[-1] in said
