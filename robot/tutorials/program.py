"""What the tutorials share: nodes that have one job, trees that end when the jobs are done, and `main`, which runs one from a terminal."""

from __future__ import annotations

import argparse
import asyncio
import os
import sys
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any, NoReturn

from actors import (
    Action,
    ActorError,
    Child,
    ExitReason,
    Node,
    Service,
    StartFailed,
    Supervisor,
    SupervisorGaveUp,
    background,
    execute,
    parameter,
    run,
    transient,
)
from actors.logs import Level, LogRecord, console_sink
from actors.supervision import Stopped, all_significant, never
from actors.transport import WireUnavailable, transport_from_environment
from actors.typing import Spec
from cli.command import UsageError
from cli.parsing import Parser
from robot.run.arguments import LEVELS, seconds
from robot.run.tree_nodes import UnknownNode, only

if TYPE_CHECKING:
    from actors.transport import Transport

SLICE = 1.0
"""How often a client that waits for its server says so, s."""


class JobFailed(Exception):
    """Raise it in a job that cannot be done; its text goes to the log."""


class Job(Node):
    """A node with one job: it waits for its server, does the job, says how it went, and ends itself.

    Parameters: patience.
    """

    patience = parameter(60.0, unit="s", ge=0.0, description="How long to wait for the server before giving up.")

    async def job(self) -> None:
        """The job. Raises `JobFailed`, or an `ActorError`, when it cannot be done."""
        raise NotImplementedError(f"{type(self).__name__} has no job: define `async def job(self)`")

    @background
    async def run_job(self) -> None:
        """Once per life; a life that fails is restarted and does it again."""
        try:
            await self.job()
        except (JobFailed, ActorError) as problem:
            self.log.error(str(problem), job="failed")
        self.stop("its job is done")

    async def wait_in_slices(self, contract: Service[Any, Any] | Action[Any, Any, Any], line: str) -> None:
        """Wait for a server, and log `line` after every second without one. Raises an `ActorError` after `patience` seconds."""
        left = self.patience
        while True:
            try:
                return await self.wait_for(contract, timeout=min(SLICE, left))
            except TimeoutError:
                self.log.info(line)
                left -= SLICE
                if left <= 0.0:
                    raise


def was_interrupted(reason: ExitReason) -> bool:
    """Whether a node ends because of Ctrl-C (or SIGTERM)."""
    return isinstance(reason, Stopped) and reason.why in ("SIGINT", "SIGTERM")


def system(name: str, *nodes: Spec | type[Node]) -> Supervisor:
    """A tree of these nodes. It ends when its jobs are done; without jobs it runs until it is stopped."""
    children = [_child(node) for node in nodes]
    jobs = any(child.significant for child in children)
    return Supervisor(name, children=children, auto_shutdown=all_significant if jobs else never)


def _child(node: Spec | type[Node]) -> Spec:
    if not isinstance(node, type):
        return node
    return Child(node, restart=transient, significant=True) if issubclass(node, Job) else Child(node)


def main(tree: Callable[[], Supervisor], argv: Sequence[str] | None = None, *, name: str | None = None) -> NoReturn:
    """Run a tutorial until its jobs are over, or until Ctrl-C, and exit.

    The exit code is 0, also after Ctrl-C, because that is how these programs are meant to end; 1 when a job failed, 2 for options
    that are not understood, 3 when a node did not start or a supervisor gave up. `name` is how the program calls itself.
    """
    name = name or _own_name()
    try:
        options = _options(tree, argv, name)
        chosen, transport = _chosen(tree(), options), _transport(options)
    except UsageError as error:
        print(f"{name.removeprefix('python -m ')}: {error}", file=sys.stderr)
        sys.exit(2)
    try:
        level = Level.parse(options.log_level)
        code = execute(lambda: _live(chosen, transport, options.duration, level), clock=options.clock)
    except (StartFailed, SupervisorGaveUp) as error:
        print(error, file=sys.stderr)
        code = 3
    sys.exit(code)


def _own_name() -> str:
    """As it was started: ``python -m robot.tutorials.ring`` or ``ring.py``."""
    module = getattr(sys.modules["__main__"], "__spec__", None)
    return f"python -m {module.name}" if module is not None else os.path.basename(sys.argv[0])


def _options(tree: Callable[[], Supervisor], argv: Sequence[str] | None, name: str) -> argparse.Namespace:
    parser = Parser(prog=name, description=tree.__doc__, epilog="Ctrl-C ends it.")
    parser.add_argument("--clock", choices=("real", "virtual"), default="real", help="virtual: waiting takes no time")
    parser.add_argument("--duration", type=seconds, metavar="SECONDS", help="end after so many seconds")
    parser.add_argument(
        "--log-level",
        type=str.lower,
        choices=LEVELS,
        default="info",
        metavar="LEVEL",
        help=f"{', '.join(LEVELS)} (default info)",
    )
    parser.add_argument(
        "--only", nargs="+", metavar="NODE", help="run just these nodes; others may run in other processes"
    )
    parser.add_argument(
        "--connect", action="append", default=[], metavar="ENDPOINT", help="reach another machine, tcp/HOST:7447"
    )
    parser.add_argument(
        "--listen",
        action="append",
        default=[],
        metavar="ENDPOINT",
        help="let other machines connect to tcp/0.0.0.0:PORT",
    )
    parser.add_argument("--security", metavar="FILE", help="TLS, and who may do what (docs/howto/security.md)")
    options = parser.parse_args(argv)
    if options.clock == "virtual" and options.duration is None and tree().auto_shutdown == never:
        parser.error("--clock virtual needs a --duration here: this tutorial has no end of its own")
    return options


def _chosen(tree: Supervisor, options: argparse.Namespace) -> Supervisor:
    """The tree, or what `--only` leaves of it. It then ends with the jobs that are left; without any, it runs until it is stopped."""
    if not options.only:
        return tree
    try:
        chosen = only(tree, options.only)
    except UnknownNode as error:
        raise UsageError(f"--only: {error}") from None
    jobs = any(child.significant for child in chosen.children)
    return chosen if jobs else chosen.replace(auto_shutdown=never)


def _transport(options: argparse.Namespace) -> Transport | None:
    """The connection with other processes; none on the virtual clock, which they do not share."""
    if options.clock == "virtual":
        return None
    try:
        return transport_from_environment(
            os.environ,
            listen=tuple(options.listen),
            connect=tuple(options.connect),
            security=options.security,
        )
    except WireUnavailable as error:
        raise UsageError(str(error)) from None


async def _live(tree: Supervisor, transport: Transport | None, duration: float | None, level: int) -> int:
    failed: list[LogRecord] = []

    def note(record: LogRecord) -> None:
        if record.fields.get("job") == "failed":
            failed.append(record)

    async with run(tree, sinks=(console_sink(sys.stdout, level), note), level=level, transport=transport) as running:
        ended = asyncio.ensure_future(running.wait())
        try:
            await asyncio.wait([ended], timeout=duration)
            if ended.done():
                ended.result()
        finally:
            ended.cancel()
    return 1 if failed else 0
