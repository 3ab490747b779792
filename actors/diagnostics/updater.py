"""`Updater`: publishes the state of a node, task by task, at a period that a parameter gives."""

from __future__ import annotations

from typing import Any, Final

from actors.diagnostics.status import DIAGNOSTICS, Status, Task
from actors.errors import described
from actors.interfaces.diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from actors.interfaces.std_msgs.msg import Header
from actors.parameters.descriptor import ParameterDescriptor
from actors.runtime.node import Node
from actors.suggest import did_you_mean

PERIOD: Final = "diagnostic_updater.period"
FQN: Final = "diagnostic_updater.use_fqn"


class Updater:
    """The diagnostics of `node`, which has started: make it in `on_start`. It runs its tasks until the node ends.

    Every `period` seconds each task fills in a status ``<node>: <task>``, and all of them are published on ``/diagnostics``. The parameter
    ``diagnostic_updater.period`` of the node holds the period, and ``diagnostic_updater.use_fqn`` says whether the full name of the node
    stands before that of the task. A task that raises has the level ERROR, with the error as its message.
    """

    def __init__(self, node: Node, *, hardware_id: str = "none", period: float = 1.0) -> None:
        self.hardware_id = hardware_id
        self._node = node
        self._tasks: dict[str, Task] = {}
        self._publisher = node.publisher(DIAGNOSTICS)
        period = _parameter(node, PERIOD, period, "Seconds between two updates of the diagnostics")
        self._prefix = (
            node.fqn if _parameter(node, FQN, False, "Whether diagnostics name the node in full") else node.name
        )
        self._timer = node.create_timer(period, self.force_update)

    def __repr__(self) -> str:
        return f"<diagnostics of {self._node.fqn}: {', '.join(self._tasks) or 'no tasks'}>"

    @property
    def period(self) -> float:
        """Seconds between two updates. It may be assigned."""
        return self._timer.period

    @period.setter
    def period(self, seconds: float) -> None:
        self._timer.period = seconds

    def add(self, name: str, task: Task) -> None:
        """Run `task` in every update from now on. As in ROS 2, a first status says at once that the node starts up."""
        self._tasks[name] = task
        status = self._status(name)
        status.ok("Node starting up")
        self._publish([status])

    def remove(self, name: str) -> None:
        """Run a task no more. Raises `LookupError` with the nearest name if there is none of this name."""
        if name not in self._tasks:
            raise LookupError(f"{self!r} has no task {name!r}{did_you_mean(name, self._tasks)}")
        del self._tasks[name]

    def broadcast(self, level: int, message: str) -> None:
        """Publish this level and message for every task, once."""
        statuses = [self._status(name) for name in self._tasks]
        for status in statuses:
            status.summary(level, message)
        self._publish(statuses)

    def force_update(self) -> None:
        """Run all tasks and publish what they say, now."""
        self._publish([self._ran(name, task) for name, task in self._tasks.items()])

    def _ran(self, name: str, task: Task) -> Status:
        status = self._status(name)
        try:
            task(status)
        except Exception as error:
            status.summary(DiagnosticStatus.ERROR, f"the task raised {described(error)}")
        return status

    def _status(self, name: str) -> Status:
        return Status(f"{self._prefix}: {name}", self.hardware_id)

    def _publish(self, statuses: list[Status]) -> None:
        if statuses:
            stamp = self._node.clock.stamp()
            self._publisher(DiagnosticArray(header=Header(stamp=stamp), status=[one.to_msg() for one in statuses]))


def _parameter(node: Node, name: str, value: object, description: str) -> Any:
    """The value of a parameter, declared if it is not yet."""
    if not node.has_parameter(name):
        node.declare_parameter(name, value, ParameterDescriptor(description=description, read_only=True))
    return node.get_parameter(name).value
