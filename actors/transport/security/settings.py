"""What a security file says, as values: `load_security` reads it whole, with the files that it names, or refuses it."""

from __future__ import annotations

import os
import ssl
import stat
from pathlib import Path
from typing import Final, cast

import msgspec

from actors.transport.format.errors import WireFormatError
from actors.transport.format.names import check_chunk
from actors.transport.security.document import Document, SecurityError


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


EVERYBODY: Final = "*"
"""Stands in `AccessRule.peers` for all who have a certificate of the authority."""


class Secret:
    """A text that is not printed: its repr, and what logs and errors show of it, is ``<secret>``."""

    __slots__ = ("_text",)

    def __init__(self, text: str) -> None:
        self._text = text

    def __repr__(self) -> str:
        return "<secret>"

    def reveal(self) -> str:
        """The text, for the one who has to send it."""
        return self._text


class Tls(msgspec.Struct, frozen=True, kw_only=True):
    """The section ``tls``. The three files are in PEM format; their paths count from the folder of the security file."""

    authority: str
    """The certificate of the authority whose certificates are trusted."""
    certificate: str
    """The certificate of this process; the common name in it is the name by which others know it."""
    key: str
    """Its private key."""
    mutual: bool = True
    """Whether those who connect must have a certificate, too."""


class User(msgspec.Struct, frozen=True, kw_only=True):
    """The section ``user``: a name and a password besides the certificate."""

    name: str
    password_file: str
    """A file of one line."""
    users: str = ""
    """A file with a line ``name:password`` for each user that is let in here; needed by everybody who is connected to."""


class AccessRule(msgspec.Struct, frozen=True, kw_only=True):
    """One entry of ``access``: what other processes may do. Names are absolute; ``*`` stands for one part of a name, ``**`` for any number."""

    peers: tuple[str, ...]
    """The processes that it is about, by the common name in their certificates; ``*``: all."""
    nodes: tuple[str, ...] = ("/**",)
    """The nodes that they may show."""
    publish: tuple[str, ...] = ()
    subscribe: tuple[str, ...] = ()
    """Topics."""
    serve: tuple[str, ...] = ()
    call: tuple[str, ...] = ()
    """Services and actions."""


class Security(msgspec.Struct, frozen=True, kw_only=True):
    """A security file that has been checked. All paths are absolute.

    It has no public constructor: `load_security` makes one.
    """

    file: str
    tls: Tls
    user: User | None
    password: Secret | None
    """That of `user`."""
    access: tuple[AccessRule, ...] | None
    """What others may do here; None: everything, for all who are let in."""
    user_line: int | None
    """Where the section ``user`` stands."""

    def check_listening(self) -> None:
        """Refuse to be connected to if nobody could be let in. Raises SecurityError."""
        if self.user is not None and not self.user.users:
            problem = "user: others connect to this process, and 'users' is missing: the file with a line name:password for each of them"
            raise SecurityError(problem, file=self.file, line=self.user_line)


_SECTIONS: Final = ("tls", "user", "access")
_DIRECTIONS: Final = ("publish", "subscribe", "serve", "call")


def load_security(file: str | os.PathLike[str]) -> Security:
    """Read a security file, and check it with all files that it names. Raises SecurityError, with file and line."""
    source = os.fspath(file)
    try:
        text = Path(source).read_text(encoding="utf-8")
    except OSError as error:
        raise SecurityError(f"the security file cannot be read: {error.strerror}", file=source) from error
    except UnicodeDecodeError as error:
        raise SecurityError("the security file is no text", file=source) from error
    document = Document(text, source)
    document.check_keys((), document.values, _SECTIONS)
    if "tls" not in document.values:
        raise document.error((), "'tls' is missing: without it a link can be read and changed by everybody on its way")
    folder = Path(source).absolute().parent
    tls = _tls(document, folder)
    user, password = _user(document, folder)
    access = _access(document, tls)
    line = document.error(("user",), "").line if user else None
    return Security(file=source, tls=tls, user=user, password=password, access=access, user_line=line)


def _tls(document: Document, folder: Path) -> Tls:
    tls = document.section(("tls",), Tls)
    paths: dict[str, Path] = {}
    for name, label in (("authority", "CERTIFICATE"), ("certificate", "CERTIFICATE"), ("key", "PRIVATE KEY")):
        paths[name] = folder / getattr(tls, name)
        try:
            read_pem(paths[name], label, secret=name == "key")
        except Unusable as error:
            raise document.error(("tls", name), str(error)) from error
    refused = refusal_of(**paths)
    if refused is not None:
        raise document.error(("tls", refused[0]), refused[1])
    return Tls(**{name: str(path) for name, path in paths.items()}, mutual=tls.mutual)


def _user(document: Document, folder: Path) -> tuple[User, Secret] | tuple[None, None]:
    if "user" not in document.values:
        return None, None
    user = document.section(("user",), User)
    if not user.name.strip() or ":" in user.name or not user.name.isprintable():
        raise document.error(("user", "name"), "a user's name is neither empty nor holds a colon")
    at = "password_file"
    try:
        password = read_password(folder / user.password_file)
        at = "users"
        users = read_users(folder / user.users) if user.users else {}
    except Unusable as error:
        raise document.error(("user", at), str(error)) from error
    if users.get(user.name, password) != password:
        raise document.error(("user", "users"), f"it has another password for {user.name} than password_file")
    known = str(folder / user.users) if user.users else ""
    return User(name=user.name, password_file=str(folder / user.password_file), users=known), Secret(password)


def _access(document: Document, tls: Tls) -> tuple[AccessRule, ...] | None:
    if "access" not in document.values:
        return None
    listed = cast("list[object]", document.values["access"])
    if not isinstance(cast(object, listed), list) or not listed:
        raise document.error(
            ("access",), "this is no list of rules; without 'access' all who are let in may do everything"
        )
    if not tls.mutual:
        raise document.error(("access",), "rules need tls.mutual: a process without certificate has no name")
    return tuple(_rule(document, number) for number in range(len(listed)))


def _rule(document: Document, number: int) -> AccessRule:
    path = ("access", number)
    rule = document.section(path, AccessRule)
    if not rule.peers or not all(rule.peers):
        raise document.error(
            (*path, "peers"), f"it names nobody; [{EVERYBODY!r}] stands for everybody with a certificate"
        )
    if not any(getattr(rule, direction) for direction in _DIRECTIONS):
        raise document.error(path, f"the rule allows nothing: give it some of {', '.join(_DIRECTIONS)}")
    for field in ("nodes", *_DIRECTIONS):
        for name in getattr(rule, field):
            try:
                _check_pattern(name)
            except WireFormatError:
                problem = f"{name!r} is no absolute name such as /cmd_vel; a whole part of it may be * or **"
                raise document.error((*path, field), problem) from None
    return rule


def _check_pattern(name: str) -> None:
    root, *parts = name.split("/")
    for part in parts if not root and parts else [""]:
        if part not in ("*", "**"):
            check_chunk(part, "a part of a name")


def refusal_of(authority: Path, certificate: Path, key: Path) -> tuple[str, str] | None:
    """Which of ``authority``, ``certificate`` and ``key`` is wrong and why; None if others who trust `authority` take the certificate now."""
    ours, theirs = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER), ssl.SSLContext(ssl.PROTOCOL_TLS_CLIENT)
    try:
        ours.load_cert_chain(certificate, key)
    except ssl.SSLError as error:
        if error.reason == "KEY_VALUES_MISMATCH":
            return "key", f"{key} is not the key of {certificate}"
        return "certificate", f"{certificate} and {key} cannot be loaded: {error.reason or error}"
    try:
        theirs.load_verify_locations(authority)
    except ssl.SSLError as error:
        return "authority", f"{authority} cannot be loaded: {error.reason or error}"
    theirs.check_hostname = False  # processes are known by the name in the certificate, not by that of their host
    try:
        _shake_hands(ours, theirs)
    except ssl.SSLCertVerificationError as error:
        return "certificate", f"{certificate} is not taken by those who trust {authority}: {error.verify_message}"
    return None


def _shake_hands(ours: ssl.SSLContext, theirs: ssl.SSLContext) -> None:
    to_us, to_them = ssl.MemoryBIO(), ssl.MemoryBIO()
    server = ours.wrap_bio(to_us, to_them, server_side=True)
    client = theirs.wrap_bio(to_them, to_us)
    waiting = [client, server]
    while waiting:
        side = waiting.pop(0)
        try:
            side.do_handshake()
        except ssl.SSLWantReadError:
            waiting.append(side)
