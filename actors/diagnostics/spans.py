"""Spans of calls and goals, for OpenTelemetry: `run(tree, observers=(Spans(),))`. Needs the extra `otel`.

Import this module late, because it needs the package `opentelemetry`.
"""

from __future__ import annotations

import asyncio
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, Final

from opentelemetry.context import Context, attach, detach
from opentelemetry.trace import SpanKind, Status, StatusCode, get_tracer, set_span_in_context

from actors.actions.goals import GoalStatus
from actors.services.introspection import CallStep

if TYPE_CHECKING:
    from contextvars import Token
    from typing import Self

    from opentelemetry.trace import Span, Tracer, TracerProvider

    from actors.actions.goals import GoalRecord
    from actors.actions.requests import GoalRequest
    from actors.actions.server import ActionServer
    from actors.interfaces.message import Message
    from actors.services.introspection import CallId, IdentifiedCall
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
        self._tracing = tracing = Tracing(self._tracer, system)
        observers = system.runtime.observers
        observers.calls.append(lambda node, service: CallSpans(tracing, node, service))
        observers.goals.append(lambda server: GoalSpans(tracing, server).watch(server))
        return self


class Tracing:
    """What the spans of one system share.

    Invariants: `sent` holds the span of each call that a node of this system has made, and that has not been answered; `handling` that of each
    call whose handler runs here, and what undoes that it is the current one.
    """

    def __init__(self, tracer: Tracer, system: System) -> None:
        self.sent: dict[CallId, Span] = {}
        self.handling: dict[CallId, tuple[Span, Token[Context]]] = {}
        self._tracer = tracer
        self._clock = system.clock

    def begin(self, name: str, kind: SpanKind, context: Context | None, attributes: Mapping[str, str]) -> Span:
        """A span that begins now, below that of `context`, or below the current one."""
        return self._tracer.start_span(
            name, context, kind, attributes=attributes, start_time=self._clock.wall_ns(),
            record_exception=False, set_status_on_exception=False,
        )  # fmt: skip

    def note(self, span: Span, what: str) -> None:
        """An event of a span, now."""
        span.add_event(what, timestamp=self._clock.wall_ns())

    def end(self, span: Span, failure: tuple[str, str] | None = None) -> None:
        """End a span; `failure` is the kind of an error and its text."""
        if failure is not None:
            kind, text = failure
            span.set_attribute("error.type", kind)
            span.set_status(Status(StatusCode.ERROR, text))
        span.end(self._clock.wall_ns())


def _failure(future: asyncio.Future[Any]) -> tuple[str, str] | None:
    """The kind and the text of the error that was the answer; None if it was none."""
    if not future.done():
        return "NotRunning", "the node has ended"
    if future.cancelled():
        return "CancelledError", "the caller has given up"
    error = future.exception()
    return None if error is None else (type(error).__name__, str(error))


class CallSpans:
    """The spans of the calls of one service, at one end of them."""

    def __init__(self, tracing: Tracing, node: str, service: str) -> None:
        self._tracing = tracing
        self._service = service
        self._attributes = {"rpc.system": "ros2", "ros.service": service, "ros.node": node}

    def tell(self, step: CallStep, call: IdentifiedCall, message: Message) -> None:
        if step is CallStep.REQUEST_SENT:
            self._sent(call)
        elif step is CallStep.REQUEST_RECEIVED:
            self._received(call)

    def handled(self, call: IdentifiedCall) -> None:
        span, token = self._tracing.handling.pop(call.call_id)
        detach(token)
        self._tracing.end(span, _failure(call.future))

    def _sent(self, call: IdentifiedCall) -> None:
        tracing, call_id = self._tracing, call.call_id
        span = tracing.sent[call_id] = self._begin(call_id, SpanKind.CLIENT, None)

        def answered(future: asyncio.Future[Any]) -> None:
            del tracing.sent[call_id]
            tracing.end(span, _failure(future))

        call.future.add_done_callback(answered)

    def _received(self, call: IdentifiedCall) -> None:
        call_id = call.call_id
        caller = self._tracing.sent.get(call_id)
        above = Context() if caller is None else set_span_in_context(caller, Context())
        span = self._begin(call_id, SpanKind.SERVER, above)
        self._tracing.handling[call_id] = span, attach(set_span_in_context(span))

    def _begin(self, call_id: CallId, kind: SpanKind, context: Context | None) -> Span:
        client, number = call_id
        attributes = {**self._attributes, "ros.call_id": f"{client.hex()}:{number}"}
        return self._tracing.begin(self._service, kind, context, attributes)


class GoalSpans:
    """The spans of the goals of one action.

    Invariant: `_open` holds the span of each goal that is asked for or accepted, and has not ended.
    """

    def __init__(self, tracing: Tracing, server: ActionServer) -> None:
        self._tracing = tracing
        self._action = server.entry.name
        self._attributes = {"rpc.system": "ros2", "ros.action": self._action, "ros.node": server.host}
        self._open: dict[bytes, Span] = {}

    def watch(self, server: ActionServer) -> None:
        """Hear of all that happens to the goals of this server."""
        server.observers.requested.append(self._requested)
        server.observers.begun.append(self._begun)
        server.observers.ended.append(self._ended)

    def _requested(self, request: GoalRequest) -> None:
        attributes = {**self._attributes, "ros.goal_id": request.goal_id.hex()}
        span = self._tracing.begin(self._action, SpanKind.SERVER, None, attributes)

        def answered(future: asyncio.Future[int]) -> None:
            if (failure := _failure(future)) is not None:
                self._tracing.end(span, failure)
                if self._open[request.goal_id] is span:
                    del self._open[request.goal_id]

        self._open.setdefault(request.goal_id, span)  # a second request with this id is rejected
        request.future.add_done_callback(answered)

    def _begun(self, goal: GoalRecord) -> None:
        span = self._open[goal.goal_id]
        self._tracing.note(span, "executing")
        attach(set_span_in_context(span))  # for as long as the task of this goal runs

    def _ended(self, goal: GoalRecord) -> None:
        span = self._open.pop(goal.goal_id)
        span.set_attribute("ros.goal_status", goal.status.name)
        failed = goal.status is not GoalStatus.SUCCEEDED
        self._tracing.end(span, (goal.status.name, goal.reason) if failed else None)
