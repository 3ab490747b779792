"""`LaunchService`: runs launch descriptions from a program, as `launch.LaunchService` of ROS 2 does."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterable

from actors.launch.actions.events import EmitEvent, Shutdown
from actors.launch.context import LaunchContext
from actors.launch.entity import LaunchDescriptionEntity, evaluate
from actors.launch.errors import LaunchError
from actors.launch.launching import launch_tree
from actors.launch.packages_api import context_here
from actors.launch.plan import Scope
from actors.launch.requests import Requests
from actors.launch.shim import shim
from actors.logs import DEBUG, INFO, console_sink
from actors.running.run import execute, run
from actors.supervision.errors import SupervisorGaveUp
from actors.transport import transport_from_environment


class LaunchService:
    """Runs launch descriptions. What is included before `run` is evaluated as a whole before anything starts.

    `argv` are ``name:=value`` words, the launch arguments; other words are left alone. With `debug` the log shows debug lines.
    `include_launch_description`, `emit_event` and `shutdown` may be called from any thread, before and while it runs; later they do
    nothing. A service runs once.

    Invariants: `_descriptions` grows until the launch begins; what comes later goes to `_requests`.
    """

    def __init__(self, *, argv: Iterable[str] | None = None, noninteractive: bool = False, debug: bool = False) -> None:
        words = list(argv or ())
        pairs = (word.partition(":=") for word in words)
        outer = context_here()
        self.context = LaunchContext(
            outer.packages,
            arguments={name: value for name, separator, value in pairs if separator},
            argv=words,
            stand_ins=outer.stand_ins,
        )
        """What is set for what is included."""
        self._level = DEBUG if debug else INFO
        self._descriptions: list[LaunchDescriptionEntity] = []
        self._requests = Requests()
        self._begun = False

    def include_launch_description(self, launch_description: LaunchDescriptionEntity) -> None:
        """Add a description to what runs."""
        if self._begun:
            self._requests.add([launch_description], self.context)
        else:
            self._descriptions.append(launch_description)

    def emit_event(self, event: object) -> None:
        """Emit an event. Before the launch runs it waits for that."""
        self._requests.add([EmitEvent(event=event)], self.context)

    def shutdown(self, force_sync: bool = False) -> None:
        """End the launch, as Ctrl-C would."""
        self._requests.add([Shutdown(reason="LaunchService.shutdown() called")], self.context)

    def run(self, *, shutdown_when_idle: bool = True) -> int:
        """Run until nothing is left to do, or until the launch is shut down: 0 in order, 1 after an error of the launch, 130 Ctrl-C.

        With ``shutdown_when_idle=False`` it runs until it is shut down.
        """

        async def main() -> int:
            return await self.run_async(shutdown_when_idle=shutdown_when_idle)

        return execute(main)

    async def run_async(self, *, shutdown_when_idle: bool = True) -> int:
        """`run` in an event loop that runs already."""
        if self._begun:
            raise RuntimeError("this LaunchService has run: make another one")
        self._begun = True
        self._requests.stay = not shutdown_when_idle
        plan = Scope("included", "launch")
        try:
            with shim(self.context):
                evaluate(self._descriptions, self.context, plan)
            tree = launch_tree(plan, _write, lambda: None, self._requests)
            sinks = (console_sink(sys.stdout, self._level),)
            transport = transport_from_environment(os.environ)
            async with run(tree, sinks=sinks, level=self._level, transport=transport) as system:
                await system.wait()
        except (LaunchError, SupervisorGaveUp) as error:
            print(f"error: {error}", file=sys.stderr)
            return 1
        return system.exit_code


def _write(line: str) -> None:
    print(line, flush=True)
