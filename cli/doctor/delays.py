"""What delays messages, as far as processes tell their figures: queues, ages, late timers, and handlers that block."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final

from actors.transport.figures import NodeFigures, QueueFigures
from cli.doctor.observation import Finding, Observation, Told
from cli.parsing import count
from cli.view import PUBLISHER, SUBSCRIPTION

__all__ = ["ages", "blocked", "queues", "restarts", "timers"]

OLD: Final = 0.2
"""Messages that have waited longer than this, in seconds, are late."""

SLOWEST: Final = 3
"""How many handlers are named of a process whose event loop is blocked."""


def queues(seen: Observation) -> Iterator[Finding]:
    """Each subscription that loses messages, because they come faster than they are handled."""
    for told, before, last in seen.figures():
        earlier = {(one.topic, one.handler): one.dropped for one in before.queues}
        for queue in last.queues:
            if not queue.dropped or not _asked_topic(seen, queue.topic):
                continue
            new = queue.dropped - earlier.get((queue.topic, queue.handler), queue.dropped)
            measured = f"{new} dropped in {told.seconds:.1f} s, {queue.dropped} so far; {_state(queue, last)}; {_profiles(seen, queue, last)}"
            if new > 0 and queue.depth > 1:
                yield Finding(
                    queue.topic,
                    f"{last.name} loses messages: they come faster than {queue.handler} handles them",
                    measured,
                    "a quicker handler, heavy work by offload(), concurrent=n, or depth 1 if only the newest counts",
                )
            else:
                newest = "only the newest counts, if that is meant" if queue.depth == 1 else "now and then"
                yield Finding(queue.topic, f"{last.name} has lost messages: {newest}", measured, "", "note")


def ages(seen: Observation) -> Iterator[Finding]:
    """Each node whose messages wait for long before they are handled."""
    for _, before, last in seen.figures():
        age = max(before.inbox_age, last.inbox_age)
        if age <= OLD:
            continue
        queue = max(last.queues, key=lambda one: one.waiting, default=None)
        fill = f"; {queue.topic}: {_state(queue, last)}" if queue is not None and queue.waiting else ""
        yield Finding(
            queue.topic if fill and queue is not None else last.name,
            f"messages are old when {last.name} handles them: its handlers take longer than messages take to come",
            f"one has waited {age:.2f} s; {count(last.waiting, 'item')} in the inbox{fill}",
            "a quicker handler, heavy work by offload(), or a shorter queue: depth 1 if only the newest counts",
        )


def timers(seen: Observation) -> Iterator[Finding]:
    """Each timer that loses ticks, because its node is busy when they are due."""
    for told, before, last in seen.figures():
        earlier = {one.handler: one for one in before.timers}
        for timer in last.timers:
            old = earlier.get(timer.handler)
            if old is None:
                continue
            missed, loop = timer.missed - old.missed, timer.blocked - old.blocked
            if missed > 0:
                why = "the event loop is blocked" if loop == missed else "its node is busy when they are due"
                yield Finding(
                    last.name,
                    f"the timer {timer.handler} loses ticks: {why}",
                    f"{count(missed, 'tick')} lost of {missed + timer.fired - old.fired} in {told.seconds:.1f} s, {timer.hz:g} Hz; "
                    f"slowest: {_slowest([last], 1)}",
                    "a quicker handler, heavy work by offload(), or a lower rate",
                )


def blocked(seen: Observation) -> Iterator[Finding]:
    """Each process whose event loop is blocked by a handler, which delays all its nodes."""
    concerned: dict[str, Told] = {told.last.session: told for told, _, _ in seen.figures()}
    for told in concerned.values():
        lost = 0
        for before, last in told.nodes():
            earlier = {one.handler: one.blocked for one in before.timers}
            lost += sum(one.blocked - earlier.get(one.handler, one.blocked) for one in last.timers)
        if lost > 0:
            yield Finding(
                f"process {told.last.process} of {told.last.host}",
                f"a handler blocks the event loop of {told.last.program}: it computes, sleeps or reads without an await",
                f"{count(lost, 'tick')} of its timers lost by that in {told.seconds:.1f} s; slowest: {_slowest(told.last.nodes, SLOWEST)}",
                "await, or heavy work by offload(); its log names the handler and the line",
            )


def restarts(seen: Observation) -> Iterator[Finding]:
    """Each node that has been restarted, or is not running."""
    for told, before, last in seen.figures():
        new = last.restarts - before.restarts
        if new > 0 or last.state not in ("running", "starting"):
            yield Finding(
                last.name,
                f"it is {last.state}, and ends with errors" if new else f"it is {last.state}",
                f"{count(new, 'restart')} in {told.seconds:.1f} s, {last.restarts} so far",
                "robactor log shows the exception",
            )
        elif last.restarts:
            yield Finding(last.name, "it has ended with an error", f"{count(last.restarts, 'restart')} so far",
                          "robactor log shows the next exception", "note")  # fmt: skip


def _asked_topic(seen: Observation, topic: str) -> bool:
    return seen.asked is None or seen.asked[0] != "topic" or seen.asked[1] == topic


def _state(queue: QueueFigures, node: NodeFigures) -> str:
    handler = next((one for one in node.handlers if one.handler == queue.handler), None)
    took = f", {queue.handler} takes {_ms(handler.mean)}, at most {_ms(handler.longest)}" if handler is not None else ""
    return f"{queue.waiting} of {queue.depth} waiting{took}"


def _profiles(seen: Observation, queue: QueueFigures, node: NodeFigures) -> str:
    offered = {repr(end.token.qos) for end in seen.of(PUBLISHER, queue.topic)}
    requested = {repr(end.token.qos) for end in seen.of(SUBSCRIPTION, queue.topic) if end.node == node.name}
    return f"offered {' or '.join(sorted(offered)) or 'by nobody'}, requested {' or '.join(sorted(requested)) or 'unknown'}"


def _slowest(nodes: list[NodeFigures] | tuple[NodeFigures, ...], most: int) -> str:
    measured = sorted(((one.longest, one.mean, one.handler) for node in nodes for one in node.handlers), reverse=True)
    named = [f"{handler} {_ms(mean)}, at most {_ms(longest)}" for longest, mean, handler in measured[:most]]
    return "; ".join(named) or "no handler is measured"


def _ms(seconds: float) -> str:
    return f"{seconds * 1000:.3g} ms"
