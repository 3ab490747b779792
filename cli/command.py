"""The verbs of the `ros2` command: `python -m robot node list`, `python -m robot topic echo /imu/data`.

A group of verbs is a module of this package with a function ``main(argv) -> int``. It is imported when it is used, so that no command waits
for what another one needs.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Mapping, Sequence
from importlib import import_module
from types import MappingProxyType

__all__ = ["GROUPS", "CommandFailed", "run_group"]

GROUPS: Mapping[str, str] = MappingProxyType(
    {
        "node": "the nodes of the graph                     node list",
        "topic": "its topics, and what is sent on them       topic list | echo",
        "bag": "recordings                                 bag record --all | play BAG | info BAG",
        "top": "hosts, processes and nodes, live            top --once | --json",
        "security": "certificates, and who may do what          security create | show | check",
        "router": "the meeting point of several machines      router --listen tcp/0.0.0.0:7447",
    }
)
"""Each group with a line of help."""

INTERRUPTED = 130
"""The exit code after Ctrl-C, as shells have it."""


class CommandFailed(Exception):
    """A command cannot do what it was asked for; the text says what happened and what to do. The exit code is 1."""


def run_group(name: str, argv: Sequence[str]) -> int:
    """Run a verb of the group `name`. Returns the exit code: 0 done, 1 not possible, 2 not understood, 130 Ctrl-C."""
    try:
        return int(import_module(f"cli.{name}").main(argv))
    except CommandFailed as failed:
        print(failed, file=sys.stderr)
        return 1
    except KeyboardInterrupt:
        return INTERRUPTED
    except BrokenPipeError:
        # whoever read our output has gone, as in `... | head`; nothing more can be written, not even at exit
        sys.stdout = open(os.devnull, "w")  # noqa: SIM115  # for the rest of the process
        return 0
