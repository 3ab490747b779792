"""A small number of the frames and requests of `python -m tests.hostile web`."""

from __future__ import annotations

from tests.hostile.web import attack, findings


async def test_hostile_frames_and_requests_do_no_harm_to_an_honest_client() -> None:
    outcome = await attack(800, 5)
    assert outcome.sent.total() >= 800 and len(outcome.told) > 2
    assert findings(outcome) == []
