"""The program `robactor`: its commands, how they are found, and how they end.

A command of this project is a module `cli.verbs.NAME` with a `COMMAND`. Other packages add theirs by entry points of the group
``robactor.verbs``, as the robot does with `run`. A command is imported when it is used, so that none waits for what another one needs.
"""

from __future__ import annotations

import io
import os
import signal
import sys
import threading
from collections.abc import Mapping, Sequence
from contextlib import nullcontext
from enum import Enum
from importlib import import_module
from types import MappingProxyType
from typing import Any, NamedTuple, Protocol, cast

VERBS = "robactor.verbs"
"""The group of the entry points by which packages add commands."""

COMMANDS: Mapping[str, str] = MappingProxyType(
    {
        "node": "the nodes of the graph",
        "topic": "its topics, and what is sent on them",
        "service": "its services",
        "action": "its actions",
        "param": "the parameters of its nodes",
        "lifecycle": "its managed nodes",
        "component": "nodes that a container loads",
        "interface": "types of messages, services and actions",
        "pkg": "packages, their executables, new ones",
        "graph": "who talks with whom, as text or picture",
        "log": "what the nodes log",
        "plot": "fields of topics over time",
        "tf2_echo": "the transform between two frames",
        "view_frames": "the tree of frames, as a graph",
        "static_transform_publisher": "a transform that never changes",
        "launch": "start what a launch file says",
        "launch_test": "test what a launch file starts",
        "bag": "recordings: record, play, info, ...",
        "web": "the web page, Foxglove, rosbridge",
        "top": "hosts, processes and nodes, live",
        "security": "certificates, and who may do what",
        "doctor": "why something does not work",
        "wtf": "the same as doctor",
        "agent": "takes parts of trees elsewhere",
        "router": "the meeting point of several machines",
        "daemon": "what ros2 needs, and this does not",
        "multicast": "whether multicast reaches this machine",
        "completion": "for bash, zsh and fish",
    }
)
"""Each command of this project with a line of help."""

_FOR_OTHERS = frozenset({"launch", "launch_test", "agent", "component", "web"})
"""Commands that run programs, whose output passes through, or the nodes of a tree, whose log has colours."""

EXIT_CODES_OPTION = "--ros2-exit-codes"


class Exit(Enum):
    """How a command ended: its exit code, and that of `ros2`, which `--ros2-exit-codes` gives."""

    DONE = (0, 0)
    FAILED = (1, 1)
    REFUSED = (1, 0)
    """The question was answered with a no, such as a parameter that a node refuses. `ros2` says 0, which deceives a script."""
    MISUSED = (2, 2)
    INTERRUPTED = (130, 2)
    """Ctrl-C."""
    TERMINATED = (143, 15)
    """SIGTERM."""
    HUNG_UP = (129, 129)
    """SIGHUP: the terminal was closed."""

    @classmethod
    def by(cls, number: int) -> Exit:
        """How a command ended that a signal has ended in order; SIGPIPE is that nobody reads its output any more."""
        ends = {
            signal.SIGINT: cls.INTERRUPTED,
            signal.SIGTERM: cls.TERMINATED,
            signal.SIGHUP: cls.HUNG_UP,
            signal.SIGPIPE: cls.DONE,
        }
        return ends[signal.Signals(number)]


class CommandFailed(Exception):
    """A command cannot do what it was asked for; the text says what happened and what to do. The exit code is 1."""


class UsageError(Exception):
    """The words of a command cannot be used; the text is one line for the user. The exit code is 2."""


class Command(Protocol):
    """What carries out a command: a `cli.verb.Verb`, a `cli.verb.Group`, or what else a package's entry point names."""

    @property
    def name(self) -> str: ...
    @property
    def help(self) -> str:
        """A line for ``robactor --help``."""
        ...

    def main(self, argv: Sequence[str]) -> int | Exit:
        """Carry it out with the words that follow its name."""
        ...


def found(name: str) -> Command | None:
    """The command of this name, imported; None if there is none. Raises `CommandFailed` for one of another package that cannot be imported."""
    if name in COMMANDS:
        command: Command = import_module(f"cli.verbs.{'doctor' if name == 'wtf' else name}").COMMAND
        return command
    for entry in added():
        if entry.name == name:
            try:
                return cast("Command", entry.load())
            except (ImportError, AttributeError) as error:
                raise CommandFailed(f"{name} cannot be loaded from {entry.value}: {error}") from error
    return None


class EntryPoint(NamedTuple):
    """One entry point of an installed package."""

    name: str
    value: str
    """``package.module``, or ``package.module:attribute``."""

    def load(self) -> Any:
        """The module or attribute, imported."""
        module, _, attribute = self.value.partition(":")
        loaded = import_module(module)
        return getattr(loaded, attribute) if attribute else loaded


def added(group: str = VERBS) -> list[EntryPoint]:
    """The entry points of a group of all installed packages, in the order of their packages on the path.

    Read from their files: importing `importlib.metadata` alone takes twice as long as printing the help.
    """
    found: dict[str, EntryPoint] = {}
    for folder in sys.path:
        try:
            packages = [name for name in os.listdir(folder or ".") if name.endswith(".dist-info")]
        except OSError:
            continue
        for package in sorted(packages):
            try:
                with open(
                    os.path.join(folder, package, "entry_points.txt"), encoding="utf-8", errors="replace"
                ) as file:
                    sections = file.read().split("\n[")
            except OSError:
                continue
            for section in sections:
                title, *lines = section.lstrip("[").splitlines() or [""]
                if title.strip() == f"{group}]":
                    pairs = [line.split("=", 1) for line in lines if "=" in line]
                    for name, value in pairs:
                        found.setdefault(name.strip(), EntryPoint(name.strip(), value.strip()))
    return list(found.values())


def run_command(name: str, argv: Sequence[str]) -> int:
    """Run a command, and return its exit code (see `Exit`). Writes a line about every error, and raises none."""
    from cli.output import safe_output

    words, as_ros2 = _without_option(argv)
    try:
        with safe_output() if name in COMMANDS and name not in _FOR_OTHERS else nullcontext():
            ended = _run(name, words)
    except KeyboardInterrupt:
        ended = Exit.INTERRUPTED
    return ended.value[as_ros2] if isinstance(ended, Exit) else ended


def _run(name: str, words: Sequence[str]) -> int | Exit:
    try:
        stdout: object = sys.stdout
        if isinstance(stdout, io.TextIOWrapper):
            cast("io.TextIOWrapper", stdout).reconfigure(line_buffering=True)  # as that of ros2, also in a pipe
        command = found(name)
        if command is None:
            raise UsageError(unknown(name))
        if threading.current_thread() is threading.main_thread():
            signal.signal(signal.SIGINT, signal.default_int_handler)
        ended = command.main(words)
        sys.stdout.flush()
        return ended
    except CommandFailed as failed:
        print(failed, file=sys.stderr)
        return Exit.FAILED
    except UsageError as error:
        print(error, file=sys.stderr)
        return Exit.MISUSED
    except BrokenPipeError:
        # the reader of our output has gone, as in `... | head`; nothing more can be written, not even at exit
        sys.stdout = open(os.devnull, "w")  # noqa: SIM115  # for the rest of the process
        return Exit.DONE
    except Exception as error:
        if os.environ.get("ROBACTOR_TRACEBACK"):
            raise
        text = " ".join(str(error).split())
        foreseen = isinstance(error, OSError) or type(error).__module__.startswith(
            "actors."
        )  # their texts are for people
        print(
            text if foreseen else f"{type(error).__name__}: {text} (ROBACTOR_TRACEBACK=1 shows where)", file=sys.stderr
        )
        return Exit.FAILED


def unknown(name: str) -> str:
    """The sentence for a name that is no command's, with the nearest one."""
    from actors.suggest import did_you_mean

    near = did_you_mean(name, [*(entry.name for entry in added()), *COMMANDS], quoted=False)
    return f"robactor: there is no command {name!r}{near} (see robactor --help)"


def _without_option(argv: Sequence[str]) -> tuple[list[str], bool]:
    """The words without `--ros2-exit-codes`, and whether it was there. What follows `--` or `--ros-args` is another program's."""
    words = list(argv)
    own = next((index for index, word in enumerate(words) if word in ("--", "--ros-args")), len(words))
    given = EXIT_CODES_OPTION in words[:own]
    if given:
        words.remove(EXIT_CODES_OPTION)
    return words, given
