"""Service introspection: the calls of a node's services, clients and actions as messages, if its parameters say so.

The parameters are `service_configure_introspection`, `client_configure_introspection` and `action_server_configure_introspection`; a node
has them if it declares them, or if they are given at its start. Their values are ``off`` (also ``disabled``), ``metadata`` (who, when and
which call) and ``contents`` (also the request or the response). Events are published on `<service>/_service_event`; those of an action on
the topics of its services `<action>/_action/send_goal` and `.../get_result`. A node without them pays nothing for it.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final, TypeAlias

from actors.inbox.boundary import asked
from actors.interfaces import derived
from actors.parameters.declare import INTROSPECTION
from actors.runtime.interceptor import Interceptor
from actors.services.peers import CallStep, caller_id

if TYPE_CHECKING:
    import asyncio
    from collections.abc import Callable

    from actors.actions.driver import Host
    from actors.actions.goals import GoalRecord
    from actors.actions.peers import GoalFollower, Outcome
    from actors.actions.server import ActionServer, GoalRequest, ServedGoals
    from actors.interfaces.derived import ServiceClass
    from actors.interfaces.message import Message, Req, Resp
    from actors.services.client import Client
    from actors.services.peers import Caller, CallId, ServiceCall, ServicePeer, Submit
    from actors.services.server import Handle, Request, Server
    from actors.topics.publisher import Publisher

EVENT: Final = "/_service_event"
_SERVICE, _CLIENT, _ACTION = INTROSPECTION

PublishOn: TypeAlias = "Callable[[type[Message], str], Publisher[Message]]"
"""Gives the publisher of a node for messages of a type on a topic, by its full name."""


class Introspection(Interceptor):
    """The introspection of one life of a node. `level(parameter)` is what a parameter of introspection says: off, metadata or contents."""

    def __init__(self, node: Host, level: Callable[[str], str], publish_on: PublishOn) -> None:
        self._node, self._level, self._publish_on = node, level, publish_on
        self._events: dict[tuple[str, str], ServiceEvents] = {}
        """By the parameter that they obey, and the service."""

    def update(self) -> None:
        """Do as the parameters say now."""
        for (parameter, _), events in self._events.items():
            events.obey(self._level(parameter))

    def _of(self, parameter: str, service: str, kind: ServiceClass) -> ServiceEvents:
        events = self._events.get((parameter, service))
        if events is None:
            events = self._events[parameter, service] = ServiceEvents(self._node, self._publish_on, service, kind)
            events.obey(self._level(parameter))
        return events

    def calling(self, client: Client[Req, Resp], submit: Submit) -> Submit:
        events = self._of(_CLIENT, client.entry.name, client.type)

        def submitted(server: ServicePeer, message: Message, caller: Caller, timeout: float) -> ServiceCall:
            call = submit(server, message, caller, timeout)
            if not events.on:
                return call
            # The number of a call is that of its server, which may be another node's.
            call_id: CallId = asked(getattr, call, "call_id")
            events.publish(CallStep.REQUEST_SENT, call_id, message)

            def answered(future: asyncio.Future[Message]) -> None:
                if not future.cancelled() and future.exception() is None:
                    events.publish(CallStep.RESPONSE_RECEIVED, call_id, future.result())

            call.future.add_done_callback(answered)
            return call

        return submitted

    def handling(self, server: Server, handle: Handle) -> Handle:
        events = self._of(_SERVICE, server.entry.name, server.type)

        async def handled(request: Request) -> None:
            if not events.on:
                await handle(request)
                return
            call_id: CallId = asked(getattr, request, "call_id")
            events.publish(CallStep.REQUEST_RECEIVED, call_id, request.message)
            await handle(request)
            future = request.future
            if future.done() and not future.cancelled() and future.exception() is None:
                events.publish(CallStep.RESPONSE_SENT, call_id, future.result())

        return handled

    def serving_goals(self, server: ActionServer, ways: ServedGoals) -> ServedGoals:
        name = f"{server.entry.name}/_action/"
        send: Any = derived.send_goal_service(server.type)
        get: Any = derived.get_result_service(server.type)
        sent, got = self._of(_ACTION, f"{name}send_goal", send), self._of(_ACTION, f"{name}get_result", get)

        def submit(goal_id: bytes, message: Message, client: GoalFollower | None) -> GoalRequest:
            request = ways.submit(goal_id, message, client)
            if sent.on:
                _tell_request(sent, send, request, server.goals)
            return request

        def ended(goal: GoalRecord, outcome: Outcome) -> None:
            if got.on:
                result = server.action.result() if goal.result is None else goal.result
                response = get.Response(status=int(goal.status), result=result)
                got.publish(CallStep.RESPONSE_SENT, (caller_id(goal.goal_id.hex(), ""), 1), response)
            ways.ended(goal, outcome)

        return ways._replace(submit=submit, ended=ended)


def _tell_request(events: ServiceEvents, kind: Any, request: GoalRequest, number: int) -> None:
    """Publish a request for a goal, and the answer to it when there is one."""
    from actors.interfaces.unique_identifier_msgs.msg import UUID
    from actors.time.values import stamp_of

    call_id = caller_id(request.goal_id.hex(), ""), number
    events.publish(
        CallStep.REQUEST_RECEIVED, call_id, kind.Request(goal_id=UUID(uuid=request.goal_id), goal=request.message)
    )

    def answered(future: asyncio.Future[int]) -> None:
        if future.cancelled():
            return
        accepted = future.exception() is None
        response = kind.Response(accepted=True, stamp=stamp_of(future.result())) if accepted else None
        events.publish(CallStep.RESPONSE_SENT, call_id, response or kind.Response(accepted=False))

    request.future.add_done_callback(answered)


class ServiceEvents:
    """Publishes the steps of the calls of one service, as one end of them takes them."""

    def __init__(self, node: Host, publish_on: PublishOn, service: str, kind: ServiceClass) -> None:
        self._node, self._publish_on, self._service, self._kind = node, publish_on, service, kind
        self._contents = False
        self._publisher: Publisher[Message] | None = None
        self.on = False

    def obey(self, level: str) -> None:
        """Publish nothing (``off``), or ``metadata``, or ``contents``, too."""
        self.on, self._contents = level != "off", level == "contents"
        if self.on:
            self._publisher = self._publish_on(derived.event_message(self._kind), self._service + EVENT)

    def publish(self, step: CallStep, call_id: CallId, message: Message) -> None:
        """Publish a step of a call."""
        from actors.interfaces.service_msgs.msg import ServiceEventInfo

        publisher = self._publisher
        if (
            not self.on or publisher is None or publisher.owner is None
        ):  # it is closed, as all are at the end of the node
            return
        gid, number = call_id
        info = ServiceEventInfo(event_type=step, stamp=self._node.clock.stamp(), client_gid=gid, sequence_number=number)
        held = (message,) if self._contents else ()
        side = "request" if step in (CallStep.REQUEST_SENT, CallStep.REQUEST_RECEIVED) else "response"
        event: Any = publisher.type
        publisher.publish(event(info=info, **{side: held}))
