"""Actions of this process on the network, and those of other processes.

An action consists of three services and two topics. Goals, results and cancel requests that come from other processes are handed to the action's
server here, so that the reasons that ROS 2 has no field for reach the clients that can read them. Status and feedback are ordinary topics.
"""

from __future__ import annotations

import asyncio
from typing import TYPE_CHECKING, Any, Final, NamedTuple, cast

from actors.actions.goals import NO_GOAL_ID, CancelCode, GoalStatus
from actors.actions.peers import Outcome
from actors.checks import create
from actors.errors import Reject
from actors.interfaces import derived
from actors.interfaces.action_msgs.msg import GoalInfo, GoalStatusArray
from actors.interfaces.action_msgs.srv import CancelGoal
from actors.interfaces.cdr import decode
from actors.interfaces.errors import CdrError
from actors.qos import ACTION_FEEDBACK, ACTION_STATUS, SERVICES
from actors.time.values import nanoseconds_of, stamp_of
from actors.transport.remote_actions import RemoteActionServer

if TYPE_CHECKING:
    from actors.actions.server import ActionServer
    from actors.graph.servers import S, ServerEntry
    from actors.transport.format.extensions import Waiting
    from actors.transport.local_clients import Clients
    from actors.transport.local_services import Asked, Services, Shown
    from actors.transport.local_side import LocalSide
    from actors.transport.local_topics import Topics
    from actors.transport.protocol import RemoteEndpoint, RemoteNode

ACTION: Final = "/_action/"
PARTS: Final = ("send_goal", "get_result", "cancel_goal")
_UNKNOWN: Final = create(Outcome, GoalStatus.UNKNOWN)


class _Followed:
    """A goal of another process. The requests for its result are answered when it ends, also if its node ends then.

    Invariant: `waiting` is empty once the goal has ended, or was not accepted.
    """

    def __init__(self, actions: Actions, goal_id: bytes, owner: str, chain: tuple[Waiting, ...]) -> None:
        self.owner = owner
        self.chain = chain
        """The nodes that wait for its acceptance."""
        self._actions = actions
        self._goal_id = goal_id
        self.waiting: list[tuple[Shown, Asked]] = []

    def on_status(self, status: GoalStatus) -> None:
        """Do nothing: the topic of the action carries it."""

    def on_feedback(self, feedback: object) -> None:
        """Do nothing: the topic of the action carries it."""

    def on_result(self, outcome: Outcome) -> None:
        self._actions.ended(self._goal_id)
        waiting, self.waiting = self.waiting, []
        for shown, asked in waiting:
            _answer_result(shown, asked, outcome)


class _Parts(NamedTuple):
    """The services of one action in one node of another process, as far as they are known, by the last part of their names."""

    node: RemoteNode
    endpoints: dict[str, RemoteEndpoint]


class Actions:
    """The actions of one system on the network.

    Invariants:

    * `_followed` holds the goals of other processes that have been requested and have not been rejected or ended.
    * An action of another process stands in the graph as long as its three services are known.
    """

    def __init__(self, side: LocalSide, topics: Topics, services: Services, clients: Clients) -> None:
        self._side = side
        self._topics = topics
        self._services = services
        self._clients = clients
        self._graph = side.runtime.graph
        self._followed: dict[bytes, _Followed] = {}
        self._canceling = 0
        """How many requests to cancel a goal have not been answered."""
        self._parts: dict[tuple[str, int, str], _Parts] = {}
        self._remote: dict[tuple[str, int, str], RemoteActionServer] = {}

    # -- actions of this process --------------------------------------------------------------------------------------------

    def server_changed(self, entry: ServerEntry[S]) -> None:
        """Show an action, until its node has ended for good. Raises WireFormatError."""
        server = cast("ActionServer | None", entry.local)
        if server is None:
            return
        node, prefix, kind = server.host, entry.name + ACTION, server.type
        services, topics = self._services, self._topics
        services.promise(node, prefix + "send_goal", derived.send_goal_service(kind), SERVICES, self._send_goal)
        services.promise(node, prefix + "get_result", derived.get_result_service(kind), SERVICES, self._get_result)
        services.promise(node, prefix + "cancel_goal", CancelGoal, SERVICES, self._cancel_goal)
        topics.promise(node, prefix + "status", GoalStatusArray, ACTION_STATUS)
        topics.promise(node, prefix + "feedback", derived.feedback_message(kind), ACTION_FEEDBACK)
        services.beside(entry)

    def _taken(self, shown: Shown, name: str, asked: Asked) -> tuple[ActionServer, Any] | None:
        """The server and the request; None if it has been answered with an error."""
        server = cast("ActionServer | None", self._graph.action(name.rpartition(ACTION)[0]).local)
        if server is None:
            asked.fail(shown.node, self._services.absent(shown.node, name))
            return None
        try:
            return server, decode(shown.type.Request, asked.payload)
        except CdrError as error:
            self._side.unreadable.note("a request cannot be decoded", name, error, service=name)
            asked.fail(shown.node, error)
            return None

    def _send_goal(self, shown: Shown, name: str, asked: Asked) -> None:
        if (taken := self._taken(shown, name, asked)) is None:
            return
        server, request = taken
        goal_id = request.goal_id.uuid.tobytes()
        chain = tuple(asked.extension.chain)
        if self._services.refused(shown, name, asked, len(self._followed)):
            return
        cycle = self._clients.cycles.refusal(server.node, chain)
        if cycle is not None:
            asked.fail(shown.node, cycle)
            return
        followed = _Followed(self, goal_id, self._services.caller_of(asked.gid), chain)
        known = self._followed.setdefault(goal_id, followed)

        def respond(future: asyncio.Future[int]) -> None:
            error = future.exception()
            if error is not None and known is followed:
                followed.on_result(_UNKNOWN)
            if error is None:
                asked.reply(shown.node, shown.type.Response(accepted=True, stamp=stamp_of(future.result())))
            elif isinstance(error, Reject):
                asked.reply(shown.node, shown.type.Response(accepted=False), error.reason)
            else:
                asked.fail(shown.node, error)

        server.submit(goal_id, request.goal, followed).future.add_done_callback(respond)

    def _get_result(self, shown: Shown, name: str, asked: Asked) -> None:
        if (taken := self._taken(shown, name, asked)) is None:
            return
        server, request = taken
        goal_id = request.goal_id.uuid.tobytes()
        goal, followed = server.table.get(goal_id), self._followed.get(goal_id)
        if followed is not None:  # it runs, or its acceptance is being decided: our clients ask for both at once
            if not self._services.refused(shown, name, asked, len(followed.waiting)):
                followed.waiting.append((shown, asked))
        elif goal is None:
            _answer_result(shown, asked, _UNKNOWN)
        elif goal.status.is_terminal:
            _answer_result(shown, asked, create(Outcome, goal.status, goal.result, goal.reason))
        else:  # a goal of this process
            self._services.answer(shown, name, asked)

    def _cancel_goal(self, shown: Shown, name: str, asked: Asked) -> None:
        if (taken := self._taken(shown, name, asked)) is None:
            return
        server, request = taken
        info, reason = request.goal_info, asked.extension.reason
        goal_id = info.goal_id.uuid.tobytes()
        if not reason or goal_id == NO_GOAL_ID or nanoseconds_of(info.stamp):
            self._services.answer(
                shown, name, asked
            )  # one of the forms of ROS 2 for several goals, or a client of ROS 2
            return

        if self._services.refused(shown, name, asked, self._canceling):
            return
        self._canceling += 1

        def respond(future: asyncio.Future[bool]) -> None:
            self._canceling -= 1
            agreed = future.result()
            code = CancelCode.NONE if agreed else CancelCode.REJECTED
            goals = (GoalInfo(goal_id=info.goal_id),) if agreed else ()
            asked.reply(shown.node, CancelGoal.Response(return_code=int(code), goals_canceling=goals))

        asyncio.ensure_future(server.cancel(goal_id, reason)).add_done_callback(respond)

    def ended(self, goal_id: bytes) -> None:
        """Forget a goal that has ended or was not accepted."""
        self._followed.pop(goal_id, None)

    def forget(self, node: str) -> None:
        """Withdraw what a node of this process, which has ended for good, has shown as a client of actions."""
        for server in self._remote.values():
            server.forget(node)

    # -- actions of other processes -----------------------------------------------------------------------------------------

    def appeared(self, endpoint: RemoteEndpoint) -> None:
        """Take in a service of another process, which may be part of an action."""
        action, found, part = endpoint.name.rpartition(ACTION)
        if not found or part not in PARTS:
            return
        node = endpoint.node
        key = *node.identity, action
        parts = self._parts.setdefault(key, _Parts(node, {}))
        parts.endpoints[part] = endpoint
        if len(parts.endpoints) == len(PARTS) and key not in self._remote:
            entry = self._graph.action(action)
            server = self._remote[key] = RemoteActionServer(self._side, self._clients, node, action, parts.endpoints)
            entry.add_remote(server)
            self._services.beside(entry)

    def vanished(self, endpoint: RemoteEndpoint) -> None:
        """Undo `appeared`."""
        action, _, part = endpoint.name.rpartition(ACTION)
        key = *endpoint.node.identity, action
        parts = self._parts.get(key)
        if parts is None or parts.endpoints.pop(part, None) is None:
            return
        if not parts.endpoints:
            del self._parts[key]
        server = self._remote.pop(key, None)
        if server is not None:
            server.gone = True
            entry = self._graph.action(action)
            entry.remove_remote(server, server.host)
            entry.forget(server.host)
            server.close()


def _answer_result(shown: Shown, asked: Asked, outcome: Outcome) -> None:
    response, status = shown.type.Response, int(outcome.status)
    answer = response(status=status) if outcome.result is None else response(status=status, result=outcome.result)
    asked.reply(shown.node, answer, outcome.reason)
