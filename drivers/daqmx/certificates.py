"""Certificates for TLS, read from PEM files and checked before a connection is made."""

from __future__ import annotations

import ssl
from dataclasses import dataclass
from pathlib import Path

from dearig.drivers.errors import LinkRefused

__all__ = ["Certificates", "read_certificates"]


@dataclass(frozen=True)
class Certificates:
    """Contents of PEM files: authority ``ca`` of the other side, own ``cert`` and its ``key``."""

    ca: bytes | None
    cert: bytes | None
    key: bytes | None


def read_certificates(
    ca: str | Path, cert: str | Path, key: str | Path, names: tuple[str, str, str]
) -> Certificates:
    """Return the certificates in three files, an empty path for none.

    Raises ``LinkRefused`` for a file that cannot be used; ``names`` are the settings or options
    that name the files.
    """
    paths = (ca, cert, key)
    contents = [_content(path, name) for path, name in zip(paths, names, strict=True)]
    context = ssl.SSLContext(ssl.PROTOCOL_TLS_CLIENT)
    try:
        if ca:
            context.load_verify_locations(str(ca))
    except (ssl.SSLError, OSError) as error:
        raise LinkRefused(f"{names[0]} = {ca} holds no certificate ({_words(error)})") from error
    try:
        if cert:
            context.load_cert_chain(str(cert), str(key), password=_no_password)
    except (ssl.SSLError, OSError) as error:
        raise LinkRefused(
            f"{names[1]} = {cert} and {names[2]} = {key} are not a certificate and its private "
            f"key without a password ({_words(error)})"
        ) from error
    return Certificates(*contents)


def _content(path: str | Path, name: str) -> bytes | None:
    if not path:
        return None
    try:
        return Path(path).read_bytes()
    except OSError as error:
        raise LinkRefused(
            f"{name} = {path} cannot be read: {error.strerror or error}; correct the path"
        ) from error


def _no_password() -> str:
    # without this OpenSSL asks for one at the terminal
    raise ssl.SSLError("the key is protected by a password")


def _words(error: OSError) -> str:
    reason = getattr(error, "reason", None) or error.strerror or error
    return str(reason).replace("_", " ").lower()
