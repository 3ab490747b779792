"""`open_node` and `BlockingNode`: a node that runs in the event loop of another thread, with methods that block the calling thread.

See `actors.blocking` for an example.
"""

from __future__ import annotations

import asyncio
import atexit
import contextlib
import threading
from collections.abc import Callable, Coroutine, Mapping, Sequence
from concurrent.futures import CancelledError, Future, InvalidStateError, wait
from queue import SimpleQueue
from types import TracebackType
from typing import TYPE_CHECKING, Any, TypeVar

from actors.actions.client import Goal
from actors.blocking.handles import BlockingGoal, BlockingStream
from actors.checks import NoPublicConstructor, create
from actors.contracts.content_filter import ContentFilter
from actors.contracts.contracts import Action, Service, Topic
from actors.errors import ActorError, Ended, NotRunning
from actors.interfaces.message import F, G, M, R, Req, Resp
from actors.logs import LogSink, NodeLog, structlog_sink
from actors.parameters.values import SetResult
from actors.qos.policies import QoS
from actors.running import run as running
from actors.running.signals import SigtermExit, exit_on_sigterm
from actors.running.trees import Runnable, tree_of
from actors.runtime.habits import Missing
from actors.runtime.node import CALL_TIMEOUT, GOAL_TIMEOUT, Node
from actors.system import System, system_here
from actors.topics.publisher import Publisher
from actors.topics.stream import Stream

T = TypeVar("T")


class InsideEventLoop(ActorError, RuntimeError):
    """A blocking call was made in a thread whose event loop runs nodes: await instead."""


def open_node(
    name: str,
    *,
    tree: Runnable | None = None,
    system: System | None = None,
    namespace: str = "",
    parameters: Mapping[str, object] | None = None,
    remap: Mapping[str, str] | None = None,
    seed: int = 0,
    sinks: tuple[LogSink, ...] = (structlog_sink,),
    argv: Sequence[str] | None = None,
) -> OpenBlockingNode:
    """Run a node for code without an event loop: ``with blocking.open_node("script") as node: ...``

    It runs in a background thread, together with `tree` if one is given; or, with `system`, in that running system, whose event loop
    must be that of another thread. Entering returns when node and tree are ready, and raises what `actors.run` and `actors.open_node`
    raise. Leaving ends the node (and the tree), joins the thread, and raises `SupervisorGaveUp` if the tree ended by itself meanwhile.
    `argv` are arguments for the tree, as for `actors.run`, or, without a tree, for the node, as for `actors.open_node`.
    """
    if tree is not None and system is not None:
        raise ValueError(f"blocking.open_node({name!r}): give a tree to run or a system that runs already, not both")
    whole = None if tree is None else tree_of(f"blocking.open_node({name!r}, tree=...)", tree)

    run = None if whole is None else running.run(whole, seed=seed, signals=False, sinks=sinks, argv=argv)
    node = running.open_node(
        name, namespace=namespace, parameters=parameters, remap=remap, system=system, seed=seed, sinks=sinks,
        argv=argv if whole is None else None,
    )  # fmt: skip
    return create(OpenBlockingNode, name, node, run, system.loop if system is not None else None)


class OpenBlockingNode(metaclass=NoPublicConstructor):
    """The context manager that `open_node` returns. It can be entered once.

    It has no public constructor: `open_node` gives one.

    Invariants:

    - `_life` is set when it is entered, and done when the node has ended; `_left` is done when the node is to end.
    - `_thread` and `_sigterm` are used only without a given system; the thread ends before `_end` returns.
    """

    def __init__(
        self,
        name: str,
        opened: running.OpenNode,
        run: running.Run | None,
        loop: asyncio.AbstractEventLoop | None,
    ) -> None:
        self._name = name
        self._opened = opened
        self._run = run
        self._loop = loop
        self._thread: threading.Thread | None = None
        self._sigterm: SigtermExit | None = None
        self._ready: Future[tuple[Node, asyncio.AbstractEventLoop]] = Future()
        self._left: Future[None] = Future()
        self._life: Future[None] | None = None

    def __enter__(self) -> BlockingNode:
        _refuse_in_loop(f"blocking.open_node({self._name!r})", "`async with actors.open_node(...) as node`")
        if self._life is not None:
            raise RuntimeError(f"blocking.open_node({self._name!r}) has been entered before: make another one")
        if self._loop is None:
            self._life = Future()
            # A daemon, because a program waits for other threads before it calls `atexit`, which ends this one.
            self._thread = threading.Thread(
                target=_complete, args=(self._life, self._live), name=f"actors {self._name}", daemon=True
            )
            atexit.register(self._end)
            self._sigterm = exit_on_sigterm()
            self._thread.start()
        else:
            self._life = asyncio.run_coroutine_threadsafe(self._live(), self._loop)
        self._life.add_done_callback(lambda _: self._ready.cancel())
        try:
            if self._sigterm is not None:
                self._sigterm.arm()
            node, loop = self._ready.result()
        except BaseException as error:
            self._end()
            if isinstance(error, CancelledError):
                self._life.result()  # raises why there is no node
            raise
        return create(BlockingNode, node, loop, self._life)

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        assert self._life is not None
        self._end()
        # It is canceled if the event loop of the system ended before this block did.
        if error is None and not self._life.cancelled():
            self._life.result()

    async def _live(self) -> None:
        """Run the tree and the node in one task of the event loop, which is canceled when the tree ends by itself."""
        async with contextlib.AsyncExitStack() as stack:
            if self._run is not None:
                await stack.enter_async_context(self._run)
            node = await stack.enter_async_context(self._opened)
            self._ready.set_result((node, asyncio.get_running_loop()))
            await asyncio.wrap_future(self._left)

    def _end(self) -> None:
        assert self._life is not None
        _set(self._left)
        wait([self._life])
        if self._thread is not None:
            self._thread.join()
            atexit.unregister(self._end)
        if self._sigterm is not None:
            self._sigterm.leave()
            self._sigterm = None


class BlockingNode(metaclass=NoPublicConstructor):
    """A node whose methods block until the event loop has the answer. Threads may use it, also at the same time.

    Ctrl-C during a call cancels what the call waits for. Timeouts are in seconds. Once the block is left, or the system has ended, all
    methods raise `Ended` or `NotRunning`; in a thread whose event loop runs nodes they raise `InsideEventLoop`.

    It has no public constructor: `open_node` gives one.

    Invariants: `_open` holds the calls that wait, each with its coroutine. When `_life` is done, all of them have been canceled, and no
    further call waits.
    """

    def __init__(self, node: Node, loop: asyncio.AbstractEventLoop, life: Future[None]) -> None:
        self._node = node
        self._loop = loop
        self._life = life
        self._publishers: dict[Topic[Any], Publisher[Any]] = {}
        self._streams: dict[Topic[Any], Stream[Any]] = {}
        self._open: dict[Future[Any], Coroutine[object, None, object]] = {}
        life.add_done_callback(self._ended)

    def __repr__(self) -> str:
        return f"<blocking {self._node!r}{', ended' if self._life.done() else ''}>"

    @property
    def name(self) -> str:
        """The node's name, without its namespace."""
        return self._node.name

    @property
    def namespace(self) -> str:
        return self._node.namespace

    @property
    def fqn(self) -> str:
        """The fully qualified name: namespace and name."""
        return self._node.fqn

    @property
    def log(self) -> NodeLog:
        return self._node.log

    def call(self, service: Service[Req, Resp], request: Req, *, timeout: float = CALL_TIMEOUT) -> Resp:
        """Ask a service and wait for its answer. Raises what `Node.call` raises."""
        return self._do(lambda node: node.call(service, request, timeout=timeout), "`await node.call(...)`")

    def publish(self, topic: Topic[M], message: M) -> None:
        """Publish one message; it has been handed to every subscription in the system when this returns."""

        async def work(node: Node) -> None:
            publisher = self._publishers.get(topic)
            if publisher is None:
                publisher = self._publishers[topic] = node.publisher(topic)
            publisher.publish(message)

        self._do(work, "`node.publisher(topic).publish(message)`")

    def subscribe(
        self,
        topic: Topic[M],
        *,
        qos: QoS | int | None = None,
        patience: float = 0.0,
        filter: ContentFilter | None = None,
    ) -> BlockingStream[M]:
        """Subscribe to `topic` from now on: ``for message in node.subscribe(TOPIC)``. `next` reads from the newest subscription."""

        async def work(node: Node) -> Stream[M]:
            stream = self._streams[topic] = node.subscribe(topic, qos=qos, patience=patience, filter=filter)
            return stream

        return create(BlockingStream, self._do, self._do(work, "`node.subscribe(topic)`"))

    def wait_for(self, *contracts: Service[Any, Any] | Action[Any, Any, Any], timeout: float | None = None) -> None:
        """Wait until all of these are served, at most `timeout` seconds. Raises what `Node.wait_for` raises."""
        self._do(lambda node: node.wait_for(*contracts, timeout=timeout), "`await node.wait_for(...)`")

    def set_parameter(self, name: str, value: object) -> SetResult:
        """Set one parameter of this node; a refusal is a result that says why."""
        return self.set_parameters({name: value})

    def set_parameters(self, values: Mapping[str, object]) -> SetResult:
        """Set parameters of this node, all or none of them."""

        async def work(node: Node) -> SetResult:
            return node.set_parameters(values)

        return self._do(work, "`node.set_parameters(...)`")

    def next(self, topic: Topic[M], *, timeout: float | None = None) -> M:
        """Wait for the next message of a topic. Messages are kept, in order, from the first `next` or `subscribe` on.

        Raises `CallTimeout` after `timeout` seconds without one.
        """

        async def work(node: Node) -> M:
            return await self._stream(node, topic).next(timeout)

        return self._do(work, "`await node.subscribe(topic).next()`")

    if not TYPE_CHECKING:
        start = Missing("start", ": a goal is sent by `with node.send_goal(ACTION, goal) as goal`")

    def send_goal(self, action: Action[G, R, F], goal: G, *, timeout: float = GOAL_TIMEOUT) -> BlockingGoal[R, F]:
        """A goal, to be entered by ``with``. `timeout`, in seconds, limits the wait for its acceptance; its execution has no limit.

        Entering raises `ActionUnavailable` and `GoalRejected`. Leaving cancels a goal that still runs, and waits for its clean-up.
        """

        async def work(node: Node) -> Goal[R, F]:
            return node.send_goal(action, goal, timeout=timeout)

        return create(BlockingGoal, self._do, self._do(work, "`async with node.send_goal(...) as goal`"))

    def run_goal(
        self,
        action: Action[G, R, F],
        goal: G,
        *,
        on_feedback: Callable[[F], object] | None = None,
        timeout: float = GOAL_TIMEOUT,
    ) -> R:
        """Send a goal, wait for its end and return its result. `timeout`, in seconds, limits the wait for its acceptance.

        `on_feedback` is called in this thread; while it runs, the newest ten feedback messages wait and older ones are lost. An exception
        of it, and Ctrl-C, cancel the goal. Raises `GoalRejected`, `GoalCanceled`, `GoalAborted`, `ActionUnavailable`, `NodeRestarting`,
        `NotRunning`.
        """
        turns: SimpleQueue[tuple[F, Future[None]] | None] = SimpleQueue()

        async def work(node: Node) -> R:
            async with node.send_goal(action, goal, timeout=timeout) as running:
                if on_feedback is not None:
                    async for feedback in running:
                        taken: Future[None] = Future()
                        turns.put((feedback, taken))
                        await asyncio.wrap_future(taken)
                return await running

        future = self._begin(work, "`async with node.send_goal(...) as goal`")
        future.add_done_callback(lambda _: turns.put(None))
        try:
            while on_feedback is not None and (turn := turns.get()) is not None:
                on_feedback(turn[0])
                _set(turn[1])
        except BaseException:
            self._forget(future)
            raise
        return self._finish(future)

    def run(self, work: Callable[[Node], Coroutine[object, None, T]]) -> T:
        """Run a coroutine function in the node's event loop and return its result: for all that has no method here.

        ``node.run(lambda node: node.wait_for(ADD, timeout=5.0))``
        """
        return self._do(work, "the coroutine itself")

    def _stream(self, node: Node, topic: Topic[M]) -> Stream[M]:
        stream = self._streams.get(topic)
        if stream is None:
            stream = self._streams[topic] = node.subscribe(topic)
        return stream

    def _do(self, work: Callable[[Node], Coroutine[object, None, T]], remedy: str) -> T:
        return self._finish(self._begin(work, remedy))

    def _begin(self, work: Callable[[Node], Coroutine[object, None, T]], remedy: str) -> Future[T]:
        _refuse_in_loop(f"{self!r}", remedy)
        if self._life.done():
            raise self._over()
        coroutine = work(self._node)
        try:
            future = asyncio.run_coroutine_threadsafe(coroutine, self._loop)
        except RuntimeError:  # the loop was closed in between
            coroutine.close()
            raise self._over() from None
        self._open[future] = coroutine
        if self._life.done():  # the node has ended in between: no call may wait for a loop that does not run
            future.cancel()
        return future

    def _finish(self, future: Future[T]) -> T:
        try:
            return future.result()
        except CancelledError:
            raise NotRunning(f"{self!r}: its system ended while this thread waited for it; open another one") from None
        finally:
            self._forget(future)

    def _forget(self, future: Future[Any]) -> None:
        future.cancel()  # after Ctrl-C, when the caller does not wait any more; else it is done already
        coroutine = self._open.pop(future, None)
        if coroutine is not None and self._loop.is_closed():
            coroutine.close()  # the loop may have ended before the first step of the coroutine

    def _over(self) -> Ended:
        return Ended(f"{self!r}: its block has been left or its system has ended; open another one")

    def _ended(self, life: Future[None]) -> None:
        for future in list(self._open):
            future.cancel()


def _complete(life: Future[None], live: Callable[[], Coroutine[object, None, None]]) -> None:
    try:
        running.execute(live)
    except BaseException as error:  # raised again in the thread that waits for `life`
        life.set_exception(error)
    else:
        life.set_result(None)


def _set(future: Future[None]) -> None:
    with contextlib.suppress(InvalidStateError):  # the waiting side has canceled it
        future.set_result(None)


def _refuse_in_loop(what: str, remedy: str) -> None:
    """Raise `InsideEventLoop` where nodes run in this thread. A loop without nodes, as that of a notebook's kernel, may wait."""
    try:
        nodes_run_here = system_here() is not None
    except RuntimeError:  # no event loop runs in this thread
        return
    if nodes_run_here:
        raise InsideEventLoop(
            f"{what} would block the event loop that runs in this thread, and the nodes in it: await instead, with {remedy}"
        )
