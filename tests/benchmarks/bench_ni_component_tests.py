"""NI's own component tests of nidaqmx-python, run against the simulated card.

Run as ``python -m tests.benchmarks.bench_ni_component_tests --source FOLDER``, where ``FOLDER``
has the source of nidaqmx-python of the installed version or a little later
(https://github.com/ni/nidaqmx-python; nothing of it is part of this project). The tests need
pytest-mock and pykka, which may also be in ``--with FOLDER``. They run with the gRPC interpreter
alone, on a card that is served as ``dearig serve-daqmx --sine`` serves it and stands for each
X Series device that they look for.

A test passes, fails (also while it is set up), or is skipped by NI for want of another device.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import tempfile
from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import grpc
from nidaqmx import GrpcSessionOptions
from nidaqmx.scale import Scale

FOLDERS = ("tests/component", "tests/legacy")
CARD = "Dev1"
HERE = Path(__file__).parent
_TEST_S = 30  # after which a test counts as failed


@contextmanager
def served() -> Iterator[int]:
    """Port of a simulated card in a process of its own."""
    server = subprocess.Popen(
        [sys.executable, "-m", "dearig", "serve-daqmx", "--sine", "--no-client-tracking"],
        stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True,
    )  # fmt: skip
    try:
        if server.stdout is None:
            raise RuntimeError("the server says nothing")
        told = server.stdout.readline()
        yield int(told.split(";")[0].rpartition(":")[2])
    finally:
        server.terminate()
        server.wait()


def save_scales(port: int) -> None:
    """Save the scales that NI's test configuration has."""
    with grpc.insecure_channel(f"localhost:{port}") as channel:
        session = GrpcSessionOptions(channel, "")
        for name, slope in (("no_scaling_scale", 1.0), ("double_gain_scale", 2.0)):
            scale = Scale.create_lin_scale(name, slope, grpc_options=session)
            scale.description = "Twice the gain" if slope == 2.0 else ""
            scale.save(author="Test Author")
        Scale.create_polynomial_scale(
            "polynomial_scale", [0.0, 1.0], [0.0, 1.0], grpc_options=session
        ).save()


def run(source: Path, more: Path | None, folders: list[str]) -> list[dict[str, str | bool]]:
    """Run the tests; returns one entry per test."""
    with tempfile.TemporaryDirectory() as folder, served() as port:
        save_scales(port)
        out = Path(folder) / "tests.jsonl"
        paths = [str(HERE), *([str(more)] if more is not None else [])]
        paths += [p for p in (os.environ.get("PYTHONPATH"),) if p]
        subprocess.run(
            [
                sys.executable, "-m", "pytest", "-p", "ni_component_plugin", "-p",
                "no:cacheprovider", "-q", "--tb=short", "--no-header", "--no-summary",
                "--timeout", str(_TEST_S), "--continue-on-collection-errors", *folders,
            ],
            cwd=source, check=False, stdout=subprocess.DEVNULL,
            env=os.environ | {
                "NI_TESTS_CARD": CARD, "NI_TESTS_PORT": str(port), "NI_TESTS_OUT": str(out),
                "PYTHONPATH": os.pathsep.join(paths), "PYTHONDONTWRITEBYTECODE": "1",
            },
        )  # fmt: skip
        if not out.exists():
            raise SystemExit(f"no test of {source} was run; are pytest-mock and pykka installed?")
        return [json.loads(line) for line in out.read_text(encoding="utf-8").splitlines()]


def table(title: str, reasons: Counter[str]) -> None:
    """Print how often each reason was given."""
    print(f"\n{title}\n\n| tests | reason |\n|---|---|")
    for reason, tests in sorted(reasons.items(), key=lambda item: (-item[1], item[0])):
        print(f"| {tests} | {reason.replace('|', '/')} |")


def main() -> None:
    """Run the tests and tell what came of them."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--source", type=Path, required=True)
    parser.add_argument("--with", dest="more", type=Path, default=None)
    parser.add_argument("folders", nargs="*", default=list(FOLDERS))
    options = parser.parse_args()
    tests = run(options.source, options.more, options.folders)
    # NI marks a few tests as expected to fail; those say nothing of the card
    counted = [t for t in tests if not t["expected"]]
    outcomes = Counter(str(t["outcome"]) for t in counted)
    asked = outcomes["passed"] + outcomes["failed"]
    print(
        f"{outcomes['passed']} of {asked} passed ({100.0 * outcomes['passed'] / max(asked, 1):.0f}"
        f" %), {outcomes['failed']} failed, {outcomes['skipped']} skipped"
    )
    table("Failed", Counter(str(t["reason"]) for t in counted if t["outcome"] == "failed"))
    table("Skipped", Counter(str(t["reason"]) for t in counted if t["outcome"] == "skipped"))


if __name__ == "__main__":
    main()
