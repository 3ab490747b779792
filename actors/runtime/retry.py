"""`retry`: send a request or a goal again after an error that may be temporary.

::

    result = await retry(self, MOVE, MoveToPosition.Goal(target_x=3.0), attempts=3, backoff=Backoff(0.5, 5.0))
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any, Final, overload

from actors.contracts.contracts import Service
from actors.errors import (
    ActionUnavailable,
    ActorError,
    CallTimeout,
    GoalAborted,
    NodeRestarting,
    ServiceUnavailable,
)
from actors.interfaces.message import F, G, R, Req, Resp
from actors.runtime.node import CALL_TIMEOUT, GOAL_TIMEOUT
from actors.supervision.policy import Backoff

if TYPE_CHECKING:
    from actors.contracts.contracts import Action
    from actors.runtime.node import Node


PASSING: Final[tuple[type[ActorError], ...]] = (
    GoalAborted,
    NodeRestarting,
    CallTimeout,
    ServiceUnavailable,
    ActionUnavailable,
)
"""The errors that may be temporary. All others are final: a rejection, a cancellation, a node that has stopped for good, a handler that
raised, a wrong type."""

BACKOFF: Final = Backoff(0.1, 5.0)
"""The delays between attempts: 0.1 s, 0.2 s, 0.4 s and so on up to 5 s, each lengthened at random by up to a fifth."""


@overload
async def retry(
    node: Node,
    contract: Service[Req, Resp],
    message: Req,
    *,
    attempts: int = 3,
    backoff: Backoff = BACKOFF,
    on: tuple[type[ActorError], ...] = PASSING,
    on_failure: Callable[[ActorError], object] | None = None,
    timeout: float | None = None,
) -> Resp: ...
@overload
async def retry(
    node: Node,
    contract: Action[G, R, F],
    message: G,
    *,
    attempts: int = 3,
    backoff: Backoff = BACKOFF,
    on: tuple[type[ActorError], ...] = PASSING,
    on_failure: Callable[[ActorError], object] | None = None,
    on_feedback: Callable[[F], object] | None = None,
    timeout: float | None = None,
) -> R: ...
async def retry(
    node: Node,
    contract: Service[Any, Any] | Action[Any, Any, Any],
    message: object,
    *,
    attempts: int = 3,
    backoff: Backoff = BACKOFF,
    on: tuple[type[ActorError], ...] = PASSING,
    on_failure: Callable[[ActorError], object] | None = None,
    on_feedback: Callable[[Any], object] | None = None,
    timeout: float | None = None,
) -> Any:
    """Call the service, or run the goal to its end, at most `attempts` times, and return the answer of the first attempt that succeeds.

    An attempt is repeated only after an error in `on`, and after the delay of `backoff` on the node's clock (its jitter is from the
    node's `rng`). `timeout`, in seconds, applies to each attempt, as for `Node.call` and `Node.send_goal`. Every failed attempt is logged
    and given to `on_failure`. The error of the last one is raised, with a note of the number of attempts and their duration. A request
    that timed out may have been served, and an aborted goal may have done a part of its work: use this for work that may be done twice.

    Raises `ValueError` if `attempts` is less than 1.
    """
    if attempts < 1:
        raise ValueError(f"retry(attempts={attempts}): there must be at least one attempt")
    began = node.clock.now()
    attempt = 0
    while True:
        attempt += 1
        try:
            if isinstance(contract, Service):
                return await node.call(contract, message, timeout=CALL_TIMEOUT if timeout is None else timeout)
            return await _run(node, contract, message, GOAL_TIMEOUT if timeout is None else timeout, on_feedback)
        except on as error:
            last = attempt == attempts
            wait = 0.0 if last else backoff.delay(attempt - 1, node.rng)
            node.log.warning(
                f"attempt {attempt} of {attempts} failed",
                contract=contract.name,
                error=f"{type(error).__name__}: {error}",
                again_in=None if last else round(wait, 3),
            )
            if on_failure is not None:
                on_failure(error)
            if last:
                often = "once" if attempts == 1 else f"{attempts} times"
                error.add_note(f"tried {often} in {node.clock.now() - began:.3f} s")
                raise
        await node.clock.sleep(wait)


async def _run(
    node: Node, action: Action[G, R, F], goal: G, timeout: float, on_feedback: Callable[[F], object] | None
) -> R:
    async with node.send_goal(action, goal, timeout=timeout) as running:
        if on_feedback is not None:
            async for feedback in running:
                on_feedback(feedback)
        return await running
