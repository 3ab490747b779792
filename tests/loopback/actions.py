"""Actions by way of bytes: a goal follows its server by the messages of ROS 2.

What gets lost on the way, as over a real wire: the reason of a rejection, of a cancellation and of an outcome; whether a goal had a result
at all; that a client has given up. The messages of a server to a client arrive in the order in which they were sent, each in a turn of the
loop of its own.
"""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from typing import Any, Final

import pytest

from actors.actions.client import Goal
from actors.actions.goals import CancelCode, GoalStatus
from actors.actions.peers import ActionPeer, GoalFollower, Outcome
from actors.checks import create
from actors.errors import Reject
from actors.interfaces import derived
from actors.interfaces.action_msgs.msg import GoalInfo, GoalStatusArray
from actors.interfaces.action_msgs.msg import GoalStatus as GoalStatusMessage
from actors.interfaces.action_msgs.srv import CancelGoal
from actors.interfaces.unique_identifier_msgs.msg import UUID
from actors.services.peers import OpenCall, ServedName
from actors.time.values import nanoseconds_of, stamp_of
from tests.loopback import carried
from tests.loopback.services import RemoteName

CANCELED_BY: Final = "canceled by a client"
"""The reason at the server: the request has none."""


class RemoteAction(RemoteName[ActionPeer]):
    """An action whose server is always elsewhere."""

    @property
    def server(self) -> RemoteActionServer | None:
        server = self.entry.server
        return None if server is None else RemoteActionServer(self.name, server)

    async def require(self) -> RemoteActionServer:
        return RemoteActionServer(self.name, await self.entry.require())


class RemoteActionServer:
    """Stands for a server elsewhere."""

    node = None

    def __init__(self, name: str, server: ActionPeer) -> None:
        self.name = name
        self.server = server

    @property
    def host(self) -> str:
        return self.server.host

    @property
    def type(self) -> type[Any]:
        return self.server.type

    def submit(self, goal_id: bytes, message: Any, client: GoalFollower | None) -> RemoteGoal:
        assert client is not None
        goal = RemoteGoal(self, goal_id, client)
        service: Any = derived.send_goal_service(self.type)
        soon(goal.arrive, carried(service.Request(goal_id=UUID(uuid=goal_id), goal=message)))
        return goal

    def cancel(self, goal_id: bytes, reason: str) -> asyncio.Future[bool]:
        answer: asyncio.Future[bool] = asyncio.get_running_loop().create_future()
        request = carried(CancelGoal.Request(goal_info=GoalInfo(goal_id=UUID(uuid=goal_id))))

        def arrive() -> None:
            wanted = request.goal_info.goal_id.uuid.tobytes()
            asyncio.ensure_future(self.server.cancel(wanted, CANCELED_BY)).add_done_callback(respond)

        def respond(agreed: asyncio.Future[bool]) -> None:
            code = CancelCode.NONE if agreed.result() else CancelCode.REJECTED
            goals = (request.goal_info,) if agreed.result() else ()
            response = carried(CancelGoal.Response(return_code=int(code), goals_canceling=goals))
            if not answer.done():
                answer.set_result(len(response.goals_canceling) > 0)

        soon(arrive)
        return answer

    def unanswered(self, seconds: float) -> str:
        return f"{self.host}, which serves {self.name}, neither accepted nor rejected the goal within {seconds:g} s"


class RemoteGoal:
    """A goal at a server elsewhere: the request for it, and everything that the server tells of it."""

    def __init__(self, server: RemoteActionServer, goal_id: bytes, client: GoalFollower) -> None:
        self.server = server
        self.goal_id = goal_id
        self.client = client
        self.type: Any = server.type
        self.future: asyncio.Future[int] = asyncio.get_running_loop().create_future()

    @property
    def answered(self) -> bool:
        return self.future.done()

    def arrive(self, request: Any) -> None:
        """At the server: hand in the goal."""
        far: OpenCall = self.server.server.submit(request.goal_id.uuid.tobytes(), request.goal, self)
        far.future.add_done_callback(self.answer)

    def answer(self, answer: asyncio.Future[int]) -> None:
        """Back at the client: accepted, rejected, or what the graph knows of the server's end."""
        failure, gone = answer.exception(), self.future.done()
        service: Any = derived.send_goal_service(self.type)
        if failure is None:
            response = carried(service.Response(accepted=True, stamp=stamp_of(answer.result())))
            if gone:  # and the server could not know
                self.server.cancel(self.goal_id, CANCELED_BY)
            else:
                self.future.set_result(nanoseconds_of(response.stamp))
        elif not gone:
            rejected = isinstance(failure, Reject) and not carried(service.Response(accepted=False)).accepted
            self.future.set_exception(Reject("") if rejected else failure)

    # -- at the server: what it tells ----------------------------------------------------------------------------------------

    def on_status(self, status: GoalStatus) -> None:
        info = GoalInfo(goal_id=UUID(uuid=self.goal_id))
        message = GoalStatusArray(status_list=(GoalStatusMessage(goal_info=info, status=int(status)),))
        soon(self._status, carried(message))

    def on_feedback(self, feedback: Any) -> None:
        message: Any = derived.feedback_message(self.type)
        soon(self._feedback, carried(message(goal_id=UUID(uuid=self.goal_id), feedback=feedback)))

    def on_result(self, outcome: Outcome) -> None:
        service: Any = derived.get_result_service(self.type)
        result = self.type.Result() if outcome.result is None else outcome.result
        soon(self._result, carried(service.Response(status=int(outcome.status), result=result)))

    # -- at the client: what it hears ----------------------------------------------------------------------------------------

    def _status(self, message: GoalStatusArray) -> None:
        (told,) = message.status_list
        assert told.goal_info.goal_id.uuid.tobytes() == self.goal_id
        self.client.on_status(GoalStatus(told.status))

    def _feedback(self, message: Any) -> None:
        assert message.goal_id.uuid.tobytes() == self.goal_id
        self.client.on_feedback(message.feedback)

    def _result(self, response: Any) -> None:
        self.client.on_result(create(Outcome, GoalStatus(response.status), response.result))


def soon(act: Callable[..., None], *arguments: Any) -> None:
    """On the other side, in the order of sending."""
    asyncio.get_running_loop().call_soon(act, *arguments)


def install(monkeypatch: pytest.MonkeyPatch) -> None:
    """From now on every goal reaches its server by way of a stand-in."""
    plain: Any = Goal.__init__

    def linked(self: Goal[Any, Any], node: Any, entry: ServedName[ActionPeer], *rest: Any) -> None:
        plain(self, node, RemoteAction(entry), *rest)

    monkeypatch.setattr(Goal, "__init__", linked)
