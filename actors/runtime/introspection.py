"""Service introspection: the calls of a node's services, clients and actions as messages, if its parameters say so.

The parameters are `service_configure_introspection`, `client_configure_introspection` and `action_server_configure_introspection`; a node
has them if it declares them, or if they are given at its start. Their values are ``off`` (also ``disabled``), ``metadata`` (who, when and
which call) and ``contents`` (also the request or the response). Events are published on `<service>/_service_event`; those of an action on
the topics of its services `<action>/_action/send_goal` and `.../get_result`. While it is off, it costs a call one comparison.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final, TypeAlias

from actors.interfaces import derived
from actors.services.introspection import CallStep, caller_id

if TYPE_CHECKING:
    from collections.abc import Callable

    from actors.actions.driver import Host
    from actors.actions.goals import GoalRecord
    from actors.actions.requests import GoalRequest
    from actors.actions.server import ActionServer
    from actors.services.introspection import CallId, IdentifiedCall
    from actors.topics.publisher import Publisher

EVENT: Final = "/_service_event"

PublishOn: TypeAlias = "Callable[[Any, str], Publisher[Any]]"
"""Gives the publisher of a node for messages of a type on a topic, by its full name."""


class ServiceEvents:
    """Publishes the steps of the calls of one service, as one end of them takes them."""

    def __init__(self, host: Host, publish_on: PublishOn, service: str, kind: Any, *, contents: bool) -> None:
        self._host = host
        self._contents = contents
        self._type: Any = derived.event_message(kind)
        self._publisher = publish_on(self._type, service + EVENT)

    def tell(self, step: CallStep, call: IdentifiedCall, message: Any) -> None:
        border = self._host.inbox.border
        # the number of a call is that of its server, which may be another node's
        call_id: CallId = call.call_id if border is None else border.compute(getattr, (call, "call_id"))
        self.publish(step, call_id, message)

    def handled(self, call: IdentifiedCall) -> None:
        """Nothing is published of it."""

    def publish(self, step: CallStep, call_id: CallId, message: Any) -> None:
        """Publish a step of a call."""
        from actors.interfaces.service_msgs.msg import ServiceEventInfo

        gid, number = call_id
        if self._publisher.on_close is None:  # it is closed, as all are at the end of the node
            return
        info = ServiceEventInfo(event_type=step, stamp=self._host.clock.stamp(), client_gid=gid, sequence_number=number)
        held = (message,) if self._contents else ()
        if step in (CallStep.REQUEST_SENT, CallStep.REQUEST_RECEIVED):
            self._publisher.publish(self._type(info=info, request=held))
        else:
            self._publisher.publish(self._type(info=info, response=held))


class GoalEvents:
    """Publishes the requests for goals of one action, the answers to them, and the results, as its server sees them."""

    def __init__(self, host: Host, publish_on: PublishOn, server: ActionServer, *, contents: bool) -> None:
        name = f"{server.entry.name}/_action/"
        self._send: Any = derived.send_goal_service(server.type)
        self._get: Any = derived.get_result_service(server.type)
        self._sent = ServiceEvents(host, publish_on, f"{name}send_goal", self._send, contents=contents)
        self._got = ServiceEvents(host, publish_on, f"{name}get_result", self._get, contents=contents)
        self._result: Any = server.action.result
        self._goals = 0

    @staticmethod
    def made(observer: object) -> bool:
        """Whether an observer of goals is a method of one of these."""
        return isinstance(getattr(observer, "__self__", None), GoalEvents)

    def requested(self, request: GoalRequest) -> None:
        from actors.interfaces.unique_identifier_msgs.msg import UUID
        from actors.time.values import stamp_of

        self._goals += 1
        call_id = caller_id(request.goal_id.hex(), ""), self._goals
        message = self._send.Request(goal_id=UUID(uuid=request.goal_id), goal=request.message)
        self._sent.publish(CallStep.REQUEST_RECEIVED, call_id, message)

        def answered(future: Any) -> None:
            if future.cancelled():
                return
            accepted = future.exception() is None
            response = self._send.Response(accepted=True, stamp=stamp_of(future.result())) if accepted else None
            self._sent.publish(CallStep.RESPONSE_SENT, call_id, response or self._send.Response(accepted=False))

        request.future.add_done_callback(answered)

    def ended(self, goal: GoalRecord) -> None:
        result = self._result() if goal.result is None else goal.result
        message = self._get.Response(status=int(goal.status), result=result)
        self._got.publish(CallStep.RESPONSE_SENT, (caller_id(goal.goal_id.hex(), ""), 1), message)
