"""The verbs of the `ros2` command: `python -m robot node list`, `python -m robot topic echo /imu/data`.

A group of verbs is a module with a function ``main(argv) -> int | Exit``. It is imported when it is used, so that no command waits for what
another one needs.
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
from typing import cast

__all__ = ["GROUPS", "CommandFailed", "Exit", "module_of", "run_group"]

GROUPS: Mapping[str, str] = MappingProxyType(
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
        "map_saver_cli": "the map, as a file for map_server",
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
"""Each group with a line of help."""

_MODULES: Mapping[str, str] = MappingProxyType({"graph": "cli.drawing", "log": "cli.logging", "wtf": "cli.doctor"})
"""The modules of groups that are not called like them."""

_FOR_OTHERS = frozenset({"launch", "launch_test", "agent", "component", "web"})
"""Groups that run programs, whose output passes through, or the nodes of a tree, whose log has colours."""

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


def module_of(group: str) -> str:
    """The module that carries out a group."""
    return _MODULES.get(group, f"cli.{group}")


def run_group(name: str, argv: Sequence[str]) -> int:
    """Run a verb of the group `name`, and return its exit code (see `Exit`). Writes a line about every error, and raises none."""
    from cli.output import safe_output

    words, as_ros2 = _without_option(argv)
    try:
        with nullcontext() if name in _FOR_OTHERS else safe_output():
            ended = _run(name, words)
    except KeyboardInterrupt:
        ended = Exit.INTERRUPTED
    return ended.value[as_ros2] if isinstance(ended, Exit) else ended


def _run(name: str, words: Sequence[str]) -> int | Exit:
    try:
        stdout: object = sys.stdout
        if isinstance(stdout, io.TextIOWrapper):
            cast("io.TextIOWrapper", stdout).reconfigure(line_buffering=True)  # as that of ros2, also in a pipe
        module = import_module(module_of(name))
        if threading.current_thread() is threading.main_thread():
            signal.signal(signal.SIGINT, signal.default_int_handler)
        ended: int | Exit = module.main(words)
        sys.stdout.flush()
        return ended
    except CommandFailed as failed:
        print(failed, file=sys.stderr)
        return Exit.FAILED
    except BrokenPipeError:
        # whoever read our output has gone, as in `... | head`; nothing more can be written, not even at exit
        sys.stdout = open(os.devnull, "w")  # noqa: SIM115  # for the rest of the process
        return Exit.DONE
    except Exception as error:
        if os.environ.get("ROBACTOR_TRACEBACK"):
            raise
        text = " ".join(str(error).split())
        print(f"{type(error).__name__}: {text} (ROBACTOR_TRACEBACK=1 shows where)", file=sys.stderr)
        return Exit.FAILED


def _without_option(argv: Sequence[str]) -> tuple[list[str], bool]:
    """The words without `--ros2-exit-codes`, and whether it was there. What follows `--` or `--ros-args` is another program's."""
    words = list(argv)
    own = next((index for index, word in enumerate(words) if word in ("--", "--ros-args")), len(words))
    given = EXIT_CODES_OPTION in words[:own]
    if given:
        words.remove(EXIT_CODES_OPTION)
    return words, given
