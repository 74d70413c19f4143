"""Certificates for tests: an authority, and a server's and a client's that it signed."""

from __future__ import annotations

import shutil
import subprocess
from pathlib import Path

import pytest

__all__ = ["make_certificates", "needs_openssl"]

needs_openssl = pytest.mark.skipif(shutil.which("openssl") is None, reason="openssl is missing")


def _openssl(folder: Path, *arguments: str) -> None:
    subprocess.run(
        ["openssl", *arguments],
        cwd=folder, check=True, capture_output=True, timeout=60.0,
    )  # fmt: skip


def make_certificates(folder: Path, *, names: str = "DNS:localhost,IP:127.0.0.1") -> Path:
    """Return ``folder`` with ca.pem, and {server,client}.pem with their .key for ``names``.

    The commands are those of app/docs/how-to/rig-pc.md.
    """
    folder.mkdir(exist_ok=True)
    new = ("-newkey", "ec", "-pkeyopt", "ec_paramgen_curve:prime256v1", "-nodes")
    _openssl(folder, "req", "-x509", *new, "-days", "30", "-subj", "/CN=rig-ca",
             "-keyout", "ca.key", "-out", "ca.pem")  # fmt: skip
    for who in ("server", "client"):
        _openssl(folder, "req", "-x509", *new, "-days", "30", "-subj", f"/CN={who}",
                 "-addext", f"subjectAltName={names}", "-addext", "basicConstraints=CA:FALSE",
                 "-CA", "ca.pem", "-CAkey", "ca.key",
                 "-keyout", f"{who}.key", "-out", f"{who}.pem")  # fmt: skip
    return folder
