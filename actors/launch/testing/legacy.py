"""`LaunchTestService`: test processes in a launch that a program starts itself, as `launch_testing.legacy` has it."""

from __future__ import annotations

from collections.abc import Collection
from typing import Any

from actors.launch.actions.events import EmitEvent, RegisterEventHandler
from actors.launch.actions.processes import ExecuteProcess
from actors.launch.context import LaunchContext
from actors.launch.entity import LaunchDescription, LaunchDescriptionEntity
from actors.launch.events import ExecutionComplete, ProcessExited, Shutdown
from actors.launch.handlers import OnExecutionComplete, OnProcessExit
from actors.launch.service import LaunchService


class LaunchTestService:
    """Ends a launch when all of its test actions have ended, when one of them fails, or when a fixture process dies."""

    def __init__(self) -> None:
        self._left: set[LaunchDescriptionEntity] = set()
        self._codes: list[int] = []

    def add_fixture_action(
        self, launch_description: LaunchDescription, action: Any, exit_allowed: Collection[int] | bool = (0,)
    ) -> object:
        """Add an action that the tests need. `exit_allowed` are the exit codes with which its process may end; True: any, False: none."""

        def ended(event: ProcessExited, context: LaunchContext) -> EmitEvent | None:
            allowed = exit_allowed if isinstance(exit_allowed, bool) else event.returncode in exit_allowed
            if context.is_shutdown or allowed:
                return None
            self._codes.append(event.returncode or 1)
            return EmitEvent(event=Shutdown(reason=f"{event.process_name} fixture process died!"))

        launch_description.add_action(action)
        if isinstance(action, ExecuteProcess):
            launch_description.add_action(RegisterEventHandler(OnProcessExit(target_action=action, on_exit=ended)))
        return action

    def add_test_action(self, launch_description: LaunchDescription, action: Any) -> object:
        """Add an action that is a test. A process passes with exit code 0."""
        self._left.add(action)

        def ended(event: ProcessExited | ExecutionComplete, context: LaunchContext) -> EmitEvent | None:
            self._left.discard(action)
            if isinstance(event, ProcessExited) and event.returncode:
                self._codes.append(event.returncode)
                return EmitEvent(event=Shutdown(reason=f"{event.process_name} test failed!"))
            return None if self._left else EmitEvent(event=Shutdown(reason="all tests finished"))

        if isinstance(action, ExecuteProcess):
            launch_description.add_action(RegisterEventHandler(OnProcessExit(target_action=action, on_exit=ended)))
        else:
            handler = OnExecutionComplete(target_action=action, on_completion=ended)
            launch_description.add_action(RegisterEventHandler(handler))
        launch_description.add_action(action)
        return action

    def run(self, launch_service: LaunchService, **options: Any) -> int:
        """Run the launch. Returns its code or, if that is 0, that of the first test or fixture that failed."""
        return launch_service.run(**options) or next(iter(self._codes), 0)
