"""What all filters share: callbacks and streams that get what a filter lets through."""

from __future__ import annotations

import inspect
from collections import deque
from collections.abc import Callable
from typing import Generic, TypeVar
from weakref import WeakSet

from actors.checks import NoPublicConstructor, create
from actors.waiting import Waiters

T = TypeVar("T")

DEPTH = 10
"""The default of how many items a stream keeps for a slow reader."""


class Connection(metaclass=NoPublicConstructor):
    """A callback that is registered with a filter, until `disconnect`.

    It has no public constructor: `SimpleFilter.register_callback` and `Synchronizer.register_callback` give one.
    """

    __slots__ = ("_connections", "_deliver")

    def __init__(self, connections: list[Connection], deliver: Callable[..., object]) -> None:
        self._connections = connections
        self._deliver = deliver
        connections.append(self)

    def __call__(self, *messages: object) -> None:
        self._deliver(*messages)

    def disconnect(self) -> None:
        """Call it no more. A second call is harmless."""
        if self in self._connections:
            self._connections.remove(self)


class FilterStream(Generic[T], metaclass=NoPublicConstructor):
    """What a filter lets through, as an async iterator: from the moment it is created, the last `depth` items for a slow reader.

    Iteration stops with `close()`, at the end of an ``async with`` block, and when the node that feeds the filter ends.

    It has no public constructor: `SimpleFilter.stream` gives one, and so does ``async for`` over a filter.
    """

    def __init__(self, depth: int) -> None:
        if depth < 1:
            raise ValueError(f"stream(depth={depth}): a stream keeps at least one item")
        self._items: deque[T] = deque(maxlen=depth)
        self._waiters = Waiters()
        self._closed = False
        self.dropped = 0
        """The number of items lost because the reader was too slow."""

    def __aiter__(self) -> FilterStream[T]:
        return self

    async def __anext__(self) -> T:
        while not self._items:
            if self._closed:
                raise StopAsyncIteration
            await self._waiters.wait()
        return self._items.popleft()

    async def __aenter__(self) -> FilterStream[T]:
        return self

    async def __aexit__(self, *exc: object) -> None:
        self.close()

    def close(self) -> None:
        """End it. Items that wait can still be taken out."""
        self._closed = True
        self._waiters.wake_all()

    def push(self, item: T) -> None:
        """Take in an item, unless the stream is closed."""
        if self._closed:
            return
        self.dropped += len(self._items) == self._items.maxlen
        self._items.append(item)
        self._waiters.wake_all()


class Signal(Generic[T]):
    """Calls each callback, in the order of registration, and then feeds each stream, with every item.

    Invariant: once it is closed, its streams are closed, a new one is closed from the beginning, and no callback is called.
    """

    def __init__(self) -> None:
        self._connections: list[Connection] = []
        self._streams: WeakSet[FilterStream[T]] = WeakSet()  # one that nobody refers to any more needs nothing
        self._on_close: list[Callable[[], object]] = []
        self._closed = False

    def register_callback(self, callback: Callable[..., object], *arguments: object) -> Connection:
        """Call `callback` with what the filter lets through, followed by `arguments`.

        It is a plain function: what it would await for belongs into a task with ``async for ... in filter``. Raises ``TypeError`` for an
        ``async def``.
        """
        if inspect.iscoroutinefunction(callback):
            name = getattr(callback, "__qualname__", repr(callback))
            raise TypeError(
                f"{type(self).__name__}.register_callback({name}): a callback of a filter is a plain function; "
                f"for `await`, iterate in a task of the node: async for ... in this filter"
            )
        return create(Connection, self._connections, lambda *messages: callback(*messages, *arguments))

    registerCallback = register_callback
    """The name that rclpy's has."""

    def stream(self, depth: int = DEPTH) -> FilterStream[T]:
        """What is let through from now on; the last `depth` items wait for a slow reader."""
        stream: FilterStream[T] = create(FilterStream, depth)  # pyright: ignore[reportUnknownVariableType]
        if self._closed:
            stream.close()
        self._streams.add(stream)
        return stream

    def __aiter__(self) -> FilterStream[T]:
        return self.stream()

    def on_close(self, callback: Callable[[], object]) -> None:
        """Call `callback` when this filter is closed."""
        self._on_close.append(callback)

    def close(self) -> None:
        """Nothing comes any more: end the streams, and what this filter feeds. A second call is harmless."""
        if self._closed:
            return
        self._closed = True
        for stream in tuple(self._streams):
            stream.close()
        for callback in self._on_close:
            callback()

    def _emit(self, messages: tuple[object, ...], item: T) -> None:
        if self._closed:
            return
        for connection in tuple(self._connections):
            connection(*messages)
        for stream in tuple(self._streams):
            stream.push(item)
