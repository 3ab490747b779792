"""Arrival policies: whether a goal is accepted while other goals wait or run."""

from __future__ import annotations

from actors.contracts.contracts import ArrivalPolicy


def places(arrivals: ArrivalPolicy) -> int:
    """The number of goals that may run at once."""
    return arrivals.size if arrivals.policy == "parallel" else 1


def refusal(arrivals: ArrivalPolicy, waiting: int, running: int) -> str | None:
    """Why a goal that arrives now is rejected; None if it is accepted. A goal that preempts others is always accepted."""
    policy, size = arrivals.policy, arrivals.size
    if policy == "queue" and waiting >= size:
        return f"the queue is full: {size} goals wait"
    if policy == "parallel" and waiting + running >= size:
        return f"{size} goals run already"
    if policy == "reject" and waiting + running:
        return "another goal is running"
    return None
