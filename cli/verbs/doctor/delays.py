"""What delays messages, as far as processes tell their figures: queues, ages, late timers, and handlers that block."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final

from actors.transport.figures import NodeFigures, QueueFigures
from cli.graph.view import PUBLISHER, SUBSCRIPTION
from cli.parsing import count
from cli.verbs.doctor.observation import Finding, Observation, Told

OLD: Final = 0.2
"""Messages that have waited longer than this, in seconds, are late."""

FEW: Final = 0.05
"""A timer that loses at most this share of its ticks is only noted: the machine may be busy."""

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
    """Each queue and inbox in which messages wait for long before they are handled."""
    for told, before, last in seen.figures():
        measured = max(before.inbox_age, last.inbox_age)
        found = False
        for queue, age, rate in _old_queues(told, before, last):
            found = True
            if _asked_topic(seen, queue.topic):
                yield Finding(
                    queue.topic,
                    f"messages are old when {last.name} handles them: its handlers take longer than messages take to come",
                    f"{age:.2f} s from the oldest to the newest that waits, by {rate:.1f} Hz of arrivals; {_state(queue, last)}",
                    "a quicker handler, heavy work by offload(), or a shorter queue: depth 1 if only the newest counts",
                )
        if measured > OLD and not found:
            yield Finding(
                last.name,
                "what comes to it waits for long, because its handlers take long",
                f"one item has waited {measured:.2f} s; {count(last.waiting, 'item')} in the inbox; slowest: {_slowest([last], 1)}",
                "quicker handlers, or heavy work by offload()",
            )


def _old_queues(told: Told, before: NodeFigures, last: NodeFigures) -> Iterator[tuple[QueueFigures, float, float]]:
    """Each queue whose messages wait for long, for how long, and how many come a second.

    A message that comes regularly and is the n-th of those that wait has come n - 1 intervals after the first. One that waits alone may just
    have come, so a queue counts only if several have waited both times.
    """
    earlier = {(one.topic, one.handler): one for one in before.queues}
    for queue in last.queues:
        old = earlier.get((queue.topic, queue.handler))
        if old is None or told.seconds <= 0 or queue.received <= old.received:
            continue
        rate = (queue.received - old.received) / told.seconds
        age = (min(queue.waiting, old.waiting) - 1) / rate
        if age > OLD:
            yield queue, age, rate


def timers(seen: Observation) -> Iterator[Finding]:
    """Each timer that loses ticks, because its node is busy when they are due."""
    for told, before, last in seen.figures():
        earlier = {one.handler: one for one in before.timers}
        for timer in last.timers:
            old = earlier.get(timer.handler)
            if old is None:
                continue
            missed, loop = timer.missed - old.missed, timer.blocked - old.blocked
            due = missed + timer.fired - old.fired
            if missed > 0 and not (loop == missed and told.is_starved):
                why = "the event loop comes too late" if loop == missed else "its node is busy when they are due"
                yield Finding(
                    last.name,
                    f"the timer {timer.handler} loses ticks: {why}",
                    f"{count(missed, 'tick')} lost of {due} in {told.seconds:.1f} s, {timer.hz:g} Hz; slowest: {_slowest([last], 1)}",
                    "a quicker handler, heavy work by offload(), or a lower rate",
                    "problem" if missed > FEW * due else "note",
                )


def blocked(seen: Observation) -> Iterator[Finding]:
    """Each process whose event loop is blocked by a handler, which delays all its nodes."""
    concerned: dict[str, Told] = {told.last.session: told for told, _, _ in seen.figures()}
    for told in concerned.values():
        lost = due = 0
        for before, last in told.nodes():
            earlier = {one.handler: one for one in before.timers}
            for timer in last.timers:
                old = earlier.get(timer.handler, timer)
                lost += timer.blocked - old.blocked
                due += timer.fired - old.fired + timer.missed - old.missed
        if lost > 0 and told.is_starved:
            got = (told.last.cpu - told.before.cpu) / told.seconds
            yield Finding(
                f"process {told.last.process} of {told.last.host}",
                f"{told.last.program} got {got:.0%} of a core, and its timers are late: it waits for a processor",
                f"for {told.last.starved - told.before.starved:.1f} of {told.seconds:.1f} s; {count(lost, 'tick')} of {due} of its timers lost",
                "end other programs, give it more of the machine, or ask less of it",
                "problem" if lost > FEW * due else "note",
            )
        elif lost > 0:
            yield Finding(
                f"process {told.last.process} of {told.last.host}",
                f"the event loop of {told.last.program} comes too late: a handler computes, sleeps or reads without an await, or the "
                "machine is too busy",
                f"{count(lost, 'tick')} of {due} of its timers lost by that in {told.seconds:.1f} s; slowest: {_slowest(told.last.nodes, SLOWEST)}",
                "await, or heavy work by offload(); its log names the handler and the line; robactor top shows its share of a core",
                "problem" if lost > FEW * due else "note",
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
    offered = {repr(end.about.qos) for end in seen.of(PUBLISHER, queue.topic)}
    requested = {repr(end.about.qos) for end in seen.of(SUBSCRIPTION, queue.topic) if end.node == node.name}
    return f"offered {' or '.join(sorted(offered)) or 'by nobody'}, requested {' or '.join(sorted(requested)) or 'unknown'}"


def _slowest(nodes: list[NodeFigures] | tuple[NodeFigures, ...], most: int) -> str:
    measured = sorted(((one.longest, one.mean, one.handler) for node in nodes for one in node.handlers), reverse=True)
    named = [f"{handler} {_ms(mean)}, at most {_ms(longest)}" for longest, mean, handler in measured[:most]]
    return "; ".join(named) or "no handler is measured"


def _ms(seconds: float) -> str:
    return f"{seconds * 1000:.3g} ms"
