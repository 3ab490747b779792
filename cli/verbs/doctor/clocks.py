"""Clocks: simulated time that nobody gives, and times of day of several machines that differ."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final

from actors.names.names import is_hidden
from cli.graph.view import PUBLISHER, SUBSCRIPTION
from cli.parsing import count
from cli.verbs.doctor.observation import Finding, Observation

CLOCK: Final = "/clock"
NOTED_LAG: Final = 0.1
"""Seconds by which the clocks of two machines may differ before transforms and ages of messages are wrong."""
WRONG_LAG: Final = 1.0


def simulated_time(seen: Observation) -> Iterator[Finding]:
    """Whether the nodes that take their time from /clock get it, from one publisher. A node that does so subscribes to it."""
    takers = sorted({end.node for end in seen.of(SUBSCRIPTION, CLOCK) if not is_hidden(end.node)})
    givers = sorted({end.node for end in seen.of(PUBLISHER, CLOCK)})
    measured = (
        f"{count(len(givers), 'publisher')} of {CLOCK}, {count(len(takers), 'node')} that take their time from it"
    )
    if takers and not givers:
        yield Finding(
            CLOCK,
            f"{', '.join(takers)}: use_sim_time is set, and nobody publishes the time: it stands at 0, and timers never fire",
            measured,
            f"start the simulator or bag play --clock, or set use_sim_time to false: robactor param set {takers[0]} use_sim_time false",
        )
    if len(givers) > 1:
        yield Finding(
            CLOCK,
            f"{', '.join(givers)} publish it: the time jumps between theirs",
            measured,
            "let one of them publish it",
        )
    others = sorted({node.fqn for node in seen.here()} - {*takers, *givers})
    if takers and givers and others:
        yield Finding(
            CLOCK,
            f"{', '.join(others)}: the time of day, beside nodes with simulated time",
            measured,
            "start all nodes with -p use_sim_time:=true, or none",
            level="note",
        )


def offsets(seen: Observation) -> Iterator[Finding]:
    """Whether what others send comes from about now: the time of sending in their messages beside the time of day here."""
    for process in seen.processes:
        if process.session in seen.lags:
            subject = f"process {process.process} of {process.host}"
            yield from _judged(subject, seen.lags[process.session], "between sending and arrival of its reports")
    for name, heard in seen.listened.items():
        latched = any(end.about.qos.transient_local for end in seen.of(PUBLISHER, name))
        if heard.lag is not None and not latched:  # latched messages may be old
            yield from _judged(name, heard.lag, "between sending and arrival of its messages")


def _judged(subject: str, lag: float, between: str) -> Iterator[Finding]:
    if abs(lag) < NOTED_LAG:
        return
    cause = (
        "its clock is ahead of the one here"
        if lag < 0
        else "its clock is behind the one here, or it takes long to come"
    )
    yield Finding(
        subject,
        cause,
        f"at least {abs(lag):.3f} s {between}{', which has come before it was sent' if lag < 0 else ''}",
        "let both machines keep the time by NTP or PTP: chronyc tracking, timedatectl",
        level="problem" if abs(lag) >= WRONG_LAG else "note",
    )
