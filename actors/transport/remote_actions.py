"""Action servers of other processes, as they stand in the graph of this one, and the goals that are sent to them."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Mapping
from typing import Any, Final

from actors.actions.goals import GoalStatus
from actors.actions.peers import GoalFollower, Outcome
from actors.checks import create
from actors.errors import ActionUnavailable, Reject, ServiceFailed
from actors.interfaces import derived, registry
from actors.interfaces.action_msgs.msg import GoalInfo, GoalStatusArray
from actors.interfaces.action_msgs.srv import CancelGoal
from actors.interfaces.cdr import decode, encode
from actors.interfaces.errors import CdrError
from actors.interfaces.foreign import ForeignType
from actors.interfaces.hashes import type_hash
from actors.interfaces.message import Message
from actors.interfaces.unique_identifier_msgs.msg import UUID
from actors.qos import ACTION_FEEDBACK, ACTION_STATUS
from actors.qos.policies import QoS
from actors.services.peers import Caller
from actors.time.values import nanoseconds_of
from actors.transport.format.errors import WireFormatError
from actors.transport.format.extensions import Extension, parse_extension
from actors.transport.format.names import is_ours
from actors.transport.local_clients import Clients
from actors.transport.local_side import LocalSide, type_info
from actors.transport.protocol import Answer, EndpointHere, Handle, NoAnswer, RemoteEndpoint, RemoteNode, Replied, Take
from actors.transport.remote_services import failure_of

_FORGOTTEN: Final = 3600.0
"""Seconds after which the transport may forget a request about a goal. That for the result is sent again then: goals have no limit of time."""
_LONG: Final = 1000
"""Bytes of a long list of goals."""
_FIRST: Final = 8
_BEFORE: Final = 5
_ENTRY: Final = 28
"""A list of goals in CDR. The entry of number i ends at byte `_BEFORE` + (i + 1) * `_ENTRY`. Its last byte is the status; its first 16 are the goal's id,
which begin where the entry before ends, and at `_FIRST` in the first one."""


class RemoteActionServer:
    """A server of an action in another process.

    Invariants:

    * `_goals` holds the goals that have been sent there and have neither been rejected nor ended.
    * Each node that has sent a goal subscribes to its status and feedback. They share what arrives.
    """

    node = None

    def __init__(
        self, side: LocalSide, clients: Clients, node: RemoteNode, name: str, endpoints: Mapping[str, RemoteEndpoint]
    ) -> None:
        self.name = name
        self.goals = 0
        self._side = side
        self._clients = clients
        self._node = node
        self._endpoints = dict(endpoints)
        self._goals: dict[bytes, RemoteGoal] = {}
        self._shown: dict[str, list[EndpointHere]] = {}
        self._takes: dict[str, Take] = {}
        """What takes status and feedback, for all nodes."""
        self._known: Any = None
        self._services: tuple[Any, Any] = (None, None)
        self.asks_early = is_ours(node.session)
        """Whether the result of a goal is asked for together with its acceptance: a server of ROS 2 knows of no goal before it has accepted it."""
        self.gone = False

    def __repr__(self) -> str:
        return f"<server of {self.name} in {self.host}, elsewhere: {len(self._goals)} goals>"

    @property
    def host(self) -> str:
        return self._node.fqn

    @property
    def identity(self) -> tuple[str, int]:
        """What distinguishes its node from all others."""
        return self._node.identity

    @property
    def type(self) -> Any:
        """The action type. Endpoints give the types of its parts only, so one with another hash is named by that of its goals."""
        goals = self._endpoints["send_goal"]
        name = goals.type.removesuffix("_SendGoal")
        known = registry.known(name)
        if known is not None and known is self._known:
            return known
        if known is not None and type_hash(service := derived.send_goal_service(known)) == goals.type_hash:
            self._known, self._services = known, (service, derived.get_result_service(known))
            return known
        return ForeignType(name, f"{goals.type_hash} of {goals.type}")

    @property
    def active(self) -> int:
        return len(self._goals)

    def unanswered(self, seconds: float) -> str:
        return f"{self.host}, which serves {self.name}, neither accepted nor rejected the goal within {seconds:g} s: give the goal more time"

    def submit(self, goal_id: bytes, message: Message, client: GoalFollower | None) -> RemoteGoal:
        """Send a goal. Raises CdrError for one that cannot be encoded."""
        assert client is not None, "only the standard services of this process send goals without a client"
        assert self.type is self._known, "the client has compared it with the type of the goal"
        service, result = self._services
        identity = UUID(uuid=goal_id)
        payload = encode(service.Request(goal_id=identity, goal=message))
        goal = RemoteGoal(self, goal_id, client, service.Response, result.Response)
        asking = encode(result.Request(goal_id=identity))
        goal.ask_result = lambda: self._ask("get_result", goal.owner, asking, goal.ended)
        self.goals += 1
        self._goals[goal_id] = goal
        self._clients.hold(client.owner)
        self._follow(client.owner)
        caller = self._clients.cycles.find(client.owner)
        extension = None if caller is None else self._clients.cycles.extension_of(caller)
        self._ask("send_goal", client.owner, payload, goal.considered, extension)
        if self.asks_early:
            goal.asked = goal.ask_result()
        return goal

    def suspect(self, caller: Caller, node: Caller) -> None:
        """See `actors.services.peers.Elsewhere`."""
        self._clients.cycles.suspect(caller, node)

    def cancel(self, goal_id: bytes, reason: str) -> asyncio.Future[bool]:
        answer: asyncio.Future[bool] = asyncio.get_running_loop().create_future()
        goal = self._goals.get(goal_id)
        if goal is None:
            answer.set_result(False)
            return answer

        def done(replied: Answer) -> None:
            response = _decoded(CancelGoal.Response, replied)
            if not answer.done():
                answer.set_result(response is not None and len(response.goals_canceling) > 0)

        request = CancelGoal.Request(goal_info=GoalInfo(goal_id=UUID(uuid=goal_id)))
        self._ask("cancel_goal", goal.owner, encode(request), done, Extension(reason=reason))
        return answer

    def _ask(
        self, part: str, node: str, payload: bytes, done: Callable[[Answer], None], extension: Extension | None = None
    ) -> Handle:
        return self._clients.of(node, self._endpoints[part]).ask(payload, done, extension, _FORGOTTEN)

    def is_running(self, node: str) -> bool:
        """Whether a node of this process, which has sent a goal, is running."""
        return self._clients.cycles.find(node) is not None

    def decided(self, goal: RemoteGoal) -> None:
        """A goal was accepted, or not, and nothing is left to be asked for a client that has given up."""
        self._clients.release(goal.owner)

    def over(self, goal_id: bytes) -> None:
        """Forget a goal that was not accepted, or has ended."""
        self._goals.pop(goal_id, None)

    def forget(self, node: str) -> None:
        """Withdraw the subscriptions of a node of this process."""
        for endpoint in self._shown.pop(node, ()):
            endpoint.close()

    def close(self) -> None:
        """Unsubscribe, because the server has gone. The questions about its goals are ended by the transport."""
        for node in list(self._shown):
            self.forget(node)

    def _follow(self, node: str) -> None:
        if node in self._shown:
            return
        message = derived.feedback_message(self.type)
        topics: tuple[tuple[str, object, QoS, Callable[[Any], None]], ...] = (
            ("status", GoalStatusArray, ACTION_STATUS, self._status),
            ("feedback", message, ACTION_FEEDBACK, self._feedback),
        )
        participant, of_node = self._side.participant, self._side.node(node)
        shown: list[EndpointHere] = []
        self._shown[node] = shown
        for part, type, qos, take in topics:
            name = f"{self.name}/_action/{part}"
            taking = self._takes.setdefault(part, self._decoding(name, type, take))
            shown.append(participant.subscription(of_node, name, type_info(type), qos, taking, node))

    def _decoding(self, name: str, kind: Any, take: Callable[[Any], None]) -> Take:
        def arrived(takers: object, gid: bytes, number: int, sent: int, payload: bytes, since: float | None) -> None:
            if kind is GoalStatusArray and len(payload) > _LONG and self._long_status(payload):
                return
            try:
                message = decode(kind, payload)
            except CdrError as error:  # of another publisher of this name: the server's own messages have its types
                self._side.unreadable.note("a message cannot be decoded", name, error, topic=name)
                return
            take(message)

        return arrived

    def _long_status(self, payload: bytes) -> bool:
        """Take the status of each own goal out of a long list, which is mostly about the ended goals of everybody. False if it is not as usual.

        To decode a thousand entries takes as long as ten goals.
        """
        count = int.from_bytes(payload[4:8], "little")
        if not payload.startswith(b"\x00\x01") or len(payload) < _BEFORE + count * _ENTRY:
            return False
        for goal_id, goal in tuple(self._goals.items()):
            at = payload.rfind(goal_id, _FIRST)  # the newest are the last
            if at >= 0:
                index, beside = divmod(at - _BEFORE, _ENTRY)
                if index >= count or beside != (0 if index else _FIRST - _BEFORE):
                    return False
                goal.status_is(_status_of(payload[_BEFORE + index * _ENTRY + _ENTRY - 1]))
        return True

    def _status(self, message: GoalStatusArray) -> None:
        for told in message.status_list:
            goal = self._goals.get(told.goal_info.goal_id.uuid.tobytes())
            if goal is not None:
                goal.status_is(_status_of(told.status))

    def _feedback(self, message: Any) -> None:
        goal = self._goals.get(message.goal_id.uuid.tobytes())
        if goal is not None:
            goal.client.on_feedback(message.feedback)


def _decoded(kind: type[Any], answer: Answer) -> Any:
    """The response in an answer; None if there is none, or if it cannot be read."""
    try:
        return decode(kind, answer.payload) if isinstance(answer, Replied) else None
    except CdrError:
        return None


def _status_of(number: int) -> GoalStatus:
    """A status of ROS 2; UNKNOWN for a number that is none."""
    return GoalStatus(number) if 0 <= number <= GoalStatus.ABORTED else GoalStatus.UNKNOWN


class RemoteGoal:
    """A goal that has been sent to a server of another process.

    Invariants: `future` is completed once, when the goal is accepted or not, unless the client cancels it before. A goal that is accepted after
    that is canceled. The client is told of the end of an accepted goal in every case, and of nothing of another one. `asked` is the question
    for the result, if it was asked before the acceptance; its answer waits in `_answer` for that.
    """

    ask_result: Callable[[], Handle]

    def __init__(
        self,
        server: RemoteActionServer,
        goal_id: bytes,
        client: GoalFollower,
        acceptance: type[object],
        result: type[object],
    ) -> None:
        self.server = server
        self.client = client
        self.future: asyncio.Future[int] = asyncio.get_running_loop().create_future()
        self.owner = client.owner
        self.asked: Handle | None = None
        self._answer: Answer | None = None
        self._accepted = False
        self._goal_id = goal_id
        self._acceptance = acceptance
        self._result = result
        self._status = GoalStatus.UNKNOWN
        self._told = GoalStatus.UNKNOWN
        """The last status that the server has published."""

    @property
    def answered(self) -> bool:
        return self.future.done()

    def considered(self, answer: Answer) -> None:
        """Take the answer to the request."""
        server, response = self.server, _decoded(self._acceptance, answer)
        if response is None:
            if isinstance(answer, Replied):
                failure: Exception = ServiceFailed(server.host, "CdrError", "its answer to the goal cannot be read")
            else:
                failure = failure_of(server, answer) or ActionUnavailable(server.unanswered(_FORGOTTEN))
            self._not_accepted(failure)
        elif not response.accepted:
            self._not_accepted(Reject(_reason_in(answer)))
        elif self.future.done():
            canceling = server.cancel(self._goal_id, "its client was canceled")
            canceling.add_done_callback(lambda _: server.decided(self))
            self._give_up()
        else:
            server.decided(self)
            self._accepted = True
            self.status_is(GoalStatus.ACCEPTED)
            self.future.set_result(nanoseconds_of(response.stamp))
            if self.asked is None:
                self.ask_result()
            elif self._answer is not None:
                self._end(self._answer)

    def _not_accepted(self, error: Exception) -> None:
        self.server.decided(self)
        self._give_up()
        if not self.future.done():
            self.future.set_exception(error)

    def _give_up(self) -> None:
        self.server.over(self._goal_id)
        if self.asked is not None:
            self.asked.close()

    def status_is(self, status: GoalStatus) -> None:
        """Tell the client of a status that follows the present one. The end is told with the result."""
        self._told = max(self._told, status)
        if self._status < status < GoalStatus.SUCCEEDED:
            self._status = status
            self.client.on_status(status)

    def ended(self, answer: Answer) -> None:
        """Take the answer to the question for the result."""
        if answer == NoAnswer(timed_out=True) and not self.server.is_running(self.owner):
            self.server.over(self._goal_id)  # to ask again would show the node again
        elif answer == NoAnswer(timed_out=True):
            again = self.ask_result()
            self.asked = None if self.asked is None else again
        elif self._accepted:
            self._end(answer)
        else:
            self._answer = answer

    def _end(self, answer: Answer) -> None:
        response = _decoded(self._result, answer)
        if self.asked is not None and response is not None and response.status == GoalStatus.UNKNOWN:
            self.asked = None  # the question has overtaken the goal
            self.ask_result()
            return
        self.server.over(self._goal_id)
        self.client.on_result(self._outcome(response, answer))

    def _outcome(self, response: Any, answer: Answer) -> Outcome:
        host = self.server.host
        if response is None:
            how = "ended or was lost" if isinstance(answer, NoAnswer) else "ended"
            return create(Outcome, GoalStatus.ABORTED, reason=f"{host} {how} while the goal ran")
        status = _status_of(response.status)
        if not status.is_terminal and self._told.is_terminal:
            return create(
                Outcome,
                self._told,
                reason=f"the goal has ended as {self._told.name}, but {host} has not kept its result",
            )
        if not status.is_terminal:
            return create(Outcome, GoalStatus.ABORTED, reason=f"{host} does not know the goal any more")
        return create(Outcome, status, response.result, _reason_in(answer))


def _reason_in(answer: Answer) -> str:
    """The reason that one of our peers has given; empty from others."""
    try:
        extension = parse_extension(answer.extension) if isinstance(answer, Replied) else None
    except WireFormatError:
        extension = None
    return "" if extension is None else extension.reason
