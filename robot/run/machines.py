"""What `--host` says: which concerns of the robot run on which other machines, and where those are."""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from cli.command import UsageError
from robot.concerns import ELSEWHERE, HERE

if TYPE_CHECKING:
    from actors.hosts import TlsHosts

_FORM = "CONCERN=HOST[@ADDRESS[:PORT]][,SPARE...], such as navigation=base@192.168.1.6,spare@192.168.1.7"


@dataclass(frozen=True, slots=True)
class Machines:
    """`hosts` has the machines of each concern that runs elsewhere, the first one first; `addresses` has those of all machines."""

    hosts: dict[str, tuple[str, ...]]
    addresses: dict[str, str]


def parse_machines(words: Sequence[str]) -> Machines | None:
    """The machines of all words ``--host``; None without any. A machine without an address is looked for by its name. Raises `UsageError`."""
    hosts: dict[str, tuple[str, ...]] = {}
    addresses: dict[str, str] = {}
    for text in words:
        concern, _, rest = text.partition("=")
        machines = [part.partition("@") for part in rest.split(",")]
        if not concern or not all(name and bool(at) == bool(address) for name, at, address in machines):
            raise UsageError(f"--host {text}: write {_FORM}")
        if concern in HERE:
            raise UsageError(f"--host {text}: {HERE[concern]}")
        if concern not in ELSEWHERE:
            raise UsageError(f"--host {text}: what may run elsewhere is {', '.join(ELSEWHERE)}")
        if concern in hosts:
            raise UsageError(
                f"--host {text}: {concern} has machines already; write them in one word, the first choice first"
            )
        hosts[concern] = tuple(name for name, _, _ in machines)
        for name, _, address in machines:
            if address and addresses.setdefault(name, address) != address:
                raise UsageError(f"--host {text}: {name} is at {addresses[name]} already")
    for name in (name for names in hosts.values() for name in names):
        addresses.setdefault(name, name)
    return Machines(hosts, addresses) if hosts else None


def tls_hosts(machines: Machines, file: str | None) -> TlsHosts:
    """The way to these machines, with the security file that was named or that of the environment. Raises `UsageError`."""
    from actors import DeclarationError
    from actors.hosts import TlsHosts
    from actors.transport.security import SecurityError, load_security

    named = file if file is not None else os.environ.get("ROBACTOR_SECURITY", "")
    if not named:
        raise UsageError(
            "--host: who gives work to other machines must show who it is: add --security FILE, or ROBACTOR_SECURITY=FILE (docs/howto/machines.md)"
        )
    try:
        return TlsHosts(machines.addresses, security=load_security(named))
    except (DeclarationError, SecurityError) as error:
        raise UsageError(f"--host: {error}") from None
