"""`security create | show | check`: a small authority for one fleet, and what a security file says."""

from __future__ import annotations

import argparse
import os
from collections.abc import Generator, Iterator
from contextlib import contextmanager
from datetime import UTC, datetime
from pathlib import Path

from actors.transport.environment import security_from_environment
from actors.transport.security import AccessRule, Security, SecurityError
from cli.command import CommandFailed
from cli.parsing import Parser
from cli.verb import Group, Verb

DAYS = 365
WARNING_DAYS = 30
"""A certificate that ends sooner is worth a warning."""


def _create_arguments(parser: Parser) -> None:
    parser.add_argument("folder", metavar="FOLDER", help="made if it is not there; more names can be added later")
    parser.add_argument("names", nargs="+", metavar="NAME", help="the name of a process, for instance robot or desk")
    parser.add_argument("--days", type=_days, default=DAYS, metavar="N", help=f"valid for N days ({DAYS})")
    parser.add_argument("--passwords", action="store_true", help="a user and a password for each of them, too")


def _file_arguments(parser: Parser) -> None:
    parser.add_argument("file", nargs="?", metavar="FILE", help="a security file (that of ROBACTOR_SECURITY)")


def _days(text: str) -> int:
    number = int(text) if text.isascii() and text.isdigit() else 0
    if not 1 <= number <= 3650:
        raise argparse.ArgumentTypeError(f"{text!r} is no number of days from 1 to 3650")
    return number


def _create(options: argparse.Namespace) -> int:
    from actors.transport.security.authority import create

    try:
        for file in create(Path(options.folder), options.names, days=options.days, passwords=options.passwords):
            print(file)
    except SecurityError as error:
        raise CommandFailed(str(error)) from error
    return 0


def _show(options: argparse.Namespace) -> int:
    with _read(options) as security:
        for line in shown(security):
            print(line)
    return 0


def _check(options: argparse.Namespace) -> int:
    with _read(options) as security:
        _examine(security)
    return 0


@contextmanager
def _read(options: argparse.Namespace) -> Generator[Security]:
    """The file that is named, or that of the environment. What is wrong with it is `CommandFailed`, also within the block."""
    try:
        security = security_from_environment(os.environ, options.file)
        if security is None:
            raise CommandFailed("name a security file, or set ROBACTOR_SECURITY")
        yield security
    except SecurityError as error:
        raise CommandFailed(str(error)) from error


def _examine(security: Security) -> None:
    from actors.transport.security.authority import read_certificate

    security.check_listening()
    for file in (security.tls.certificate, security.tls.authority):
        left = (read_certificate(file).ends - datetime.now(UTC)).days
        if left < WARNING_DAYS:
            print(f"{file}: ends in {left} days")
    print(f"{security.file}: can be used")


def shown(security: Security) -> Iterator[str]:
    """What is on, a line each. No secret is in it."""
    from actors.transport.security.authority import read_certificate

    tls, user, access = security.tls, security.user, security.access
    own, authority = read_certificate(tls.certificate), read_certificate(tls.authority)
    yield f"name         {own.name}"
    yield f"certificate  until {own.ends:%Y-%m-%d}, SHA-256 {own.fingerprint[:16]}..."
    yield f"authority    {authority.name}, until {authority.ends:%Y-%m-%d}, SHA-256 {authority.fingerprint[:16]}..."
    yield f"TLS          {'mutual: who connects needs a certificate' if tls.mutual else 'of the listening side only'}"
    yield f"user         {'none' if user is None else user.name}"
    if user is not None:
        yield f"lets in      {user.users or 'nobody: it can only connect'}"
    yield f"access       {'everything, for all who are let in' if access is None else 'only this:'}"
    for rule in access or ():
        yield from _rule(rule)


def _rule(rule: AccessRule) -> Iterator[str]:
    yield f"  {', '.join(rule.peers)}, as {', '.join(rule.nodes)}"
    for direction in ("publish", "subscribe", "serve", "call"):
        names: tuple[str, ...] = getattr(rule, direction)
        if names:
            yield f"    {direction:<10} {', '.join(names)}"


COMMAND = Group(
    "security",
    "Who takes part in the graph, and in what (docs/howto/security.md).",
    Verb("create", "make an authority, and a certificate for each process", _create_arguments, _create),
    Verb("show", "print what a security file says", _file_arguments, _show),
    Verb("check", "end with 1 if it cannot be used", _file_arguments, _check),
)
