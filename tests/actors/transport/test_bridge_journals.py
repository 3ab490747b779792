"""What a transport is asked for by the code of a journaled node is no work of that node: its timers, and the clocks it reads, are in no journal."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest

from actors import run
from actors.inbox.boundary import BOUNDARY
from actors.replay import Journal
from tests.actors.replay.story import HERO, OTHERS, Hero, Visitor, lived
from tests.actors.transport.hosts import Hosts
from tests.actors.transport.memory import End, In, Out, Serving, Shown

pytestmark = pytest.mark.virtual

ASKED = [
    (End, "announce"), (End, "outlet"), (End, "subscribe"), (End, "serve"), (Out, "put"), (Shown, "close"), (Out, "close"), (In, "close"),
    (Serving, "close"),
]  # fmt: skip


@pytest.fixture
def within(monkeypatch: pytest.MonkeyPatch) -> dict[str, set[object]]:
    """By the name of what a transport is asked for: the borders inside of which that was."""
    found: dict[str, set[object]] = {}
    for kind, name in ASKED:
        monkeypatch.setattr(kind, name, noting(getattr(kind, name), found.setdefault(f"{kind.__name__}.{name}", set())))
    return found


def noting(plain: Callable[..., Any], found: set[object]) -> Callable[..., Any]:
    def ask(*arguments: Any) -> Any:
        found.add(BOUNDARY.get())
        return plain(*arguments)

    return ask


async def test_a_transport_is_asked_by_the_system_not_by_the_journaled_node_whose_code_runs(
    hosts: Hosts, within: dict[str, set[object]]
) -> None:
    journal = Journal("hero")
    async with run(OTHERS, HERO, Visitor, transport=hosts.network.end(), observers=(journal,), sinks=()) as system:
        await lived(system, 0.3)
        assert system.node(Hero).incarnation == 2
    assert within == {f"{kind.__name__}.{name}": {None} for kind, name in ASKED}
