"""The declarations of a node class, collected and checked once, when the class is made.

A wrong declaration fails at import, with the name of the method and the remedy.
"""

from __future__ import annotations

import inspect
import math
from collections.abc import Callable, Coroutine
from typing import TYPE_CHECKING, Any, Generic, Literal, Never, NoReturn, ParamSpec, TypeAlias, TypeVar, overload

from actors.checks import NoPublicConstructor, create, is_number
from actors.contracts.contracts import (
    ActionHandler,
    Declaration,
    GoalHook,
    ServiceHandler,
    Topic,
    TopicHandler,
    check_reading,
    declarations_of,
    positional,
)
from actors.contracts.signatures import check_argument, check_nothing_returned, check_response, check_steps
from actors.errors import DeclarationError, NotStarted
from actors.parameters.declare import INTROSPECTION, NO_PARAMETERS, ParameterDeclaration, ParameterTable
from actors.parameters.hooks import ParameterHook
from actors.parameters.rates import check_rate_parameter, rate_objection
from actors.qos import of
from actors.qos.policies import QoS
from actors.runtime.members import check_members, members_of

if TYPE_CHECKING:
    from actors.contracts.content_filter import ContentFilter
    from actors.interfaces.message import Message
    from actors.topics.publisher import Publisher
    from actors.topics.stream import Stream

M = TypeVar("M", bound="Message")
Node = TypeVar("Node")
P = ParamSpec("P")
Nothing = TypeVar("Nothing", bound="Coroutine[object, None, None] | None")

Late: TypeAlias = Literal["skip", "catch_up", "fault"]
"""What a periodic handler does with missed ticks; see `every`."""


class _EndpointDeclaration(Generic[M]):
    """A class attribute that declares an endpoint of each instance on one topic."""

    __slots__ = ("attribute", "qos", "topic")

    def __init__(self, topic: Topic[M], qos: QoS) -> None:
        self.topic = topic
        self.qos = qos
        self.attribute = ""

    def __set_name__(self, owner: type, name: str) -> None:
        self.attribute = name


class PublisherDeclaration(_EndpointDeclaration[M], metaclass=NoPublicConstructor):
    """``cmd = publishes(CMD_VEL)``: the contract on the class, a `Publisher` on the instance.

    It has no public constructor: `publishes` gives one.
    """

    __slots__ = ()

    def __repr__(self) -> str:
        return f"publishes({self.topic!r})"

    @overload
    def __get__(self, instance: None, owner: type) -> Topic[M]: ...
    @overload
    def __get__(self, instance: object, owner: type) -> Publisher[M]: ...
    def __get__(self, instance: object, owner: type) -> Topic[M] | Publisher[M]:
        if instance is None:
            return self.topic
        raise NotStarted(
            f"{owner.__name__}.{self.attribute}: the node has not been started yet; publish in on_start or later"
        )

    if TYPE_CHECKING:  # at run time, a `__set__` would take precedence over the attribute of the instance

        def __set__(self, instance: object, value: Never) -> NoReturn: ...


class StreamDeclaration(_EndpointDeclaration[M], metaclass=NoPublicConstructor):
    """``odometry = subscribes(ODOMETRY)``: the contract on the class, a `Stream` on the instance, subscribed from the start on.

    It has no public constructor: `subscribes` gives one.
    """

    __slots__ = ("filter", "patience")

    def __init__(self, topic: Topic[M], qos: QoS, patience: float, filter: ContentFilter | None) -> None:
        super().__init__(topic, qos)
        self.patience = patience
        self.filter = filter

    def __repr__(self) -> str:
        return f"subscribes({self.topic!r})"

    @overload
    def __get__(self, instance: None, owner: type) -> Topic[M]: ...
    @overload
    def __get__(self, instance: object, owner: type) -> Stream[M]: ...
    def __get__(self, instance: object, owner: type) -> Topic[M] | Stream[M]:
        if instance is None:
            return self.topic
        raise NotStarted(
            f"{owner.__name__}.{self.attribute}: the node has not been started yet; read it in on_start or later"
        )

    if TYPE_CHECKING:  # as in `PublisherDeclaration`

        def __set__(self, instance: object, value: Never) -> NoReturn: ...


def publishes(topic: Topic[M], *, qos: QoS | int | None = None) -> PublisherDeclaration[M]:
    """Declare that the node publishes on `topic`; the attribute is its `Publisher`. `qos` overrides that of the contract."""
    _check_topic("publishes", topic)
    return create(PublisherDeclaration, topic, topic.qos if qos is None else of(qos))  # pyright: ignore[reportUnknownVariableType]


def subscribes(
    topic: Topic[M], *, qos: QoS | int | None = None, patience: float = 0.0, filter: ContentFilter | None = None
) -> StreamDeclaration[M]:
    """Declare that the node subscribes to `topic` without a handler: the attribute is a `Stream`, with the newest message in `.latest`.

    The options are those of `Topic.on`.
    """
    _check_topic("subscribes", topic)
    check_reading(f"subscribes({topic!r})", topic, patience, filter)
    return create(StreamDeclaration, topic, topic.qos if qos is None else of(qos), patience, filter)


def _check_topic(where: str, topic: object) -> None:
    if not isinstance(topic, Topic):
        raise DeclarationError(f"{where}({topic!r:.40}): give a contract, such as CHATTER = Topic(String, 'chatter')")


class TimerDeclaration(Declaration):
    """``@every(hz=50)``."""

    __slots__ = ("hz", "late")

    def __init__(self, hz: float | str, late: Late) -> None:
        super().__init__()
        self.hz = hz
        self.late: Late = late

    def __repr__(self) -> str:
        return f"@every(hz={self.hz!r})"


class BackgroundDeclaration(Declaration):
    """``@background``."""

    __slots__ = ()

    def __repr__(self) -> str:
        return "@background"


def every(
    *misused: Never, hz: float | str | None = None, period: float | None = None, late: Late = "skip"
) -> Callable[[Callable[P, Nothing]], Callable[P, Nothing]]:
    """Decorate a method that runs periodically: its k-th tick is due at start + k/hz, so it does not drift.

    Give either `hz` or `period` (seconds); `hz` may be the name of a parameter of the node. A tick that is due while the last one has
    not begun is skipped and counted (`late="skip"`), run later (``catch_up``, at most 1000 wait) or ends the incarnation (``fault``).
    The method takes no argument, or a `Tick`. When the parameter is set, the next tick is due one new period later; a rate that is not
    above 0 and below a million is refused. Raises `DeclarationError` for wrong arguments.
    """
    if misused:
        raise DeclarationError(_without_keyword(misused[0]))
    if (hz is None) == (period is None):
        raise DeclarationError("every(): give either hz=, ticks per second, or period=, seconds")
    rate = hz if hz is not None else _rate_of(period)
    if not isinstance(rate, str) and (objection := rate_objection(rate)) is not None:
        raise DeclarationError(f"every(hz={hz!r}, period={period!r}): {objection}")
    if late not in ("skip", "catch_up", "fault"):
        raise DeclarationError(f"every(late={late!r}): use skip, catch_up or fault")
    declaration = TimerDeclaration(rate, late)

    def decorate(function: Callable[P, Nothing]) -> Callable[P, Nothing]:
        declaration.attach(function)
        return function

    return decorate


def _without_keyword(value: object) -> str:
    """ROS 2's timers take a period, and its rates a frequency."""
    if callable(value):
        name = getattr(value, "__name__", "method")
        return f"@every without its rate: write @every(hz=10) or @every(period=0.1) above `{name}`"
    if isinstance(value, str):
        return f"every({value!r}): write every(hz={value!r})"
    return f"every({value!r}): write every(hz={value!r}), ticks per second, or every(period={value!r}), seconds"


def _rate_of(period: object) -> float:
    return 1.0 / period if is_number(period) and 0.0 < period < math.inf else 0.0


def background(
    function: Callable[[Node], Coroutine[object, None, None]],
) -> Callable[[Node], Coroutine[object, None, None]]:
    """Decorate a coroutine method that runs in a task of its own from the node's start to its end, such as the read loop of a driver."""
    BackgroundDeclaration().attach(function)
    return function


class Declarations:
    """The declarations of one node class, in the order in which they are written, base classes first.

    Invariants: all declarations have been checked, each by itself and against the others; they do not change after the class was made.
    Only `clean` does, once.
    """

    __slots__ = (
        "actions",
        "backgrounds",
        "clean",
        "endpoints",
        "hooks",
        "introspected",
        "labels",
        "overridable",
        "owner",
        "parameter_hooks",
        "parameters",
        "publishers",
        "rates",
        "services",
        "streams",
        "table",
        "timers",
        "topics",
    )

    def __init__(self, owner: type) -> None:
        self.owner = owner
        self.clean = False
        """Whether a node of the class has started without instance attributes that hide methods of the framework."""
        self.publishers: list[PublisherDeclaration[Any]] = []
        self.streams: list[StreamDeclaration[Any]] = []
        self.parameters: list[ParameterDeclaration[object]] = []
        self.parameter_hooks: list[ParameterHook] = []
        self.topics: list[TopicHandler] = []
        self.services: list[ServiceHandler] = []
        self.actions: list[ActionHandler] = []
        self.hooks: list[GoalHook] = []
        self.timers: list[TimerDeclaration] = []
        self.backgrounds: list[BackgroundDeclaration] = []
        self.rates: dict[str, str] = {}
        """Parameter -> the label of the timer that ticks by it."""
        self.labels: dict[str, str] = {}
        """Method -> its label in reports, one text for all nodes of the class."""
        check_members(owner, (PublisherDeclaration, StreamDeclaration, ParameterDeclaration))
        for name, value in members_of(owner).items():
            self._take(name, value)
        self._check_names()
        profiles = (one.qos for them in (self.publishers, self.streams, self.topics) for one in them)
        self.overridable = any(qos.overriding is not None for qos in profiles)
        """Whether parameters may override the quality of service of an endpoint."""
        self.table = ParameterTable(self.parameters) if self.parameters else NO_PARAMETERS
        self.endpoints = bool(self.publishers or self.streams or self.topics or self.services or self.actions)
        """Whether a node of the class has endpoints from its start on."""
        self.introspected = not self.table.values.keys().isdisjoint(INTROSPECTION)
        """Whether the class declares a parameter of service introspection."""

    def _take(self, name: str, value: object) -> None:
        if isinstance(value, PublisherDeclaration):
            self.publishers.append(value)  # pyright: ignore[reportUnknownArgumentType]
        elif isinstance(value, StreamDeclaration):
            self.streams.append(value)  # pyright: ignore[reportUnknownArgumentType]
        elif isinstance(value, ParameterDeclaration):
            self.parameters.append(value)  # pyright: ignore[reportUnknownArgumentType]
        else:
            for declaration in declarations_of(value):
                self._take_method(name, declaration)

    def _take_method(self, name: str, declaration: Declaration) -> None:
        where = self.labels[name] = f"{self.owner.__name__}.{name}"
        declaration.attribute = name
        function = declaration.function
        match declaration:
            case TopicHandler():
                check_argument(where, function, "listens to", declaration.topic, declaration.topic.type)
                check_nothing_returned(where, function, declaration.topic)
                self.topics.append(declaration)
            case ServiceHandler():
                check_argument(where, function, "serves", declaration.service, declaration.service.request)
                if not inspect.iscoroutinefunction(function):
                    raise DeclarationError(f"{where} serves {declaration.service!r}: make it `async def`")
                check_response(where, function, declaration.service, declaration.service.response)
                self.services.append(declaration)
            case ActionHandler():
                check_argument(where, function, "serves", declaration.action, declaration.action.goal)
                if not inspect.isasyncgenfunction(function):
                    raise DeclarationError(
                        f"{where} serves {declaration.action!r}: make it an async generator, one that yields feedback and ends with `yield Done(result)`"
                    )
                action = declaration.action
                check_steps(where, function, action, action.feedback, action.result)
                self.actions.append(declaration)
            case GoalHook():
                check_argument(
                    where, function, f"is @{declaration.verb} of", declaration.action, declaration.action.goal
                )
                self.hooks.append(declaration)
            case TimerDeclaration():
                if positional(function) not in (1, 2):
                    raise DeclarationError(f"{where} is {declaration!r}: it must take self, and a Tick if it wants one")
                self.timers.append(declaration)
            case BackgroundDeclaration():
                if not inspect.iscoroutinefunction(function) or positional(function) != 1:
                    raise DeclarationError(f"{where} is @background: make it `async def {name}(self)`")
                self.backgrounds.append(declaration)
            case ParameterHook():
                declaration.check(where)
                self.parameter_hooks.append(declaration)
            case _:
                raise DeclarationError(f"{where}: unknown declaration {declaration!r}")

    def _check_names(self) -> None:
        parameters = {parameter.name: parameter for parameter in self.parameters}
        for timer in self.timers:
            if isinstance(timer.hz, str):
                check_rate_parameter(self.labels[timer.attribute], timer.hz, parameters)
                self.rates[timer.hz] = self.labels[timer.attribute]
        for asked in self.parameter_hooks:
            if asked.parameter is not None and asked.parameter.name not in parameters:
                raise DeclarationError(
                    f"{self.owner.__name__}.{asked.attribute} is {asked!r}, a parameter that the class does not declare"
                )
        served = [declaration.action for declaration in self.actions]
        for hook in self.hooks:
            if hook.action not in served:
                raise DeclarationError(
                    f"{self.owner.__name__}.{hook.attribute}: {hook!r} without a method that is @{hook.action!r}.serve()"
                )
        _refuse_twice(self.owner, [(declaration.service, declaration.attribute) for declaration in self.services])
        _refuse_twice(self.owner, [(declaration.action, declaration.attribute) for declaration in self.actions])
        for verb in ("accepts", "cancels"):
            _refuse_twice(
                self.owner,
                [(hook.action, hook.attribute) for hook in self.hooks if hook.verb == verb],
                f"are @{verb} of",
            )


def _refuse_twice(owner: type, served: list[tuple[object, str]], verb: str = "serve") -> None:
    for index, (contract, attribute) in enumerate(served):
        for other, earlier in served[:index]:
            if other is contract:
                raise DeclarationError(
                    f"{owner.__name__}.{attribute} and .{earlier} both {verb} {contract!r}: keep one"
                )
