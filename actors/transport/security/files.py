"""The files that a security file names: read, and refused if others could read or have changed them, or if they are not what they should be."""

from __future__ import annotations

import stat
from pathlib import Path


class Unusable(ValueError):
    """A file cannot be used; the text says which, where and why, without what is in it."""


def read_pem(path: Path, label: str, *, secret: bool = False) -> str:
    """The text of a PEM file with a block of this label, such as ``CERTIFICATE``; one that is secret must be its owner's only. Raises Unusable."""
    text = _read(path, secret=secret)
    if f"{label}-----" not in text:
        raise Unusable(f"{path} holds no {label} in PEM format")
    if "ENCRYPTED" in text:
        raise Unusable(f"{path} is encrypted, and nobody is there to ask for its password: decrypt it")
    return text


def read_password(path: Path) -> str:
    """The password in a file of one line. Raises Unusable."""
    lines = _read(path, secret=True).split("\n")
    if not lines[0].strip() or any(lines[1:]):
        raise Unusable(f"{path} must hold one line, the password")
    return lines[0].strip()


def read_users(path: Path) -> dict[str, str]:
    """The passwords by user, from a file with a line ``name:password`` for each. Raises Unusable."""
    users: dict[str, str] = {}
    for number, line in enumerate(_read(path, secret=True).splitlines(), 1):
        name, _, password = (part.strip() for part in line.partition(":"))
        if line.strip() and not (name and password):
            raise Unusable(f"{path}:{number} does not read name:password")
        if name in users:
            raise Unusable(f"{path}:{number} names {name} once more")
        if name:
            users[name] = password
    if not users:
        raise Unusable(f"{path} names no user")
    return users


def _read(path: Path, *, secret: bool) -> str:
    try:
        mode = path.stat().st_mode
        if secret and stat.S_IMODE(mode) & 0o077:
            raise Unusable(f"{path} can be read by others than its owner: chmod 600 {path}")
        return path.read_text(encoding="utf-8")
    except OSError as error:
        raise Unusable(f"{path} cannot be read: {error.strerror}") from error
    except UnicodeDecodeError as error:
        raise Unusable(f"{path} is no text") from error
