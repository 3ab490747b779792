"""What a launch description comes to: a tree of scopes, and in them what is to be started, in order. Nothing in it runs."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Protocol, TypeAlias

if TYPE_CHECKING:
    from actors.launch.context import LaunchContext
    from actors.launch.entity import LaunchDescriptionEntity
    from actors.launch.errors import Line
    from actors.launch.packages import Executable
    from actors.launch.parameters import Layer


@dataclass(eq=False)
class Scope:
    """A launch file or a group: a supervisor of its own, below which its parts are started in order."""

    name: str
    title: str
    items: list[Item] = field(default_factory=list["Item"])

    def inner(self, name: str, title: str) -> Scope:
        """Add a scope in this one. Its name is made unique among its siblings."""
        taken = {item.name for item in self.items if isinstance(item, Scope)}
        unique, number = name, 1
        while unique in taken:
            number += 1
            unique = f"{name}_{number}"
        scope = Scope(unique, title)
        self.items.append(scope)
        return scope


@dataclass(frozen=True, eq=False)
class NodeSpec:
    """What `launch_ros` says about an executable: its package, its names, its parameters, the topics that it uses under other names."""

    package: str
    executable: str
    name: str | None
    namespace: str
    """Absolute; empty if none is set."""
    layers: Sequence[Layer]
    remaps: Sequence[tuple[str, str]]
    arguments: Sequence[str]
    ros_arguments: Sequence[str]
    found: Executable | None
    """Where it is; None if it is not here."""
    problem: str = ""
    """Why it is not here."""
    container: bool = False
    """Whether it is a container of components."""
    autostart: bool = False
    """Whether it is a lifecycle node that is brought to active when it has started."""


@dataclass(frozen=True, eq=False)
class Process:
    """How a program is run as a process."""

    cmd: Sequence[str]
    environment: Mapping[str, str]
    cwd: str | None = None
    shell: bool = False
    output: str = "log"
    emulate_tty: bool = False
    """Whether its output is a terminal to it."""
    log_cmd: bool = False
    """Whether its command is told when it starts."""
    sigterm_timeout: float = 5.0
    sigkill_timeout: float = 5.0


class Starter(Protocol):
    """An action that starts an executable."""

    process_details: Mapping[str, object] | None
    """Name, command, folder, environment and process id of what it has started; None before that."""


@dataclass(eq=False)
class Job:
    """One executable: a node of this framework, or a process. Its nodes live and die together, under a supervisor of its own.

    `action` is the action that it was made of, by which event handlers know it; `on_exit` what is done when it has ended.
    """

    label: str
    action: Starter
    node: NodeSpec | None
    process: Process | None
    respawn: bool
    respawn_delay: float
    respawn_max_retries: int
    required: bool
    """Whether its end ends the launch."""
    on_exit: object
    context: LaunchContext
    line: Line | None


@dataclass(frozen=True, eq=False)
class Component:
    """A node that is loaded into a container."""

    package: str
    plugin: str
    name: str | None
    namespace: str
    layers: Sequence[Layer]
    remaps: Sequence[tuple[str, str]]
    extra: Mapping[str, object]
    autostart: bool
    line: Line | None


@dataclass(frozen=True, eq=False)
class Load:
    """Components to load into the container of this full name, one after another."""

    container: str
    components: Sequence[Component]
    line: Line | None


@dataclass(frozen=True, eq=False)
class Deferred:
    """Entities that are evaluated later, in the context in which they were met."""

    entities: Sequence[LaunchDescriptionEntity]
    context: LaunchContext


@dataclass(frozen=True, eq=False)
class Timer:
    """What is done `period` seconds after it was started."""

    period: float
    then: Deferred
    action: object
    line: Line | None


@dataclass(frozen=True, eq=False)
class Handler:
    """An event handler, from the moment on at which it is registered."""

    handler: Any
    context: LaunchContext
    line: Line | None


@dataclass(frozen=True, eq=False)
class Unregister:
    """The end of an event handler."""

    handler: Any


@dataclass(frozen=True, eq=False)
class Message:
    """A line of the log."""

    text: str
    level: str


@dataclass(frozen=True, eq=False)
class Signal:
    """An event that is emitted: a shutdown, a lifecycle transition, one of the user's."""

    event: object
    context: LaunchContext


@dataclass(frozen=True, eq=False)
class Transitions:
    """Lifecycle transitions, by their ids, through which each of the nodes is taken in order."""

    nodes: Sequence[str]
    ids: Sequence[int]


@dataclass(frozen=True, eq=False)
class Missing:
    """A part that could not be evaluated, in a lenient evaluation."""

    what: str
    why: str


Item: TypeAlias = Scope | Job | Load | Timer | Handler | Unregister | Message | Signal | Transitions | Missing


def jobs(scope: Scope) -> Iterator[Job]:
    """All jobs of a scope and of those in it, in order."""
    for item in scope.items:
        if isinstance(item, Scope):
            yield from jobs(item)
        elif isinstance(item, Job):
            yield item
