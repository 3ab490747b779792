"""A small blocking face for scripts, notebooks and threads, which have no event loop to await in.

::

    from actors import blocking

    with blocking.open_node("script", tree=tree()) as node:
        print(node.call(BATTERY, GetBatteryStatus.Request(robot_id="robot_01")))
        node.publish(CMD_VEL, Twist())
        scan = node.next(SCAN, timeout=2.0)
        result = node.run_goal(MOVE, MoveToPosition.Goal(target_x=3.0), on_feedback=print)

The node lives in the event loop of a background thread, or in that of a system which runs in another thread. Inside an event loop
everything here is refused at once, because blocking there would stop the very loop that has to bring the answer.
"""

from __future__ import annotations

import asyncio
import contextlib
from collections.abc import Callable, Coroutine, Mapping
from concurrent.futures import CancelledError, Future, InvalidStateError, ThreadPoolExecutor, wait
from queue import SimpleQueue
from types import TracebackType
from typing import TYPE_CHECKING, Any, TypeVar

from actors import running
from actors.errors import ActorError, NotRunning, NotStarted
from actors.logs import LogSink, structlog_sink
from actors.node import CALL_TIMEOUT, GOAL_TIMEOUT, Node
from actors.trees import tree_of

if TYPE_CHECKING:
    from actors.channel import Publisher
    from actors.contracts import Action, Service, Topic
    from actors.interfaces.message import Message
    from actors.stream import Stream
    from actors.system import System
    from actors.trees import Runnable

__all__ = ["BlockingNode", "InsideEventLoop", "OpenBlockingNode", "open_node"]

M = TypeVar("M", bound="Message")
G = TypeVar("G", bound="Message")
R = TypeVar("R", bound="Message")
F = TypeVar("F", bound="Message")
Req = TypeVar("Req", bound="Message")
Resp = TypeVar("Resp", bound="Message")
T = TypeVar("T")


class InsideEventLoop(ActorError, RuntimeError):
    """A blocking call was made where an event loop runs: await instead."""


def open_node(
    name: str,
    *,
    tree: Runnable | None = None,
    system: System | None = None,
    namespace: str = "",
    parameters: Mapping[str, Any] | None = None,
    remap: Mapping[str, str] | None = None,
    seed: int = 0,
    sinks: tuple[LogSink, ...] = (structlog_sink,),
) -> OpenBlockingNode:
    """A node for code without an event loop: ``with blocking.open_node("script") as node: ...``

    It lives in a background thread, together with `tree` if one is given; or, with `system`, in that running system, whose event loop
    is another thread's. Entering returns when node and tree are ready and raises what `actors.run` and `actors.open_node` raise.
    Leaving ends the node (and the tree), joins the thread and raises `SupervisorGaveUp` if the tree ended by itself meanwhile.
    """
    if tree is not None and system is not None:
        raise ValueError(f"blocking.open_node({name!r}): give a tree to run or a system that runs already, not both")
    whole = None if tree is None else tree_of(f"blocking.open_node({name!r}, tree=...)", tree)

    def opened() -> running.OpenNode:
        return running.open_node(
            name, namespace=namespace, parameters=parameters, remap=remap, system=system, seed=seed, sinks=sinks
        )

    def ran() -> running.Run | None:
        return None if whole is None else running.run(whole, seed=seed, signals=False, sinks=sinks)

    return OpenBlockingNode(name, opened, ran, system.loop if system is not None else None)


class OpenBlockingNode:
    """What `open_node` returns: a context manager, to be entered once."""

    def __init__(
        self,
        name: str,
        opened: Callable[[], running.OpenNode],
        ran: Callable[[], running.Run | None],
        loop: asyncio.AbstractEventLoop | None,
    ) -> None:
        self._name = name
        self._opened = opened
        self._ran = ran
        self._loop = loop
        self._thread: ThreadPoolExecutor | None = None
        self._ready: Future[tuple[Node, asyncio.AbstractEventLoop]] = Future()
        self._left: Future[None] = Future()
        self._life: Future[None] | None = None

    def __enter__(self) -> BlockingNode:
        _refuse_in_loop(f"blocking.open_node({self._name!r})", "`async with actors.open_node(...) as node`")
        if self._life is not None:
            raise RuntimeError(f"blocking.open_node({self._name!r}) has been entered before: make another one")
        if self._loop is None:
            self._thread = ThreadPoolExecutor(1, thread_name_prefix=f"actors {self._name}")
            self._life = self._thread.submit(running.execute, self._live)
        else:
            self._life = asyncio.run_coroutine_threadsafe(self._live(), self._loop)
        self._life.add_done_callback(lambda _: self._ready.cancel())
        try:
            node, loop = self._ready.result()
        except BaseException as error:
            self._end()
            if isinstance(error, CancelledError):
                self._life.result()  # raises why there is no node
            raise
        return BlockingNode(node, loop, self._life)

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        assert self._life is not None
        self._end()
        if (
            error is None and not self._life.cancelled()
        ):  # canceled: the system's event loop ended before this block did
            self._life.result()

    async def _live(self) -> None:
        """The life of the node, in one task of its event loop, so that what ends the tree ends this, too."""
        async with contextlib.AsyncExitStack() as stack:
            if (run := self._ran()) is not None:
                await stack.enter_async_context(run)
            node = await stack.enter_async_context(self._opened())
            self._ready.set_result((node, asyncio.get_running_loop()))
            await asyncio.wrap_future(self._left)

    def _end(self) -> None:
        assert self._life is not None
        _set(self._left)
        wait([self._life])
        if self._thread is not None:
            self._thread.shutdown()


class BlockingNode:
    """A node whose methods block until they have what they are asked for. Any thread without an event loop may use it.

    Ctrl-C while one of them waits cancels what it waits for. Times are seconds on the node's clock. Once the block is left, or the
    system has ended, everything raises `NotStarted` or `NotRunning`.
    """

    def __init__(self, node: Node, loop: asyncio.AbstractEventLoop, life: Future[None]) -> None:
        self._node = node
        self._loop = loop
        self._life = life
        self._publishers: dict[Topic[Any], Publisher[Any]] = {}
        self._streams: dict[Topic[Any], Stream[Any]] = {}
        self._open: dict[Future[Any], Coroutine[Any, Any, Any]] = {}
        life.add_done_callback(self._ended)

    def __repr__(self) -> str:
        return f"<blocking {self._node!r}{', ended' if self._life.done() else ''}>"

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

    def listen(self, *topics: Topic[Any]) -> None:
        """Keep what is published on these topics from now on, each as deep as its quality of service says, for `next`."""

        async def work(node: Node) -> None:
            for topic in topics:
                self._stream(node, topic)

        self._do(work, "`node.subscribe(topic)`")

    def next(self, topic: Topic[M], *, timeout: float | None = None) -> M:
        """The next message of a topic, in order, from the first `next` or `listen` on.

        Raises `CallTimeout` after `timeout` seconds without one.
        """

        async def work(node: Node) -> M:
            return await self._stream(node, topic).next(timeout)

        return self._do(work, "`await node.subscribe(topic).next()`")

    def run_goal(
        self,
        action: Action[G, R, F],
        goal: G,
        *,
        on_feedback: Callable[[F], object] | None = None,
        timeout: float = GOAL_TIMEOUT,
    ) -> R:
        """Send a goal, wait for its end and give its result; `timeout` bounds the wait for its acceptance.

        `on_feedback` is called in this thread; while it works the newest ten wait and older ones are lost. What it raises, and Ctrl-C,
        cancels the goal. Raises `GoalRejected`, `GoalCanceled`, `GoalAborted`, `ActionUnavailable`, `NodeRestarting`, `NotRunning`.
        """
        turns: SimpleQueue[tuple[F, Future[None]] | None] = SimpleQueue()

        async def work(node: Node) -> R:
            async with node.start(action, goal, timeout=timeout) as running:
                if on_feedback is not None:
                    async for feedback in running:
                        taken: Future[None] = Future()
                        turns.put((feedback, taken))
                        await asyncio.wrap_future(taken)
                return await running

        future = self._begin(work, "`async with node.start(...) as goal`")
        future.add_done_callback(lambda _: turns.put(None))
        try:
            while on_feedback is not None and (turn := turns.get()) is not None:
                on_feedback(turn[0])
                _set(turn[1])
        except BaseException:
            self._forget(future)
            raise
        return self._finish(future)

    def run(self, work: Callable[[Node], Coroutine[Any, Any, T]]) -> T:
        """Run a coroutine function of the node in its event loop and wait for what it returns: for all that has no method here.

        ``node.run(lambda node: node.wait_for(ADD, timeout=5.0))``
        """
        return self._do(work, "the coroutine itself")

    def _stream(self, node: Node, topic: Topic[M]) -> Stream[M]:
        stream = self._streams.get(topic)
        if stream is None:
            stream = self._streams[topic] = node.subscribe(topic)
        return stream

    def _do(self, work: Callable[[Node], Coroutine[Any, Any, T]], remedy: str) -> T:
        return self._finish(self._begin(work, remedy))

    def _begin(self, work: Callable[[Node], Coroutine[Any, Any, T]], remedy: str) -> Future[T]:
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
        if self._life.done():  # it has ended in between: nobody may wait for a loop that has ended
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
        future.cancel()  # Ctrl-C: nobody waits for it any more; else it is done already
        coroutine = self._open.pop(future, None)
        if coroutine is not None and self._loop.is_closed():
            coroutine.close()  # the loop may have ended before it began

    def _over(self) -> NotStarted:
        return NotStarted(f"{self!r}: its block has been left or its system has ended; open another one")

    def _ended(self, life: Future[None]) -> None:
        for future in list(self._open):
            future.cancel()


def _set(future: Future[None]) -> None:
    with contextlib.suppress(InvalidStateError):  # who waited for it has been canceled
        future.set_result(None)


def _refuse_in_loop(what: str, remedy: str) -> None:
    try:
        asyncio.get_running_loop()
    except RuntimeError:
        return
    raise InsideEventLoop(f"{what} would block the event loop that runs in this thread: await instead, with {remedy}")
