"""Twenty clients of which five never read and two send garbage, for a few seconds."""

from __future__ import annotations

import pytest

from tests.hostile.crowd import findings, watch


@pytest.mark.realtime
async def test_among_twenty_clients_those_who_read_lose_nothing_and_the_node_keeps_its_rate() -> None:
    outcome = await watch(5.0, readers=13, sleepers=5, vandals=2)
    assert len(outcome.late) > 900 and min(outcome.heard) > 900
    assert findings(outcome) == []
