"""Which processes a test means, and whether a text is what it expects."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Sequence
from typing import Any, Protocol, TypeAlias, cast

from actors.launch.actions.processes import ExecuteProcess

NO_CMD_ARGS = object()
"""As `cmd_args`: the process has no arguments."""

Expected: TypeAlias = str | re.Pattern[str] | Iterable[object]
"""A text, a pattern, or several of them that follow each other."""

_COLOURS = re.compile(r"\x1b\[[0-9;?]*[ -/]*[@-~]")


class NoMatchingProcessException(Exception):
    """No process of which something is known is the one that a test means."""


class Records(Protocol):
    """What is known of processes, by the actions that have started them."""

    def processes(self) -> list[Any]: ...


def resolve_processes(
    info_obj: Records, *, process: object = None, cmd_args: object = None, strict_proc_matching: bool = True
) -> list[Any]:
    """The actions of the processes that are meant: all for None, that of an action, or those whose names contain a text.

    `cmd_args` is an argument, or several, that the command of such a process has, or `NO_CMD_ARGS`. Raises `NoMatchingProcessException`
    where there is none, and `LookupError` where a text means several and `strict_proc_matching` is true.
    """
    known = info_obj.processes()
    if process is None:
        if not known:
            raise NoMatchingProcessException("nothing is known of any process")
        return known
    if isinstance(process, ExecuteProcess):
        if process not in known:
            raise NoMatchingProcessException(f"nothing is known of {_shown(process)}; there are: {_listed(known)}")
        return [process]
    if not isinstance(process, str):
        raise TypeError(f"process is the action that starts it, or a part of its name, not {process!r:.60}")
    found = [one for one in known if process in one.process_details["name"] and _has_arguments(one, cmd_args)]
    wanted = f"{process!r}{'' if cmd_args is None else f' with arguments {cmd_args!r}'}"
    if not found:
        raise NoMatchingProcessException(f"no process has the name {wanted}; there are: {_listed(known)}")
    if strict_proc_matching and len(found) > 1:
        raise LookupError(f"several processes have the name {wanted}: {_listed(found)}")
    return found


def _has_arguments(action: Any, cmd_args: Any) -> bool:
    given = list(action.process_details["cmd"])[1:]
    if cmd_args is None:
        return True
    if cmd_args is NO_CMD_ARGS:
        return not given
    wanted = [cmd_args] if isinstance(cmd_args, str) else list(cmd_args)
    return all(word in given for word in wanted)


def _shown(action: Any) -> str:
    details = action.process_details
    return "a process that was not started" if details is None else " ".join([details["name"], *details["cmd"][1:]])


def _listed(actions: Sequence[object]) -> str:
    return ", ".join(sorted(map(_shown, actions))) or "none"


def without_colours(text: str) -> str:
    """The text without the control sequences of terminals."""
    return _COLOURS.sub("", text)


def build_text_match(expected_text: Expected) -> Callable[[str], tuple[int, int] | None]:
    """A function that gives the place at which a text is what is expected, or None.

    Several expectations follow each other, with anything between them.
    """
    parts = list(map(_pattern, _parts(expected_text)))

    def match(text: str) -> tuple[int, int] | None:
        text = text.replace("\r\n", "\n")
        first, end = -1, 0
        for part in parts:
            found = part.search(text, end)
            if found is None:
                return None
            first, end = (found.start() if first < 0 else first), found.end()
        return max(first, 0), end

    return match


def _parts(expected: Expected) -> list[object]:
    return [expected] if isinstance(expected, (str, re.Pattern)) else list(expected)


def _pattern(part: object) -> re.Pattern[str]:
    if isinstance(part, str):
        return re.compile(re.escape(part))
    if not isinstance(part, re.Pattern):
        raise ValueError(f"expected is a text, a pattern, or a list of them, not {part!r:.60}")
    return cast("re.Pattern[str]", part)
