"""Make the environment that the README's two commands run in; standard library only."""

from __future__ import annotations

import hashlib
import importlib.util
import os
import re
import shutil
import subprocess
import sys
from ast import literal_eval
from contextlib import suppress
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
VENV = ROOT / ".venv"
CONSTRAINTS = ROOT / ".ci" / "constraints.txt"
#: Debian's names of the libraries that Qt loads at run time, and of a screen in memory.
SCREEN = [
    "libgl1", "libegl1", "libxkbcommon0", "libglib2.0-0", "libfontconfig1", "libdbus-1-3",
    "xvfb", "xauth", "libxcb-cursor0", "libxkbcommon-x11-0", "libxcb-icccm4", "libxcb-keysyms1",
    "libxcb-shape0", "fonts-dejavu-core",
]  # fmt: skip


def prepare(extras: str = "", venv: Path = VENV) -> Path:
    """Install the project with ``extras`` into ``venv`` unless it is there; return its Python."""
    if not (3, 11) <= sys.version_info[:2] <= (3, 14):
        sys.exit(f"dearig needs Python 3.11 to 3.14; this is {sys.version.split()[0]}")
    python = venv / ("Scripts/python.exe" if os.name == "nt" else "bin/python")
    wanted = hashlib.sha256(
        CONSTRAINTS.read_bytes() + (ROOT / "pyproject.toml").read_bytes() + sys.version.encode()
    ).hexdigest()
    stamp = venv / "installed"
    # uv and pip compare names and versions only: they keep packages of which files are missing
    unfinished = venv.with_name(f"{venv.name}-unfinished")
    if python.exists() and stamp.is_file() and not unfinished.exists():
        got, _, has = stamp.read_text().partition(" ")
        if got == wanted and (not extras or extras == has):
            return python
        extras = extras or has  # the environment of the tests serves the demo too
    if importlib.util.find_spec("ensurepip") is None:
        _install_venv_package()
    settings = venv / "pyvenv.cfg"
    # python3 may be another version than when the environment was made; its packages are not seen
    mine = re.compile(rf"^version(_info)? *= *{sys.version_info[0]}\.{sys.version_info[1]}\.", re.M)
    is_of_this = settings.is_file() and mine.search(settings.read_text()) is not None
    keeps = python.exists() and is_of_this and not unfinished.exists()
    unfinished.touch()
    if not keeps:
        print(f"Making the environment {venv.name} ...", flush=True)
        # by a new interpreter: one that was here before ensurepip was installed may not see it
        _must([sys.executable, "-m", "venv", "--clear", str(venv)])
    stamp.unlink(missing_ok=True)
    print(f"Installing dearig and its requirements into {venv.name} ...", flush=True)
    _install(python, "--editable", str(ROOT) + (f"[{extras}]" if extras else ""))
    stamp.write_text(f"{wanted} {extras}")
    unfinished.unlink()
    return python


def _must(command: list[str]) -> None:
    """Run a command; end this program, without a traceback, where it fails or is interrupted."""
    try:
        code = subprocess.run(command, check=False).returncode
    except KeyboardInterrupt:
        sys.exit(130)
    if code:
        sys.exit(f"{command[0]} {' '.join(command[1:4])} ... failed (exit code {code}); see above")


#: Where packages come from and how they are fetched: what of a person's settings of uv counts here.
#: Others change what is installed (no-deps, target, no-editable), and uv still succeeds.
_UV_KEPT = re.compile(
    r"UV_(CACHE_DIR|NO_CACHE|LINK_MODE|OFFLINE|(DEFAULT|EXTRA)_INDEX.*|INDEX.*|FIND_LINKS|NO_INDEX"
    r"|INSECURE_HOST|NATIVE_TLS|SYSTEM_CERTS|HTTP_.*|KEYRING_PROVIDER|CONCURRENT_.*)"
)


def _install(python: Path, *what: str) -> None:
    """Install with uv, in a tenth of pip's time; with pip where uv has no wheel or fails."""
    pip = [str(python), "-m", "pip", "--disable-pip-version-check"]
    tested = ["--quiet", "--constraint", str(CONSTRAINTS)]
    # most modules are never imported; Python compiles the others when they are
    by_pip = [*pip, "install", "--no-compile", *tested]
    try:
        uv = [*by_pip, "--only-binary", ":all:", "uv"]
        if subprocess.run(uv, capture_output=True, check=False).returncode == 0:
            by_uv = [str(python), "-m", "uv", "--no-config", "pip", "install", *tested]
            kept = {k: v for k, v in os.environ.items() if k[:3] != "UV_" or _UV_KEPT.fullmatch(k)}
            done = subprocess.run(
                [*by_uv, "--python", str(python), *what],
                env={**_as_pip(pip), **kept},
                check=False,
            )
            if done.returncode == 0:
                return
            print("uv could not; pip installs it, which takes longer ...", flush=True)
    except KeyboardInterrupt:
        sys.exit(130)
    _must([*by_pip, *what])


def _as_pip(pip: list[str]) -> dict[str, str]:
    """Return pip's settings of index, certificates and proxy for uv, which reads none of pip's."""
    listed = subprocess.run([*pip, "config", "list"], capture_output=True, text=True, check=False)
    said = dict(line.partition("=")[::2] for line in listed.stdout.splitlines())
    found = {}
    for name, variable in (
        ("index-url", "UV_DEFAULT_INDEX"), ("cert", "SSL_CERT_FILE"), ("proxy", "ALL_PROXY"),
    ):  # fmt: skip
        for section in (":env:", "install", "global"):  # in the order in which pip obeys them
            if value := said.get(f"{section}.{name}"):
                found.setdefault(variable, str(literal_eval(value)))
    return found


# the plugin for a real screen needs more libraries than Qt itself
_LOADS = (
    "import ctypes, pathlib, PySide6, PySide6.QtGui, PySide6.QtWidgets; "
    "plugins = pathlib.Path(PySide6.__file__).parent / 'Qt' / 'plugins' / 'platforms'; "
    "ctypes.CDLL(str(plugins / 'libqxcb.so'))"
)


def prepare_screen(python: Path) -> None:
    """Install the libraries that windows need, and a screen in memory, where Debian lacks them."""
    if not sys.platform.startswith("linux"):
        return
    loads = [str(python), "-c", _LOADS]
    missing = subprocess.run(loads, capture_output=True, text=True, check=False)
    if missing.returncode == 0 and shutil.which("Xvfb"):
        return
    why = missing.stderr.strip().splitlines()[-1] if missing.returncode else "there is no Xvfb"
    _install_packages(SCREEN, f"The window's tests need libraries of the system ({why})")


def _install_venv_package() -> None:
    """Install Debian's package with the modules that venv needs."""
    package = f"python{sys.version_info[0]}.{sys.version_info[1]}-venv"
    _install_packages([package], "This Python cannot make virtual environments")


def _install_packages(packages: list[str], why: str) -> None:
    names = " ".join(packages)
    apt = shutil.which("apt-get")
    if apt is None:
        sys.exit(f"{why}: install what Debian calls {names}.")
    become = [] if os.geteuid() == 0 else ["sudo"]
    if become and shutil.which("sudo") is None:
        sys.exit(f"{why}: install {names} as root.")
    print(f"Installing {names} ...", flush=True)
    environment = {**os.environ, "DEBIAN_FRONTEND": "noninteractive"}
    subprocess.run([*become, apt, "update", "-qq"], check=True, env=environment)
    subprocess.run([*become, apt, "install", "-y", "-qq", *packages], check=True, env=environment)


def start(
    arguments: list[str], *, quiet: bool = False, **environment: str
) -> subprocess.Popen[bytes]:
    """Start a command in the project's folder; it says nothing but errors if ``quiet``."""
    # modules are compiled when they are first imported, and only then
    environment = {**os.environ, "PYTHONDONTWRITEBYTECODE": "", **environment}
    out = subprocess.DEVNULL if quiet else None
    return subprocess.Popen(arguments, cwd=ROOT, env=environment, stdout=out)


def wait(*commands: subprocess.Popen[bytes]) -> int:
    """Return the first exit code of ``commands`` that is not 0; ctrl-C ends them all."""
    try:
        return next(filter(None, [command.wait() for command in commands]), 0)
    except KeyboardInterrupt:
        for command in commands:
            with suppress(subprocess.TimeoutExpired, KeyboardInterrupt):
                command.wait(timeout=20)  # it was interrupted too, and ends what it has begun
            command.kill()
            command.wait()
        return 130


def run(arguments: list[str], **environment: str) -> int:
    """Run a command in the project's folder and return its exit code."""
    return wait(start(arguments, **environment))
