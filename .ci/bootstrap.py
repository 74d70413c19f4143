"""Makes the environment in .venv that the README's two commands run in; standard library only."""

from __future__ import annotations

import hashlib
import importlib.util
import os
import shutil
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
VENV = ROOT / ".venv"
SCRIPTS = VENV / ("Scripts" if os.name == "nt" else "bin")
CONSTRAINTS = ROOT / ".ci" / "constraints.txt"


def prepare(extras: str = "") -> Path:
    """Install the project with ``extras`` into .venv if need be; returns that Python."""
    if not (3, 11) <= sys.version_info[:2] <= (3, 13):
        sys.exit(f"dearig needs Python 3.11 to 3.13; this is {sys.version.split()[0]}")
    python = SCRIPTS / ("python.exe" if os.name == "nt" else "python")
    wanted = hashlib.sha256(
        CONSTRAINTS.read_bytes()
        + (ROOT / "pyproject.toml").read_bytes()
        + f"{extras} {sys.version}".encode()
    ).hexdigest()
    stamp = VENV / "installed"
    if stamp.is_file() and stamp.read_text().strip() == wanted and python.exists():
        return python
    if importlib.util.find_spec("ensurepip") is None:
        _install_venv_package()
    if not python.exists():
        print("Making the environment .venv ...", flush=True)
        # by a new interpreter: one that was here before ensurepip was installed may not see it
        subprocess.run([sys.executable, "-m", "venv", "--clear", str(VENV)], check=True)
    print("Installing dearig and what it needs into .venv ...", flush=True)
    project = str(ROOT) + (f"[{extras}]" if extras else "")
    subprocess.run(
        [
            str(python), "-m", "pip", "install", "--quiet", "--disable-pip-version-check",
            "--constraint", str(CONSTRAINTS), "--editable", project,
        ],
        check=True,
    )  # fmt: skip
    stamp.write_text(wanted)
    return python


def _install_venv_package() -> None:
    """Debian keeps what venv needs in a package of its own."""
    apt = shutil.which("apt-get")
    package = f"python{sys.version_info[0]}.{sys.version_info[1]}-venv"
    if apt is None:
        sys.exit("This Python cannot make virtual environments: install its venv and ensurepip.")
    become = [] if os.geteuid() == 0 else ["sudo"]
    if become and shutil.which("sudo") is None:
        sys.exit(f"This Python cannot make virtual environments: install {package} as root.")
    print(f"Installing {package} ...", flush=True)
    environment = {**os.environ, "DEBIAN_FRONTEND": "noninteractive"}
    subprocess.run([*become, apt, "update", "-qq"], check=True, env=environment)
    subprocess.run([*become, apt, "install", "-y", "-qq", package], check=True, env=environment)


def run(arguments: list[str]) -> int:
    """Exit code of a command in the project's folder."""
    try:
        return subprocess.run(arguments, cwd=ROOT, check=False).returncode
    except KeyboardInterrupt:
        return 130
