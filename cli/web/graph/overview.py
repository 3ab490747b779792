"""What a server knows of the system that it shows: its own, or that of the process which has started it.

A tree whose nodes run in several processes has its supervisors in one of them, and the server in another. There, `TreePublisher` tells what the
supervisors know; here, `Told` puts it together with the graph that the server's own process sees.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final, Protocol

import msgspec
from msgspec import structs

from actors import Node, System, Topic, background, publishes, qos, system_of
from actors.errors import NotStarted
from actors.graph.snapshot import NodeView, Snapshot
from actors.interfaces.std_msgs.msg import String

if TYPE_CHECKING:
    from collections.abc import Callable

    from actors.transport.figures import NodeFigures
    from actors.typing import Stream
    from cli.verbs.doctor.observation import Told as Reports

TOLD_EVERY: Final = 0.5
"""Seconds between two looks at the nodes of a tree."""


class Overview(Protocol):
    """A system, as its page shows it."""

    @property
    def can_kill(self) -> bool:
        """Whether there is a tree, in which nodes that fail are restarted."""
        ...

    figures: Figures

    def snapshot(self) -> Snapshot:
        """Nodes, topics and services."""
        ...

    def restarts(self) -> dict[str, int]:
        """How often each node was restarted, by full name."""
        ...

    def crash(self, node: str, error: Exception) -> None:
        """Make a node fail, as `System.crash` does. Raises `LookupError` and `NotStarted`."""
        ...


class Figures:
    """What the processes of the graph report of their own nodes, while a client looks: a snapshot alone has only their names."""

    def __init__(self) -> None:
        self.source: Callable[[], tuple[Reports, ...]] = tuple
        """Gives the last two reports of each process."""

    def completed(self, seen: Snapshot) -> Snapshot:
        """The snapshot with the states, lives and counters of nodes of other processes, and the messages that their subscriptions took."""
        known = self._nodes()
        took = self._taken(lambda before, last, seconds: float(last))
        nodes = tuple(_completed(node, known[node.name]) if node.name in known else node for node in seen.nodes)
        topics = tuple(
            structs.replace(topic, messages=int(took[topic.name]))
            if not topic.messages and topic.name in took
            else topic
            for topic in seen.topics
        )
        return structs.replace(seen, nodes=nodes, topics=topics)

    def rates(self) -> dict[str, float]:
        """Messages a second, by topic, as the subscriptions of other processes take them."""
        return self._taken(lambda before, last, seconds: max(0, last - before) / seconds if seconds > 0 else 0.0)

    def restarts(self) -> dict[str, int]:
        """How often each node of another process was restarted."""
        return {name: node.restarts for name, node in self._nodes().items()}

    def _nodes(self) -> dict[str, NodeFigures]:
        return {node.name: node for one in self.source() for node in one.last.nodes}

    def _taken(self, measure: Callable[[int, int, float], float]) -> dict[str, float]:
        """The most that a subscription with a handler has taken, by topic."""
        found: dict[str, float] = {}
        for one in self.source():
            earlier = {
                (node.name, queue.topic, queue.handler): queue.received
                for node in one.before.nodes
                for queue in node.queues
            }
            for node in one.last.nodes:
                for queue in node.queues:
                    before = earlier.get((node.name, queue.topic, queue.handler), queue.received)
                    value = measure(before, queue.received, one.seconds)
                    found[queue.topic] = max(found.get(queue.topic, 0.0), value)
        return found


def _completed(node: NodeView, known: NodeFigures) -> NodeView:
    """A node of another process with what that process tells of it."""
    slowest = max(known.handlers, key=lambda one: one.longest, default=None)
    return structs.replace(
        node, state=known.state if node.state == "elsewhere" else node.state, incarnation=node.incarnation or known.incarnation,
        waiting=known.waiting, handled=known.handled, inbox_age=known.inbox_age,
        slowest="" if slowest is None else f"{slowest.handler} {1e3 * slowest.longest:.1f} ms",
    )  # fmt: skip


class Here:
    """The system of this process."""

    def __init__(self, system: System) -> None:
        self._system = system
        self.figures = Figures()

    @property
    def can_kill(self) -> bool:
        return self._system.supervisor is not None

    def snapshot(self) -> Snapshot:
        return self.figures.completed(self._system.snapshot())

    def restarts(self) -> dict[str, int]:
        return self.figures.restarts() | {
            record.identity.fqn: record.restart_count for record in self._system.nodes.values()
        }

    def crash(self, node: str, error: Exception) -> None:
        self._system.crash(node, error)


class _Tree(msgspec.Struct, frozen=True):
    """What supervisors know of their nodes: what changes with a life, and no counters."""

    nodes: tuple[NodeView, ...] = ()
    restarts: dict[str, int] = {}


_TREE: Final = Topic(String, "~/tree", qos.STATE)
_CRASHES: Final = Topic(String, "~/crash")


class TreePublisher(Node):
    """Tells the nodes of its system whenever a life, a state or a place has changed, and makes a node fail when the server asks for it."""

    tree = publishes(_TREE)

    @background
    async def tell(self) -> None:
        here, told = Here(system_of(self)), b""
        while True:
            nodes = tuple(
                structs.replace(node, waiting=0, handled=0, inbox_age=0.0, slowest="")
                for node in here.snapshot().nodes
                if node.path
            )
            text = msgspec.json.encode(_Tree(nodes, here.restarts()))
            if text != told:
                told = text
                self.tree(String(data=text.decode()))
            await self.clock.sleep(TOLD_EVERY)

    @_CRASHES.on()
    def crash(self, name: String) -> None:
        try:
            system_of(self).crash(name.data, RuntimeError("killed on the web page"))
        except (LookupError, NotStarted) as error:  # it has ended since it was told of
            self.log.warning("a node was not killed", node_name=name.data, because=str(error))


class Told:
    """The system that a `TreePublisher` tells of: its tree from there, all else as the process of `node`, the server, sees it."""

    def __init__(self, node: Node, system: System, teller: str) -> None:
        self._system = system
        self._tree = _Tree()
        self.figures = Figures()
        self._crashes = node.publisher(Topic(String, f"/{teller}/crash"))
        node.create_task(self._listen(node.subscribe(Topic(String, f"/{teller}/tree", qos.STATE))), name="web tree")

    @property
    def can_kill(self) -> bool:
        return bool(self._tree.nodes)

    def snapshot(self) -> Snapshot:
        seen = self._system.snapshot()
        nodes = {node.name: node for node in seen.nodes}
        nodes |= {node.name: node for node in self._tree.nodes}
        return self.figures.completed(structs.replace(seen, nodes=tuple(nodes[name] for name in sorted(nodes))))

    def restarts(self) -> dict[str, int]:
        return self.figures.restarts() | self._tree.restarts

    def crash(self, node: str, error: Exception) -> None:
        found = next((one for one in self._tree.nodes if one.name == node), None)
        if found is None:
            raise LookupError(f"there is no node {node}")
        if found.state != "running":
            raise NotStarted(f"{node} is not running: it cannot crash now")
        self._crashes(String(data=node))

    async def _listen(self, trees: Stream[String]) -> None:
        async for message in trees:
            self._tree = msgspec.json.decode(message.data, type=_Tree)
