"""Contracts: typed names of topics, services and actions, shared by those who serve them and those who use them.

A contract is a module-level constant. The serving side uses it as a decorator, the using side as an address. A client therefore never
imports the class of a server, and a type checker sees the same types on both sides::

    CMD_VEL = Topic(Twist, "cmd_vel", qos.COMMANDS)
    BATTERY = Service(GetBatteryStatus, "get_battery_status")
    MOVE = Action(MoveToPosition, "move_to_position")

Names are ROS names: a relative name is resolved in the namespace of the node that uses it, and remapping applies.
"""

from __future__ import annotations

import builtins  # the contract classes have a field `type`, which hides the builtin
import inspect
from collections.abc import AsyncGenerator, Callable, Coroutine
from math import inf
from types import CodeType
from typing import Any, Final, Generic, Literal, Never, TypeAlias, TypeVar, cast

from actors.checks import NoPublicConstructor, create, is_number, is_whole
from actors.contracts.content_filter import ContentFilter
from actors.errors import DeclarationError
from actors.interfaces.message import ActionType, F, G, M, R, Req, Resp, ServiceType
from actors.qos import DEFAULT, of
from actors.qos.policies import QoS


class Declaration:
    """A declaration attached to a method by a decorator. `Node` collects it when the class of the method is created."""

    __slots__ = ("attribute", "function")

    def __init__(self) -> None:
        self.function: Callable[..., object]
        self.attribute = ""

    def attach(self, function: Callable[..., object]) -> None:
        if not callable(function):
            raise DeclarationError(f"{self!r} decorates a method, not {function!r}")
        self.function = function
        held = cast("tuple[Declaration, ...]", getattr(function, "__declarations__", ()))
        function.__dict__["__declarations__"] = (*held, self)


def declarations_of(function: object) -> tuple[Declaration, ...]:
    """The declarations attached to a function, innermost decorator first."""
    return cast("tuple[Declaration, ...]", getattr(function, "__declarations__", ()))


def positional(function: Callable[..., object]) -> int:
    """The number of positional arguments of a method, including self."""
    code: CodeType = inspect.unwrap(function).__code__
    return code.co_argcount


Node = TypeVar("Node")
Nothing = TypeVar("Nothing", bound="Coroutine[object, None, None] | None")
Verdict = TypeVar("Verdict", bound="Coroutine[object, None, bool] | bool")


class Done(Generic[R]):
    """The last item of an action body that succeeded, with its result. A goal that is being canceled ends as canceled, with this result."""

    __slots__ = ("result",)

    def __init__(self, result: R) -> None:
        self.result: Final = result

    def __repr__(self) -> str:
        return f"Done({self.result!r})"


class Aborted(Generic[R]):
    """The last item of an action body that failed, with its result and a reason."""

    __slots__ = ("reason", "result")

    def __init__(self, result: R, reason: str = "aborted by its body") -> None:
        self.result: Final = result
        self.reason: Final = reason

    def __repr__(self) -> str:
        return f"Aborted({self.result!r}, {self.reason!r})"


Steps: TypeAlias = AsyncGenerator[F | Done[R] | Aborted[R], None]
"""The type of an action body: an async generator that yields feedback and ends with `Done` or `Aborted`. Write ``Steps[Feedback,
Result]``."""


class ArrivalPolicy(metaclass=NoPublicConstructor):
    """An arrival policy with the number of goals that it allows to wait or to run.

    It has no public constructor: `queue` and `parallel` give one.
    """

    __slots__ = ("policy", "size")

    def __init__(self, policy: str, size: int) -> None:
        if not is_whole(size) or size < 1:
            raise DeclarationError(f"{policy}({size!r:.40}): the limit must be at least 1, and a whole number")
        self.policy: Final = policy
        self.size: Final = size

    def __repr__(self) -> str:
        return f"{self.policy}({self.size})"


Arrivals: TypeAlias = Literal["reject", "preempt", "queue", "parallel"] | ArrivalPolicy
"""How an action server treats a goal that arrives while another one runs; see `Action.serve`."""


def queue(n: int) -> ArrivalPolicy:
    """Run one goal at a time and let at most `n` others wait; further goals are rejected."""
    return create(ArrivalPolicy, "queue", n)


def parallel(n: int) -> ArrivalPolicy:
    """Run at most `n` goals at once; further goals are rejected."""
    return create(ArrivalPolicy, "parallel", n)


_ARRIVALS: Final[dict[str, ArrivalPolicy]] = {
    "reject": create(ArrivalPolicy, "reject", 1),
    "preempt": create(ArrivalPolicy, "preempt", 1),
    "queue": create(ArrivalPolicy, "queue", 10),
    "parallel": create(ArrivalPolicy, "parallel", 1000),
}


def _refuse_bare(misplaced: tuple[object, ...], written: str) -> None:
    """Raise `DeclarationError` if the decorator is used without parentheses, or with an option that has no name."""
    if not misplaced:
        return
    name = getattr(misplaced[0], "__name__", "")
    if callable(misplaced[0]) and name:
        raise DeclarationError(f"@{written} without parentheses: write @{written}() above `{name}`")
    raise DeclarationError(f"@{written}({misplaced[0]!r:.60}): its options are given by name")


def checked_concurrency(what: str, concurrent: int) -> int:
    """The option `concurrent` of a handler. Raises `DeclarationError`."""
    if not is_whole(concurrent) or concurrent < 0:
        raise DeclarationError(
            f"{what}: concurrent={concurrent!r:.40} must be 0 (one at a time with the node's other handlers) or more, and a whole number"
        )
    return concurrent


def check_reading(where: str, topic: Topic[M], patience: object, filter: ContentFilter | None) -> None:
    """Raise `DeclarationError` or `InvalidFilter` unless these options of a subscription of `topic` are valid."""
    if not is_number(patience) or not 0.0 <= patience < inf:
        raise DeclarationError(f"{where}(patience={patience!r:.40}): give a number of seconds of at least 0")
    if filter is not None:
        if not isinstance(cast("object", filter), ContentFilter):
            raise DeclarationError(f"{where}(filter={filter!r:.40}): give a ContentFilter(expression)")
        filter.check(topic.type)


class TopicHandler(Declaration):
    """The declaration made by ``@TOPIC.on()``."""

    __slots__ = ("concurrent", "filter", "patience", "qos", "topic")

    def __init__(
        self, topic: Topic[M], qos: QoS, concurrent: int, patience: float, filter: ContentFilter | None
    ) -> None:
        super().__init__()
        self.topic = topic
        self.qos = qos
        self.concurrent = concurrent
        self.patience = patience
        self.filter = filter

    def __repr__(self) -> str:
        return f"@{self.topic!r}.on()"


class ServiceHandler(Declaration):
    """The declaration made by ``@SERVICE.serve()``."""

    __slots__ = ("concurrent", "service")

    def __init__(self, service: Service[Req, Resp], concurrent: int) -> None:
        super().__init__()
        self.service = service
        self.concurrent = concurrent

    def __repr__(self) -> str:
        return f"@{self.service!r}.serve()"


class ActionHandler(Declaration):
    """The declaration made by ``@ACTION.serve()``."""

    __slots__ = ("action", "arrivals", "result_timeout")

    def __init__(self, action: Action[G, R, F], arrivals: ArrivalPolicy, result_timeout: float) -> None:
        super().__init__()
        self.action = action
        self.arrivals = arrivals
        self.result_timeout = result_timeout

    def __repr__(self) -> str:
        return f"@{self.action!r}.serve()"


class GoalHook(Declaration):
    """The declaration made by ``@ACTION.accepts`` or ``@ACTION.cancels``."""

    __slots__ = ("action", "verb")

    def __init__(self, action: Action[G, R, F], verb: Literal["accepts", "cancels"]) -> None:
        super().__init__()
        self.action = action
        self.verb: Final = verb

    def __repr__(self) -> str:
        return f"@{self.action!r}.{self.verb}"


class Topic(Generic[M]):
    """A named stream of messages of one type. Publishers and subscriptions use its quality of service unless they are given another one."""

    __slots__ = ("name", "qos", "type")

    def __init__(self, type: type[M], name: str, qos: QoS | int = DEFAULT) -> None:
        self.type: Final = _message_class("Topic", name, type)
        self.name: Final = _contract_name("Topic", name)
        self.qos: Final = of(qos)

    def __repr__(self) -> str:
        return f"Topic({self.type.__name__}, {self.name!r})"

    def on(
        self,
        *misplaced: Never,
        qos: QoS | int | None = None,
        concurrent: int = 0,
        patience: float = 0.0,
        filter: ContentFilter | None = None,
    ) -> Callable[[Callable[[Node, M], Nothing]], Callable[[Node, M], Nothing]]:
        """Decorate the method that handles this topic's messages, one at a time together with the node's other handlers.

        With `concurrent=n` the handler runs in tasks of its own instead, at most n at once; use it for handlers that wait. `qos` overrides
        the quality of service of the contract; with a `filter` the handler gets only the messages that this takes. An exception that leaves
        the handler ends the node's incarnation (see `Node.on_error`).

        A message of another process wakes the event loop, unless it may wait: for `patience` seconds at most, or until the loop turns for
        something else. That suits a handler that only notes the message for a later use, and spares much of its cost. The depth must
        hold what comes meanwhile. Messages of this process, and those that are kept for late subscribers, do not wait.
        """
        _refuse_bare(misplaced, f"{self!r}.on")
        checked = checked_concurrency(repr(self), concurrent)
        check_reading(f"{self!r}.on", self, patience, filter)
        declaration = TopicHandler(self, self.qos if qos is None else of(qos), checked, patience, filter)

        def decorate(function: Callable[[Node, M], Nothing]) -> Callable[[Node, M], Nothing]:
            declaration.attach(function)
            return function

        return decorate


class Service(Generic[Req, Resp]):
    """A named remote call: a `Request` is answered by exactly one `Response` or one error."""

    __slots__ = ("name", "request", "response", "type")

    def __init__(self, type: type[ServiceType[Req, Resp]], name: str) -> None:
        self.type: Final = type
        parts = cast("Any", type)
        if not hasattr(type, "Request") or not hasattr(type, "Response"):
            raise DeclarationError(f"Service({type!r}, {name!r}): not a service type; one has .Request and .Response")
        self.request: Final[builtins.type[Req]] = parts.Request
        self.response: Final[builtins.type[Resp]] = parts.Response
        self.name: Final = _contract_name("Service", name)

    def __repr__(self) -> str:
        return f"Service({self.type.__name__}, {self.name!r})"

    def serve(
        self, *misplaced: Never, concurrent: int = 0
    ) -> Callable[
        [Callable[[Node, Req], Coroutine[object, None, Resp]]], Callable[[Node, Req], Coroutine[object, None, Resp]]
    ]:
        """Decorate the coroutine method that answers requests. If it raises, the caller receives `ServiceFailed` and the node goes on.

        With `concurrent=n` at most n requests are answered at once, each in a task of its own.
        """
        _refuse_bare(misplaced, f"{self!r}.serve")
        declaration = ServiceHandler(self, checked_concurrency(repr(self), concurrent))

        def decorate(
            function: Callable[[Node, Req], Coroutine[object, None, Resp]],
        ) -> Callable[[Node, Req], Coroutine[object, None, Resp]]:
            declaration.attach(function)
            return function

        return decorate


class Action(Generic[G, R, F]):
    """A named long-running job: a goal with feedback while it runs and one result, which can be canceled at any time."""

    __slots__ = ("feedback", "goal", "name", "result", "type")

    def __init__(self, type: type[ActionType[G, R, F]], name: str) -> None:
        self.type: Final = type
        parts = cast("Any", type)
        if not all(hasattr(type, part) for part in ("Goal", "Result", "Feedback")):
            raise DeclarationError(
                f"Action({type!r}, {name!r}): not an action type; one has .Goal, .Result and .Feedback"
            )
        self.goal: Final[builtins.type[G]] = parts.Goal
        self.result: Final[builtins.type[R]] = parts.Result
        self.feedback: Final[builtins.type[F]] = parts.Feedback
        self.name: Final = _contract_name("Action", name)

    def __repr__(self) -> str:
        return f"Action({self.type.__name__}, {self.name!r})"

    def serve(
        self, *misplaced: Never, arrivals: Arrivals = "reject", result_timeout: float = 10.0
    ) -> Callable[[Callable[[Node, G], Steps[F, R]]], Callable[[Node, G], Steps[F, R]]]:
        """Decorate the async generator that carries out goals, each in a task of its own.

        `arrivals` decides about a goal that arrives while another one runs. ``reject`` rejects it. ``preempt`` cancels the running goal,
        which cleans up before the new one starts. ``queue`` or `queue(n)` lets it wait, and ``parallel`` or `parallel(n)` starts it. A
        result is kept for `result_timeout` seconds after the end of its goal; 0 keeps no result, a negative number keeps it forever.
        """
        _refuse_bare(misplaced, f"{self!r}.serve")
        if not isinstance(arrivals, ArrivalPolicy) and (
            not isinstance(cast("object", arrivals), str) or arrivals not in _ARRIVALS
        ):
            raise DeclarationError(
                f"{self!r}: arrivals={arrivals!r} is none of {', '.join(_ARRIVALS)}, queue(n), parallel(n)"
            )
        if not is_number(result_timeout):
            raise DeclarationError(
                f"{self!r}: result_timeout={result_timeout!r:.40} must be seconds; 0 keeps no result, a negative number keeps it for ever"
            )
        limit = arrivals if isinstance(arrivals, ArrivalPolicy) else _ARRIVALS[arrivals]
        declaration = ActionHandler(self, limit, result_timeout)

        def decorate(function: Callable[[Node, G], Steps[F, R]]) -> Callable[[Node, G], Steps[F, R]]:
            declaration.attach(function)
            return function

        return decorate

    def accepts(self, function: Callable[[Node, G], Nothing]) -> Callable[[Node, G], Nothing]:
        """Decorate the method that checks each goal before it is accepted. It raises `Reject(reason)` to refuse the goal, and returns nothing."""
        GoalHook(self, "accepts").attach(function)
        return function

    def cancels(self, function: Callable[[Node, G], Verdict]) -> Callable[[Node, G], Verdict]:
        """Decorate the method that decides whether an active goal may be canceled. It returns False to refuse."""
        GoalHook(self, "cancels").attach(function)
        return function


def _contract_name(kind: str, name: str) -> str:
    from actors.names.names import InvalidName, expand

    try:
        # What is invalid for every node is refused here. Some mistakes, such as `a//b`, show only in the full name.
        expand(name, "node", "/ns")
    except InvalidName as problem:
        raise DeclarationError(f"{kind}(..., {name!r}): {problem}") from None
    return name


def _message_class(kind: str, name: str, candidate: type[M]) -> type[M]:
    if not (isinstance(cast("object", candidate), type) and hasattr(candidate, "__struct_fields__")):
        remedy = f"; by its name, the class is get_message({candidate!r})" if isinstance(candidate, str) else ""
        raise DeclarationError(
            f"{kind}({candidate!r}, {name!r}): the type must be a message class, such as std_msgs.msg.String{remedy}"
        )
    return candidate
