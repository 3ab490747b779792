"""`Node`: the base class of all nodes. A subclass declares what it publishes, subscribes to, serves and does periodically.

::

    class Mover(Node):
        cmd = publishes(CMD_VEL)
        speed = parameter(0.5, unit="m/s", ge=0.0, le=2.0)

        @every(hz=50)
        async def steer(self) -> None: ...
"""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable, Coroutine, Mapping
from typing import TYPE_CHECKING, Any, ClassVar, Literal, ParamSpec, TypeAlias, TypeVar, cast

from actors.checks import create
from actors.contracts.contracts import check_reading, checked_concurrency
from actors.errors import DeclarationError, NotStarted
from actors.interfaces.message import F, G, M, R, Req, Resp
from actors.places import claim
from actors.qos import of
from actors.qos.policies import QoS
from actors.runtime.callables import is_async, name_of
from actors.runtime.declarations import Declarations
from actors.runtime.habits import Habits
from actors.runtime.members import check_arguments
from actors.runtime.timers import Rate, Timer
from actors.time.deadlines import check_timeout

if TYPE_CHECKING:
    from random import Random

    from actors.actions.client import Goal
    from actors.contracts.content_filter import ContentFilter
    from actors.contracts.contracts import Action, Service, Topic
    from actors.interfaces.message import Message, ServiceType
    from actors.logs import NodeLog
    from actors.parameters.descriptor import ParameterDescriptor
    from actors.parameters.values import Parameter, SetResult
    from actors.runtime.declarations import Late
    from actors.runtime.endpoints import Endpoints
    from actors.runtime.incarnation import Incarnation
    from actors.supervision.reasons import ExitReason
    from actors.time.clock import Clock
    from actors.time.ros_clock import JumpHandle, JumpThreshold, TimeJump
    from actors.topics.handler import HandlerSubscription
    from actors.topics.publisher import Publisher
    from actors.topics.stream import Stream

P = ParamSpec("P")
T = TypeVar("T")

CALL_TIMEOUT = 1.0
"""The default timeout of a call, seconds: the limit of the wait for its answer."""

GOAL_TIMEOUT = 5.0
"""The default timeout of a goal, seconds: the limit of the wait for its acceptance. Its execution has no limit."""

ErrorVerdict: TypeAlias = Literal["continue", "fail"] | None
"""The answer of `Node.on_error`: the node goes on, its incarnation ends, or the default for that handler applies."""


class Node(Habits):
    """An async actor: its handlers, those of timers included, never overlap, so its attributes need no locks.

    Its life: the supervisor makes the object and runs `on_start`; the node is ready when that returns. Then messages, requests and ticks
    are handled one after another, until the node is asked to stop, or fails. Then its goals and tasks are canceled, and `on_stop` runs.
    After a failure the supervisor makes a new object, the next incarnation, for which waiting messages are kept.

    The properties and methods below work from `on_start` on, not in ``__init__``, where they raise `NotStarted`.
    """

    node_name: ClassVar[str]
    """The default node name. If it is not set, it is the name of the class in snake_case."""

    allow_undeclared_parameters: ClassVar[bool] = False
    """Whether parameters that are not declared can be given and set, which declares them: ROS 2's node option of this name."""

    automatically_declare_parameters_from_overrides: ClassVar[bool] = False
    """Whether parameters that are given at the start and not declared are declared then: ROS 2's node option of this name."""

    declarations: ClassVar[Declarations]

    # The framework's own names have two underscores on both sides, so that no attribute of a user's class hides them by accident.
    __machinery__: Incarnation | None = None
    """The incarnation that runs this object; None before its start."""

    def __init_subclass__(cls, **keywords: object) -> None:
        super().__init_subclass__(**keywords)
        claim(cls.__module__)
        cls.declarations = Declarations(cls)

    if not TYPE_CHECKING:  # for type checkers, `Node` takes no arguments

        def __init__(self, *arguments, **keywords):
            if arguments or keywords:
                check_arguments(type(self), Node, arguments, keywords)
            super().__init__(*arguments, **keywords)

    def __repr__(self) -> str:
        life = self.__machinery__
        return (
            f"<{type(self).__name__} {life.fqn}, incarnation {life.incarnation}>"
            if life is not None
            else f"<{type(self).__name__}, not started>"
        )

    # -- hooks --------------------------------------------------------------------------------------------------------------

    async def on_start(self) -> None:
        """Get ready. The node counts as started, and its siblings go on starting, when this returns."""

    async def on_stop(self, reason: ExitReason) -> None:
        """Leave things in order: the endpoints still work, goals and tasks have ended. Bounded by the child's stop timeout."""

    def handover(self) -> object:
        """What the next incarnation shall begin with after an orderly end, or None to leave the last checkpoint."""
        return None

    def resume(self, state: Any) -> None:
        """Take what the last incarnation left by `checkpoint` or `handover`. Called before `on_start`; not at all if nothing was left."""

    def on_error(self, error: Exception, handler: str) -> ErrorVerdict:
        """An exception left `handler`: return "continue" to live on, "fail" to end the incarnation, None for the default.

        The default is "fail" for timers and topic handlers, and "continue" for services and actions, whose caller gets the error.
        """
        return None

    managed: ClassVar[bool] = False
    """Whether timers start with a lifecycle transition, not with the node: True for lifecycle nodes."""

    async def __begin__(self) -> None:
        """The framework's own part of the start phase, after `on_start`."""

    async def __finish__(self) -> None:
        """The framework's own part of an orderly end, before `on_stop`."""

    __standard_services__: ClassVar[tuple[str, ...]] = ()
    """The names that `__standard_service__` knows."""

    def __standard_service__(
        self, name: str
    ) -> tuple[type[ServiceType[Any, Any]], Callable[[Any], Coroutine[object, None, Message]]] | None:
        """Type and handler of the service ``<node>/name`` if every node of this kind has it, besides what all nodes have; else None."""
        return None

    # -- identity, time and log ---------------------------------------------------------------------------------------------

    @property
    def name(self) -> str:
        """The node's name, without its namespace."""
        return _life_of(self).identity.name

    @property
    def namespace(self) -> str:
        return _life_of(self).identity.namespace

    @property
    def fqn(self) -> str:
        """The fully qualified name: namespace and name."""
        return _life_of(self).fqn

    @property
    def incarnation(self) -> int:
        """1 for the node's first life, 2 after its first restart, and so on."""
        return _life_of(self).incarnation

    @property
    def fencing_token(self) -> int:
        """A number that is larger in each life of the node than in all lives before, on whatever machines of its tree they were, and in
        whatever runs of a tree with other machines (`actors.hosts`).

        Who gets a number with each command can refuse those of an older life that is still on its way, or does not know that it is over.
        """
        life = _life_of(self)
        return life.runtime.placement.token(life.incarnation)

    @property
    def clock(self) -> Clock:
        """The system's clock, real or virtual; with `use_sim_time`, the time of `/clock` (see `actors.runtime.sim_time`)."""
        life = self.__machinery__  # loops read their clock in every turn: without the call of `_life_of`
        return _life_of(self).clock if life is None else life.clock

    def on_jump(
        self,
        threshold: JumpThreshold,
        *,
        pre: Callable[[], object] | None = None,
        post: Callable[[TimeJump], object] | None = None,
    ) -> JumpHandle:
        """Hear of jumps of this node's ROS time: `pre()` runs before, `post(jump)` after each one that passes the threshold.

        Both are plain functions; they run while `/clock` is published or `use_sim_time` is set, in order of registration. An exception of
        one is this node's failure. They are called until `remove()` of the handle, or the end of the incarnation.
        """
        return _life_of(self).ros_time().on_jump(threshold, pre, post)

    @property
    def rng(self) -> Random:
        """The node's own random numbers: they depend on the system's seed, the node's name and its incarnation only."""
        return _life_of(self).rng

    @property
    def log(self) -> NodeLog:
        """The node's log: ``self.log.info("docked", percent=80)``; every line has the node, the time and the incarnation."""
        return _life_of(self).log

    # -- communication ------------------------------------------------------------------------------------------------------

    def publisher(self, topic: Topic[M], *, qos: QoS | int | None = None) -> Publisher[M]:
        """Publish on `topic` from now until the node's end. In a class body, `publishes(TOPIC)` does the same."""
        return _endpoints_of(self).publisher(topic, topic.qos if qos is None else of(qos))

    def subscribe(
        self,
        topic: Topic[M],
        *,
        qos: QoS | int | None = None,
        patience: float = 0.0,
        filter: ContentFilter | None = None,
    ) -> Stream[M]:
        """Listen to `topic` from this moment on: ``async for message in node.subscribe(TOPIC)``. The options are those of `Topic.on`."""
        check_reading(f"{self.fqn}.subscribe", topic, patience, filter)
        return _endpoints_of(self).subscribe(topic, topic.qos if qos is None else of(qos), filter, patience)

    def subscription(self, topic: Topic[M]) -> HandlerSubscription[M]:
        """What feeds this node's handler of `topic`: its counts, its `status`, its `events()`. Raises `DeclarationError` without one."""
        return _life_of(self).endpoints.subscription(topic)

    def call(
        self, service: Service[Req, Resp], request: Req, *, timeout: float = CALL_TIMEOUT
    ) -> Coroutine[object, None, Resp]:
        """Ask a service and wait for its answer, `timeout` seconds at most, the wait for its server included.

        The timeout is on the event loop's clock, also when the node uses simulated time, so that it ends in a paused simulation, too.
        Raises `ServiceUnavailable`, `CallTimeout`, `NodeRestarting`, `NotRunning`, `ServiceFailed`, `CallCycle` or `WrongType`, and
        `ValueError` for a timeout that is no number of seconds (`math.inf` is one).
        """
        life = self.__machinery__ or _life_of(self)
        endpoints = life.opened or life.endpoints
        client = endpoints.clients.get(service) or endpoints.client(service)
        return client.call(request, timeout)

    async def wait_for(
        self, *contracts: Service[Any, Any] | Action[Any, Any, Any], timeout: float | None = None
    ) -> None:
        """Wait until somebody serves every one of these, `timeout` seconds at most in all.

        Without a `timeout` there is no limit. Raises `ServiceUnavailable` or `ActionUnavailable`, both of them `TimeoutError`s, for the
        first one that is not served in time.
        """
        await _life_of(self).endpoints.wait_for(contracts, timeout)

    def send_goal(self, action: Action[G, R, F], goal: G, *, timeout: float = GOAL_TIMEOUT) -> Goal[R, F]:
        """A goal, to be entered with ``async with``; `timeout` (5 s) bounds the wait for its acceptance, nothing its execution.

        The timeout, in seconds, is on the event loop's clock, as that of `call`. Entering raises `ActionUnavailable` when the goal has not
        been accepted by then, and `GoalRejected` when it is rejected.
        """
        check_timeout(f"{self.fqn}.send_goal({action!r})", timeout)
        return _life_of(self).endpoints.goal(action, goal, timeout)

    def on(
        self,
        topic: Topic[M],
        handler: Callable[[M], Coroutine[object, None, None] | None],
        *,
        qos: QoS | int | None = None,
        concurrent: int = 0,
        patience: float = 0.0,
        filter: ContentFilter | None = None,
    ) -> None:
        """Let `handler` take the topic's messages from now on, as `Topic.on` does for a method, with its options."""
        if not callable(handler):
            raise DeclarationError(
                f"{self.fqn}.on({topic!r}, {handler!r:.60}): the handler must be a function or a method"
            )
        checked_concurrency(f"{self.fqn}.on({topic!r})", concurrent)
        check_reading(f"{self.fqn}.on", topic, patience, filter)
        label = f"{self.fqn} {name_of(handler)} on {topic.name}"
        asked = topic.qos if qos is None else of(qos)
        _endpoints_of(self).handle(topic, asked, handler, label, concurrent, patience, filter)

    def serve(
        self,
        service: Service[Req, Resp],
        handler: Callable[[Req], Coroutine[object, None, Resp]],
        *,
        concurrent: int = 0,
    ) -> None:
        """Let `handler` answer the service from now on, as `Service.serve` does for a method, with its options."""
        if not is_async(handler):
            raise DeclarationError(
                f"{self.fqn}.serve({service!r}, {name_of(handler)}): the handler answers by `await`; make it `async def`"
            )
        checked_concurrency(f"{self.fqn}.serve({service!r})", concurrent)
        _endpoints_of(self).serve(service, handler, name_of(handler), concurrent)

    # -- work ---------------------------------------------------------------------------------------------------------------

    def create_timer(
        self,
        period: float,
        callback: Callable[..., Awaitable[None] | None],
        *,
        once: bool = False,
        late: Late = "skip",
        autostart: bool = True,
    ) -> Timer:
        """Call `callback` every `period` seconds from now on, or with `once` a single time, as `every` does for a method.

        It takes no argument, or a `Tick`. Without `autostart` the timer begins with `Timer.reset`. Raises `ValueError` for what is no
        period, and `Ended` after the end of the node, with which the timer ends.
        """
        label = f"{self.fqn} timer {name_of(callback)}"
        life = _life_of(self)
        return create(
            Timer,
            life.timers,
            life.check_use,
            lambda: life.clock,
            callback,
            period,
            once=once,
            late=late,
            label=label,
            autostart=autostart,
        )

    def create_rate(self, hz: float) -> Rate:
        """A rate for a loop in a task of its own: ``await rate.sleep()`` waits for the next of its instants on the node's clock."""
        life = _life_of(self)
        return create(Rate, lambda: life.clock, hz)

    def create_task(self, work: Coroutine[object, None, None], *, name: str = "") -> asyncio.Task[None]:
        """Run `work` in a task of this node: canceled when the node stops; if it fails, the node fails."""
        try:
            _life_of(self).check_use()
        except BaseException:
            work.close()
            raise
        return _life_of(self).own(work, name=name)

    async def offload(
        self, function: Callable[..., T], *arguments: object, takes: float = 0.0, thread: bool = False
    ) -> T:
        """Run CPU work outside the event loop and wait for its result.

        It runs in a worker process (function and arguments must be picklable), or with ``thread=True`` in a thread, which helps only with
        code that releases the GIL. There are at most as many workers as cores. On the virtual clock the function runs at once, in the event
        loop's thread, and its result comes `takes` seconds later.
        """
        result: T = await _life_of(self).runtime.offload.run(function, arguments, takes, thread=thread)
        return result

    def threadsafe(self, function: Callable[P, object], *arguments: P.args, **keywords: P.kwargs) -> None:
        """From any thread: have the event loop call `function` soon, in the order of submission.

        An exception of it is this node's failure, as if a handler had raised it. Raises `RuntimeError` once the event loop is closed.
        """
        life = self.__machinery__
        if life is None:
            raise NotStarted(f"{type(self).__name__} has not been started yet")
        life.threadsafe(lambda: function(*arguments, **keywords))

    def checkpoint(self, state: object) -> None:
        """Keep `state`, a value that is not changed afterwards, for the next incarnation, also if this one crashes. See `resume`."""
        life = _life_of(self)
        life.check_thread()
        life.record.saved = state

    def stop(self, reason: str = "stopped itself") -> None:
        """Ask for this node's own orderly end. Its supervisor sees `Stopped(reason)`."""
        life = _life_of(self)
        life.check_use()
        life.request_stop(reason)

    def set_parameter(self, name: str, value: object) -> SetResult:
        """Set one parameter of this node; a refusal is a result that says why, not an exception."""
        return self.set_parameters({name: value})

    def set_parameters(self, values: Mapping[str, object]) -> SetResult:
        """Set parameters of this node, all or none of them."""
        if not isinstance(cast("object", values), Mapping):
            raise TypeError(
                f"{self.fqn}: set_parameters takes names and values, {{'speed': 1.0}}, not {type(values).__name__} {values!r:.60}"
            )
        life = _life_of(self)
        life.check_thread()
        return life.entering("parameters", life.parameters.set_values)(dict(values))

    def declare_parameter(
        self, name: str, value: object = None, descriptor: ParameterDescriptor | None = None
    ) -> Parameter:
        """Declare a parameter that the class does not declare, and return it with the value given at the start, or else with `value`.

        Raises what `ParameterStore.declare` raises.
        """
        life = _life_of(self)
        life.check_thread()
        return life.parameters.declare(name, value, descriptor)

    def get_parameter(self, name: str) -> Parameter:
        """A parameter by its name, with `type` and `value`; one that is not declared has neither, if the node allows such.

        Raises `ParameterNotDeclared`, and `ParameterUninitialized` for one that was declared without a value and has not been set.
        """
        return _life_of(self).parameters.get(name)

    def get_parameters_by_prefix(self, prefix: str) -> dict[str, Parameter]:
        """The parameters of a group, by their names without it: ``group`` has those that begin with ``group.``"""
        return _life_of(self).parameters.get_by_prefix(prefix)

    def has_parameter(self, name: str) -> bool:
        """Whether a parameter is declared, by the class or since."""
        return _life_of(self).parameters.has(name)


def _life_of(node: Node) -> Incarnation:
    if node.__machinery__ is None:
        raise NotStarted(
            f"{type(node).__name__} has not been started yet: use this in on_start or later, not in __init__"
        )
    return node.__machinery__


def _endpoints_of(node: Node) -> Endpoints:
    """The endpoints of the life of `node`, to add some. Raises `WrongThread` in a foreign thread, and `Ended` after the end of the life."""
    life = _life_of(node)
    life.check_use()
    return life.endpoints


Node.declarations = Declarations(Node)
