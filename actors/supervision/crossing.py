"""The checks of `process=True`: whether a declaration can be copied to another process, and the options that go with it."""

from __future__ import annotations

import pickle
import sys
from collections.abc import Mapping, Sequence
from typing import Final

from actors.checks import checked_flag, factory_name, is_number
from actors.errors import DeclarationError, described

__all__ = ["HANG_SECONDS", "check_crossing", "check_process"]

HANG_SECONDS: Final = 5.0
"""How long the event loop of a process may stand still before the process is killed, unless declared otherwise; seconds."""


def check_process(where: str, process: object, hang: object) -> None:
    """Raise `DeclarationError` unless `process` and `hang` are valid, each by itself and together."""
    checked_flag(where, "process", process)
    if not is_number(hang) or hang <= 0:
        raise DeclarationError(f"{where}: hang must be seconds, more than 0, or math.inf, not {hang!r}")
    if hang != HANG_SECONDS and not process:
        raise DeclarationError(
            f"{where}: hang={hang!r} watches the event loop of a process: add process=True, or drop hang"
        )


def check_crossing(
    where: str, factory: object, args: Sequence[object], parameters: Mapping[str, object], why: str = "process=True"
) -> None:
    """Raise `DeclarationError` unless the parts of a child can be copied to another process; `why` says what demands it."""
    if problem := _problem_of(factory):
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
