"""Spans of calls and goals, for OpenTelemetry: `run(tree, observers=(Spans(),))`. Needs the extra `otel`.

Import this module late, because it needs the package `opentelemetry`.
"""

from __future__ import annotations

import asyncio
from collections.abc import Mapping
from typing import TYPE_CHECKING, Final, Self

from opentelemetry.context import Context, attach, detach
from opentelemetry.trace import SpanKind, Status, StatusCode, get_tracer, set_span_in_context

from actors.actions.goals import GoalRecord, GoalStatus
from actors.inbox.boundary import outside
from actors.runtime.interceptor import Interceptor

if TYPE_CHECKING:
    from opentelemetry.trace import Span, Tracer, TracerProvider

    from actors.actions.peers import GoalFollower, Outcome
    from actors.actions.server import ActionServer, GoalRequest, ServedGoals
    from actors.interfaces.message import Message, Req, Resp
    from actors.services.client import Client
    from actors.services.peers import Caller, CallId, ServiceCall, ServicePeer, Submit
    from actors.services.server import Handle, Request, Server
    from actors.system import System

__all__ = ["Spans"]


class Spans:
    """Makes a span of each service call, at both of its ends, and of each goal of an action. Attach it before the tree starts.

    * A call has a span of kind CLIENT in the node that makes it, from the request to the answer, and one of kind SERVER below it while its
      handler runs. A goal has one of kind SERVER in the node that serves it, from its request to its end.
    * The span of a handler or of a goal's body is the current one there: calls, goals and spans that begin in it lie below it.
    * Times are those of the system's clock. A call, and a goal, that fails has the status ERROR with the reason.
    * Nothing of it crosses to another process: there a call begins a trace of its own. Both of its spans have the same ``ros.call_id``.

    Spans go to `provider`, or to OpenTelemetry's global one, which drops them until the program sets another.
    """

    def __init__(self, provider: TracerProvider | None = None) -> None:
        self._tracer: Final = get_tracer("robactor", tracer_provider=provider)
        self._tracing: Tracing | None = None

    def attach(self, system: System) -> Self:
        """Make spans of this system. Raises `RuntimeError` if they are those of another one already."""
        if self._tracing is not None:
            raise RuntimeError("these spans are those of a system already: make others")
        self._tracing = Tracing(self._tracer, system)
        system.runtime.intercept(self._tracing)
        return self


def _failure(future: asyncio.Future[Message] | asyncio.Future[int]) -> tuple[str, str] | None:
    """The kind and the text of the error that was the answer; None if it was none."""
    if not future.done():
        return "NotRunning", "the node has ended"
    if future.cancelled():
        return "CancelledError", "the caller has given up"
    error = future.exception()
    return None if error is None else (type(error).__name__, str(error))


class Tracing(Interceptor):
    """Makes the spans of one system.

    Invariant: `_sent` holds the span of each call that a node of this system has made, and that has not been answered.
    """

    def __init__(self, tracer: Tracer, system: System) -> None:
        self._sent: dict[CallId, Span] = {}
        self._tracer = tracer
        self._clock = system.clock

    def now(self) -> int:
        """The time of the system's clock, nanoseconds. It is not the node that reads it."""
        with outside():
            return self._clock.wall_ns()

    def begin(self, name: str, kind: SpanKind, context: Context | None, attributes: Mapping[str, str]) -> Span:
        """A span that begins now, below that of `context`, or below the current one."""
        return self._tracer.start_span(
            name, context, kind, attributes={"rpc.system": "ros2", **attributes}, start_time=self.now(),
            record_exception=False, set_status_on_exception=False,
        )  # fmt: skip

    def end(self, span: Span, failure: tuple[str, str] | None = None) -> None:
        """End a span; `failure` is the kind of an error and its text."""
        if failure is not None:
            kind, text = failure
            span.set_attribute("error.type", kind)
            span.set_status(Status(StatusCode.ERROR, text))
        span.end(self.now())

    def _of_call(self, node: Caller, service: str, call_id: CallId, kind: SpanKind, context: Context | None) -> Span:
        client, number = call_id
        attributes = {"ros.service": service, "ros.node": node.fqn, "ros.call_id": f"{client.hex()}:{number}"}
        return self.begin(service, kind, context, attributes)

    def calling(self, client: Client[Req, Resp], submit: Submit) -> Submit:
        service = client.entry.name

        def submitted(server: ServicePeer, message: Message, caller: Caller, timeout: float) -> ServiceCall:
            call = submit(server, message, caller, timeout)
            call_id = call.call_id
            span = self._sent[call_id] = self._of_call(caller, service, call_id, SpanKind.CLIENT, None)

            def answered(future: asyncio.Future[Message]) -> None:
                del self._sent[call_id]
                self.end(span, _failure(future))

            call.future.add_done_callback(answered)
            return call

        return submitted

    def handling(self, server: Server, handle: Handle) -> Handle:
        service = server.entry.name

        async def handled(request: Request) -> None:
            call_id = request.call_id
            caller = self._sent.get(call_id)
            above = Context() if caller is None else set_span_in_context(caller, Context())
            span = self._of_call(server.node, service, call_id, SpanKind.SERVER, above)
            token = attach(set_span_in_context(span))
            try:
                await handle(request)
            finally:
                detach(token)
                self.end(span, _failure(request.future))

        return handled

    def serving_goals(self, server: ActionServer, ways: ServedGoals) -> ServedGoals:
        return GoalSpans(self, server, ways).ways


class GoalSpans:
    """The spans of the goals of one action.

    Invariant: `_open` holds the span of each goal that is asked for or accepted, and has not ended.
    """

    def __init__(self, tracing: Tracing, server: ActionServer, ways: ServedGoals) -> None:
        self._tracing = tracing
        self._action = server.entry.name
        self._attributes = {"ros.action": self._action, "ros.node": server.host}
        self._open: dict[bytes, Span] = {}
        self._inner = ways
        self.ways = ways._replace(submit=self._submit, run=self._run, ended=self._ended)

    def _submit(self, goal_id: bytes, message: Message, client: GoalFollower | None) -> GoalRequest:
        attributes = {**self._attributes, "ros.goal_id": goal_id.hex()}
        span = self._tracing.begin(self._action, SpanKind.SERVER, None, attributes)
        request = self._inner.submit(goal_id, message, client)

        def answered(future: asyncio.Future[int]) -> None:
            if (failure := _failure(future)) is not None:
                self._tracing.end(span, failure)
                if self._open[goal_id] is span:
                    del self._open[goal_id]

        self._open.setdefault(goal_id, span)  # a second request with this id is rejected
        request.future.add_done_callback(answered)
        return request

    async def _run(self, goal: GoalRecord) -> None:
        span = self._open[goal.goal_id]
        span.add_event("executing", timestamp=self._tracing.now())
        attach(set_span_in_context(span))  # for as long as the task of this goal runs
        await self._inner.run(goal)

    def _ended(self, goal: GoalRecord, outcome: Outcome) -> None:
        span = self._open.pop(goal.goal_id)
        span.set_attribute("ros.goal_status", goal.status.name)
        failed = goal.status is not GoalStatus.SUCCEEDED
        self._tracing.end(span, (goal.status.name, goal.reason) if failed else None)
        self._inner.ended(goal, outcome)
