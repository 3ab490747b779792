"""The three chains of callbacks around setting parameters. In every chain the one added last runs first."""

from __future__ import annotations

from collections.abc import Callable, Generator, Iterable, Sequence
from contextlib import contextmanager
from typing import Any, Literal, TypeAlias, cast

from actors.parameters.values import Parameter, SetResult

PreSetCallback: TypeAlias = Callable[[Sequence[Parameter]], Iterable[Parameter]]
"""Gets the parameters of a set, gives those to set instead: may change, add and drop."""
OnSetCallback: TypeAlias = Callable[[Sequence[Parameter]], SetResult]
"""Validates values that are not stored yet; the first refusal stops the chain. Must have no side effects."""
PostSetCallback: TypeAlias = Callable[[Sequence[Parameter]], None]
"""Sees values that are stored and reported: the place for side effects."""

Kind: TypeAlias = Literal["pre", "on", "post"]


class CallbackHandle:
    """One registered callback; `remove()` takes it off its chain (a second time does nothing).

    It has no public constructor: the `add_*_callback` methods of a `ParameterStore` give one.
    """

    __slots__ = ("_chains", "callback", "kind")

    def __init__(self, chains: CallbackChains, kind: Kind, callback: Callable[..., Any]) -> None:
        self._chains = chains
        self.kind: Kind = kind
        self.callback = callback

    def __repr__(self) -> str:
        return f"<{self.kind}-set callback {name_of(self.callback)}>"

    def remove(self) -> None:
        """Take the callback off. A set that is under way still runs the chain it started with."""
        self._chains.remove(self)


class CallbackChains:
    """The callbacks of one node.

    Invariants: the chains are tuples, so running one is not disturbed by adding or removing; `running` is true exactly while a callback runs.
    """

    __slots__ = ("on", "post", "pre", "running")

    def __init__(self) -> None:
        self.pre: tuple[CallbackHandle, ...] = ()
        self.on: tuple[CallbackHandle, ...] = ()
        self.post: tuple[CallbackHandle, ...] = ()
        self.running = False

    def add(self, kind: Kind, callback: Callable[..., Any]) -> CallbackHandle:
        """Put `callback` first in its chain."""
        handle = CallbackHandle(self, kind, callback)
        setattr(self, kind, (handle, *getattr(self, kind)))
        return handle

    def remove(self, handle: CallbackHandle) -> None:
        """Drop `handle` from its chain, if it is there."""
        kept: tuple[CallbackHandle, ...] = getattr(self, handle.kind)
        setattr(self, handle.kind, tuple(other for other in kept if other is not handle))

    def rewrite(self, parameters: Sequence[Parameter]) -> tuple[Parameter, ...]:
        """The list as rewritten by the pre-set callbacks: the answers of all of them, concatenated."""
        with self._run():
            return tuple(parameter for handle in self.pre for parameter in handle.callback(parameters))

    def validate(self, parameters: Sequence[Parameter]) -> SetResult:
        """Ask the on-set callbacks. The first refusal is the answer, so its reason is never overwritten by a later one.

        Raises TypeError when a callback answers anything but a SetResult.
        """
        for handle in self.on:
            with self._run():
                result = handle.callback(parameters)
            if not isinstance(result, SetResult):
                raise TypeError(
                    f"the on-set callback {name_of(handle.callback)} answered {result!r}; "
                    "return SetResult() to accept or SetResult(False, reason) to refuse."
                )
            if not result.successful:
                return result
        return SetResult()

    def tell(self, parameters: Sequence[Parameter]) -> None:
        """Run the post-set callbacks."""
        with self._run():
            for handle in self.post:
                handle.callback(parameters)

    @contextmanager
    def _run(self) -> Generator[None]:
        self.running = True
        try:
            yield
        finally:
            self.running = False


def name_of(callback: Callable[..., Any]) -> str:
    """The name under which to report `callback`."""
    return cast("str", getattr(callback, "__qualname__", None) or repr(callback))
