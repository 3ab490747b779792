"""The three chains of callbacks run when parameters are set. In each chain, the callback added last runs first."""

from __future__ import annotations

from collections.abc import Callable, Generator, Iterable, Sequence
from contextlib import contextmanager
from typing import Any, Literal, TypeAlias, cast

from actors.checks import NoPublicConstructor, create
from actors.parameters.values import Parameter, SetResult

PreSetCallback: TypeAlias = Callable[[Sequence[Parameter]], Iterable[Parameter]]
"""Receives the parameters of a set and returns those to set instead. It may change, add and remove parameters."""
OnSetCallback: TypeAlias = Callable[[Sequence[Parameter]], SetResult]
"""Validates values that are not stored yet. The first refusal ends the chain. It must have no side effects."""
PostSetCallback: TypeAlias = Callable[[Sequence[Parameter]], None]
"""Receives values after they are stored and reported. It may have side effects."""

Kind: TypeAlias = Literal["pre", "on", "post"]


class CallbackHandle(metaclass=NoPublicConstructor):
    """One registered callback. `remove()` removes it from its chain; calling that twice is harmless.

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
        """Remove the callback. A set in progress still runs the chain with which it started."""
        self._chains.remove(self)


class CallbackChains:
    """The callbacks of one node.

    Invariants:

    * Chains are tuples, so adding or removing a callback does not affect a chain that is running.
    * `running` is true exactly while a callback runs.
    """

    __slots__ = ("on", "post", "pre", "running")

    def __init__(self) -> None:
        self.pre: tuple[CallbackHandle, ...] = ()
        self.on: tuple[CallbackHandle, ...] = ()
        self.post: tuple[CallbackHandle, ...] = ()
        self.running = False

    def add(self, kind: Kind, callback: Callable[..., Any]) -> CallbackHandle:
        """Add `callback` at the front of its chain."""
        handle = create(CallbackHandle, self, kind, callback)
        setattr(self, kind, (handle, *getattr(self, kind)))
        return handle

    def remove(self, handle: CallbackHandle) -> None:
        """Remove `handle` from its chain, if it is in it."""
        kept: tuple[CallbackHandle, ...] = getattr(self, handle.kind)
        setattr(self, handle.kind, tuple(other for other in kept if other is not handle))

    def rewrite(self, parameters: Sequence[Parameter]) -> tuple[Parameter, ...]:
        """Return the parameters as rewritten by the pre-set callbacks: the results of all of them, concatenated."""
        with self._run():
            return tuple(parameter for handle in self.pre for parameter in handle.callback(parameters))

    def validate(self, parameters: Sequence[Parameter]) -> SetResult:
        """Run the on-set callbacks. Returns the first refusal, whose reason is never replaced by a later one, or success.

        Raises TypeError if a callback returns anything but a SetResult.
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


def name_of(callback: Callable[..., object]) -> str:
    """The name of `callback` in reports."""
    return cast("str", getattr(callback, "__qualname__", None) or repr(callback))
