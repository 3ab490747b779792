"""`spin(Talker)`: a whole program of one line, with the arguments and the environment variables of ROS 2."""

from __future__ import annotations

import os
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import NoReturn

from actors.logs import LogRecord
from actors.running.options import with_own_arguments
from actors.running.run import execute, refuse_a_running_loop, run
from actors.running.trees import Runnable
from actors.runtime.node import Node
from actors.supervision.child import Child
from actors.supervision.declarations import DynamicSupervisor, Spec, Supervisor
from actors.supervision.errors import StartFailed, SupervisorGaveUp
from actors.supervision.policy import Intensity, all_significant, never, permanent, transient
from actors.system import System

WRONG_ARGUMENT = 2
"""The exit code for an argument that is wrong, as argparse has it."""


def spin(tree: Runnable, *more: Spec | type[Node], argv: Sequence[str] | None = None) -> None:
    """Run a tree as a program of ROS 2, until it ends, or until Ctrl-C, SIGTERM or SIGHUP stops it in order: ``spin(Talker)`` is all of it.

    `argv`, by default the words of the command line, are the arguments for `run`. Other processes are reached as the environment variables
    of ROS 2 say (`transport_from_environment`). The log goes to the terminal.

    A node that is given alone is the program: when it ends by itself, so does the program, and an error of it is not followed by a restart.
    For restarts, give a `Supervisor`.

    Returns when all went well, also when a signal has stopped it in order: by SIGINT `ros2 launch` asks its nodes for their end, and those
    of ROS 2 end with 0. Raises ``SystemExit`` otherwise: with 1 after a start that failed or an error that ended the program, 2 for a wrong
    argument, each reported in a line, 128 and the number of the second signal that killed it, and what a node gave to `sys.exit`.
    Raises `RuntimeError` in a thread whose event loop runs already, as in a notebook.
    """
    from actors.running.trees import tree_of
    from actors.transport.protocol import WireUnavailable

    refuse_a_running_loop("spin", "`async with run(...) as system`, or actors.blocking.open_node(..., tree=...)")
    words = sys.argv[1:] if argv is None else argv
    whole = tree_of("spin(...)", tree, *more)
    trees = [whole] if whole is tree or isinstance(whole, DynamicSupervisor) else whole.children
    try:
        code = execute(lambda: live(trees, words, signal_is_failure=False))
    except (StartFailed, SupervisorGaveUp) as error:
        _end(error, 1)
    except (WireUnavailable, ValueError) as error:
        _end(error, WRONG_ARGUMENT)
    if code:
        raise SystemExit(code)


async def live(trees: Sequence[Spec | type[Node]], argv: Sequence[str], *, signal_is_failure: bool = True) -> int:
    """Run the trees side by side until they end, and return the exit code. Raises what `run` and `System.wait` raise.

    Unless `signal_is_failure`, a signal that has stopped them in order makes the exit code 0.
    """
    from actors.logs import console_sink
    from actors.transport import transport_from_environment

    failed: list[LogRecord] = []

    def note(record: LogRecord) -> None:
        if record.fields.get("job") == "failed":
            failed.append(record)

    tree = _whole([_significant(tree, argv) for tree in trees])
    transport, seen, sinks = transport_from_environment(os.environ), _Seen(), (console_sink(sys.stdout), note)
    try:
        async with run(tree, argv=argv, sinks=sinks, observers=(seen,), transport=transport) as system:
            await system.wait()
    except (KeyboardInterrupt, SystemExit):  # a signal during the start or the stop, or a node's `sys.exit`
        if signal_is_failure or not seen.stopped_by_signal:
            raise
    if not signal_is_failure and seen.stopped_by_signal:
        return 0
    return seen.system.exit_code or int(bool(failed))


class _Seen:
    """Sees the system of a run, also one whose start is taken back."""

    def attach(self, system: System) -> None:
        self.system = system

    @property
    def stopped_by_signal(self) -> bool:
        """Whether it has ended in order, because of a signal."""
        tree = self.system.runtime.tree
        return tree.signal is not None and not tree.killed and tree.exit_request is None and tree.failure is None


def _significant(tree: Spec | type[Node], argv: Sequence[str]) -> Spec:
    """A node that is run alone is a program: it ends with the node, and may take words of its own."""
    if isinstance(tree, type):
        tree = Child(tree)
    if not isinstance(tree, Child) or tree.restart is not permanent:
        return tree
    return with_own_arguments(tree.replace(restart=transient, significant=True), argv)


def _whole(children: Sequence[Spec]) -> Supervisor | DynamicSupervisor:
    if len(children) == 1 and not isinstance(children[0], Child):
        return children[0]
    ends = any(isinstance(child, Child) and child.significant for child in children)
    # as a program of ROS 2, it is not started again after an error
    return Supervisor(
        "run", children=children, auto_shutdown=all_significant if ends else never, intensity=Intensity(0, within=1.0)
    )


def _end(error: Exception, code: int) -> NoReturn:
    print(f"{Path(sys.argv[0]).name}: {error}", file=sys.stderr)
    raise SystemExit(code) from None
