"""The lease: the old incarnation has ended before the new one may begin, whatever becomes of messages and clocks."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from actors.hosts.lease import ASKING, LEASE_SECONDS, STEP_DOWN, Granting, Holding

DRIFT = 0.001
"""By how much the rates of two clocks may differ, as the module says."""
KILL = 0.74
"""How long a kill may take, seconds, as the module says."""


@given(
    delays=st.lists(st.tuples(st.floats(0.0, 10.0), st.floats(0.0, 10.0), st.booleans()), min_size=1, max_size=30),
    offset=st.floats(-1e6, 1e6),
    drift=st.floats(-DRIFT / 2, DRIFT / 2),
)
def test_an_agent_has_killed_everything_before_the_tree_gives_it_up(
    delays: list[tuple[float, float, bool]], offset: float, drift: float
) -> None:
    """True time runs; the clock of the agent shows another time and is fast or slow, and so is that of the tree, the other way round."""

    def agents(at: float) -> float:
        return offset + at * (1.0 + drift)

    def trees(at: float) -> float:
        return at * (1.0 - drift)

    holding, granting = Holding(LEASE_SECONDS), Granting(LEASE_SECONDS)
    events: list[tuple[float, int, str]] = []
    asked, arrived, answered = 0.0, 0.0, 0.0
    for number, (there, back, lost) in enumerate(delays, 1):
        arrived = max(arrived, asked + there)  # in order
        answered = max(answered, arrived + back)
        events += [(asked, number, "ask"), (arrived, number, "grant")]
        if not lost:
            events.append((answered, number, "granted"))
        asked += ASKING * LEASE_SECONDS
    for at, number, what in sorted(events):
        if what == "ask":
            assert holding.ask(agents(at)) == number
        elif what == "grant":
            granting.grant(trees(at), 0.0)
        else:
            holding.granted(number)

    if holding.until:
        ended = (holding.until - offset) / (1.0 + drift) + KILL
        given_up = granting.until / (1.0 - drift)
        assert ended < given_up + 1e-6


def test_a_lease_counts_from_the_question() -> None:
    holding = Holding(4.0)
    first = holding.ask(100.0)
    second = holding.ask(101.0)

    holding.granted(first)
    assert holding.until == 100.0 + STEP_DOWN * 4.0
    assert holding.left(102.0) == 1.0
    assert holding.left(200.0) == 0.0

    holding.granted(second)
    assert holding.until == 101.0 + STEP_DOWN * 4.0


def test_an_agent_that_does_not_hear_the_tree_is_not_fresh() -> None:
    granting = Granting(4.0)

    granting.grant(100.0, 0.0)
    assert not granting.fresh(100.0)
    granting.grant(100.5, 2.4)
    assert granting.fresh(101.0)
    assert not granting.fresh(102.6)
    assert granting.until == 104.5


@pytest.mark.parametrize("lease", [1.0, 3.0, 60.0])
def test_silence_of_half_a_lease_does_no_harm(lease: float) -> None:
    assert (STEP_DOWN - ASKING) * lease > lease / 2
