"""The planted systems: which they are, and what it takes to see their bugs."""

from __future__ import annotations

from typing import NamedTuple


class Case(NamedTuple):
    """One module of this folder."""

    name: str
    order: bool
    """Whether another order of events is enough; otherwise it takes a fault."""


CASES = [
    Case("lost_update", order=True),
    Case("two_leaders", order=True),
    Case("late_subscription", order=True),
    Case("ring", order=True),
    Case("starved", order=False),
    Case("reserved", order=True),
    Case("forgotten", order=False),
    Case("twice", order=False),
    Case("stale", order=False),
    Case("drift", order=False),
    Case("storm", order=False),
    Case("too_few", order=False),
    Case("watchdog", order=False),
    Case("aba", order=True),
    Case("half_configured", order=True),
    # of other kinds
    Case("lost_wakeup", order=True),
    Case("half_done", order=False),
    Case("old_answer", order=False),
    Case("lease", order=False),
    # on several hosts
    Case("split_brain", order=False),
    Case("lost_reconnect", order=False),
]
