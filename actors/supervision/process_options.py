"""The checks of `process=True` and `host=`: whether a declaration can be copied to another process, and the options that go with it."""

from __future__ import annotations

import pickle
import sys
from collections.abc import Mapping, Sequence
from typing import Final, cast

from actors.checks import checked_flag, checked_sequence, factory_name, is_number, shown
from actors.errors import DeclarationError, described

HANG_SECONDS: Final = 5.0
"""How long the event loop of a process may stand still before the process is killed, unless declared otherwise; seconds."""
_SCRIPT: Final = "another machine does not have this script"


def check_process(where: str, process: object, hang: object) -> None:
    """Raise `DeclarationError` unless `process` and `hang` are valid, each by itself and together."""
    checked_flag(where, "process", process)
    if not is_number(hang) or hang <= 0:
        raise DeclarationError(f"{where}: hang must be seconds, more than 0, or math.inf, not {shown(hang)}")
    if hang != HANG_SECONDS and not process:
        raise DeclarationError(
            f"{where}: hang={hang!r} watches the event loop of a process: add process=True, or drop hang"
        )


def checked_hosts(where: str, host: object, hosts: object) -> tuple[str, ...]:
    """The hosts of a child, by name; none if it runs on this one. Raises `DeclarationError`."""
    if host is not None:
        if hosts:
            raise DeclarationError(f"{where}: host={host!r} is short for hosts=[{host!r}]: give one of the two")
        hosts = (host,)
    names = checked_sequence(where, "hosts", hosts)
    for name in names:
        if not isinstance(name, str) or not name.strip():
            raise DeclarationError(f"{where}: a host must be the name of a machine, not {name!r}")
    if len(set(names)) < len(names):
        raise DeclarationError(f"{where}: hosts={list(names)} names a host twice")
    return cast("tuple[str, ...]", names)


def why_crossing(hosts: Sequence[str]) -> str:
    """The option that has a child run in another process."""
    return f"it is to run on {' or '.join(hosts)}" if hosts else "process=True"


def check_crossing(
    where: str,
    factory: object,
    args: Sequence[object],
    parameters: Mapping[str, object],
    why: str = "process=True",
    *,
    away: bool = False,
) -> None:
    """Raise `DeclarationError` unless the parts of a child can be copied to another process; `why` says what demands it. `away`: that
    process is on another machine, which has the modules that are installed there, but not the script that this program is."""
    if problem := _problem_of(factory) or (
        _SCRIPT if away and getattr(factory, "__module__", "") == "__main__" else ""
    ):
        raise DeclarationError(
            f"{where}: {why}, and its factory {factory_name(factory)} cannot be found by another process: {problem}; define it at the "
            "top level of a module"
        )
    values = [(f"args[{number}]", value) for number, value in enumerate(args)]
    for option, value in (*values, *((f"parameters[{name!r}]", value) for name, value in parameters.items())):
        if problem := _problem_of(value):
            raise DeclarationError(
                f"{where}: {why}, and {option}, {value!r:.60}, cannot be copied to another process: {problem}; hand in what it is made "
                "from, and make it in the node"
            )


def _problem_of(value: object) -> str:
    """Why the value cannot be copied to another process; empty if it can."""
    if getattr(value, "__module__", None) == "__main__" and not _can_be_imported(sys.modules["__main__"]):
        return "it was defined in an interactive session"
    try:
        pickle.loads(pickle.dumps(value, pickle.HIGHEST_PROTOCOL))
    except Exception as error:
        return described(error)
    return ""


def _can_be_imported(main: object) -> bool:
    """Whether another process can import what this program runs as ``__main__``."""
    return getattr(main, "__spec__", None) is not None or bool(getattr(main, "__file__", ""))
