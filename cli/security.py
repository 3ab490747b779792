"""`security create | show | check`: a small authority for one fleet, and what a security file says."""

from __future__ import annotations

import argparse
import os
from collections.abc import Iterator, Sequence
from datetime import UTC, datetime
from pathlib import Path

from actors.transport.environment import security_from_environment
from actors.transport.security import AccessRule, Security, SecurityError
from cli.command import CommandFailed

__all__ = ["main", "shown"]

DAYS = 365
WARNING_DAYS = 30
"""A certificate that ends sooner is worth a warning."""


def main(argv: Sequence[str]) -> int:
    """Run one verb of the group; the exit code."""
    options = _parser().parse_args(argv)
    try:
        if options.verb == "create":
            return _create(options)
        security = security_from_environment(os.environ, options.file)
        if security is None:
            raise CommandFailed("name a security file, or set ROBACTOR_SECURITY")
        return _show(security) if options.verb == "show" else _check(security)
    except SecurityError as error:
        raise CommandFailed(str(error)) from error


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="python -m robot security", description="Who takes part in the graph, and in what (docs/security.md)."
    )
    verbs = parser.add_subparsers(dest="verb", required=True, metavar="VERB")
    create = verbs.add_parser("create", help="make an authority, and a certificate for each process")
    create.add_argument("folder", metavar="FOLDER", help="made if it is not there; more names can be added later")
    create.add_argument("names", nargs="+", metavar="NAME", help="the name of a process, for instance robot or desk")
    create.add_argument("--days", type=_days, default=DAYS, metavar="N", help=f"valid for N days ({DAYS})")
    create.add_argument("--passwords", action="store_true", help="a user and a password for each of them, too")
    for verb, text in (("show", "print what a security file says"), ("check", "end with 1 if it cannot be used")):
        reading = verbs.add_parser(verb, help=text)
        reading.add_argument("file", nargs="?", metavar="FILE", help="a security file (that of ROBACTOR_SECURITY)")
    return parser


def _days(text: str) -> int:
    number = int(text) if text.isascii() and text.isdigit() else 0
    if not 1 <= number <= 3650:
        raise argparse.ArgumentTypeError(f"{text!r} is no number of days from 1 to 3650")
    return number


def _create(options: argparse.Namespace) -> int:
    from actors.transport.security.authority import create

    for file in create(Path(options.folder), options.names, days=options.days, passwords=options.passwords):
        print(file)
    return 0


def _show(security: Security) -> int:
    for line in shown(security):
        print(line)
    return 0


def _check(security: Security) -> int:
    from actors.transport.security.authority import read_certificate

    security.check_listening()
    for file in (security.tls.certificate, security.tls.authority):
        left = (read_certificate(file).ends - datetime.now(UTC)).days
        if left < WARNING_DAYS:
            print(f"{file}: ends in {left} days")
    print(f"{security.file}: can be used")
    return 0


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
