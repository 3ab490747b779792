"""Diagrams and a table of docs/concepts/ say what the code does: the states of a goal and of a child, and which qualities of service match."""

from __future__ import annotations

import re
from itertools import pairwise, product
from pathlib import Path
from typing import get_args

import pytest

from actors import (
    Child,
    Intensity,
    Node,
    QoS,
    Skip,
    Supervisor,
    background,
    every,
    rest_for_one,
    system_of,
    temporary,
)
from actors.actions.goals import GoalEvent, GoalStatus, next_status
from actors.qos import Durability, Liveliness, Policy, Reliability, compatible
from actors.supervision.refs import ChildState
from actors.testing import Rig
from tests.site.markdown import blocks

CONCEPTS = Path(__file__).parents[2] / "docs" / "concepts"
GOAL, CHILD = (
    code
    for page in ("topics-services-actions.md", "supervision.md")
    for language, code in blocks((CONCEPTS / page).read_text(encoding="utf-8"))
    if language == "mermaid"
)
ARROW = re.compile(r"^ *(\S+?)(?:\[.*?\])? --> (\w+)(?:\[.*?\])?(?:: (.*))?$", re.MULTILINE)


def test_the_states_of_a_goal_are_those_of_the_code_with_the_events_between_them() -> None:
    drawn = {(before, event, after) for before, after, event in ARROW.findall(GOAL)}
    coded = {
        (status.name, event.name, after.name)
        for status, event in product(GoalStatus, GoalEvent)
        if (after := next_status(status, event)) is not None
    }
    assert drawn == coded | {("[*]", "", "ACCEPTED")}
    assert {name for before, _, after in coded for name in (before, after)} == {one.name for one in GoalStatus} - {
        "UNKNOWN"
    }


@pytest.mark.parametrize(
    ("policy", "values"),
    [
        ("reliability", (Reliability.RELIABLE, Reliability.BEST_EFFORT)),
        ("durability", (Durability.TRANSIENT_LOCAL, Durability.VOLATILE)),
        ("liveliness", (Liveliness.MANUAL_BY_TOPIC, Liveliness.AUTOMATIC)),
    ],
)
def test_the_table_matches_an_offer_with_a_request_just_if_they_match(policy: str, values: tuple[Policy, ...]) -> None:
    page = (CONCEPTS / "topics-services-actions.md").read_text(encoding="utf-8").replace("best effort", "best_effort")
    page = page.replace("transient local", "transient_local").replace("manual by topic", "manual_by_topic")
    rows = re.findall(rf"^\| {policy} \| (\w+) \| (.*) \|$", page, re.MULTILINE)
    written = {(offer, request) for offer, requests in rows for request in requests.split(", ")}
    profiles = {value: QoS(depth=1, **{policy: value}) for value in values}  # type: ignore[arg-type]
    matching = {
        (offer.value, request.value)
        for offer, request in product(values, values)
        if compatible(profiles[offer], profiles[request])
    }
    assert written == matching


# -- the states of a child: all that a node sees of its siblings, at any moment -------------------------------------------------


class Watch(Node):
    """Writes down the states of all nodes, twenty times a second."""

    async def on_start(self) -> None:
        self.seen: dict[str, list[str]] = {}

    @every(hz=20)
    def look(self) -> None:
        for record in system_of(self).nodes.values():
            states = self.seen.setdefault(record.identity.name, ["[*]"])
            if states[-1] != record.state:
                states.append(record.state)


class Slow(Node):
    """Takes a second for its start and its end; `then` is raised three seconds after it is ready."""

    first: Exception | None = None
    then: Exception | None = None

    async def on_start(self) -> None:
        await self.clock.sleep(1.0)
        if self.first is not None:
            raise self.first

    @background
    async def work(self) -> None:
        await self.clock.sleep(3.0)
        if self.then is not None:
            raise self.then

    async def on_stop(self, reason: object) -> None:
        await self.clock.sleep(1.0)


class Broken(Slow):
    """Fails, and from its third life on in its start."""

    def __init__(self, lives: list[int]) -> None:
        super().__init__()
        self.lives = lives

    async def on_start(self) -> None:
        self.lives.append(1)
        await super().on_start()
        self.then = RuntimeError("out of order")
        if len(self.lives) > 2:
            raise self.then


class Absent(Slow):
    first = Skip("not today")


async def test_a_child_goes_along_the_arrows_and_each_arrow_is_taken_by_one(rig: Rig) -> None:
    children = [Child(Absent), Child(Slow, name="before"), Child(Broken, args=([],)), Child(Slow, name="after")]
    group = Supervisor(
        "group", strategy=rest_for_one, restart=temporary, intensity=Intensity(2, 60.0), children=children
    )
    rig.expect_failure(RuntimeError)
    await rig.start(Child(Watch), group)
    seen = rig.node(Watch).seen
    await rig.advance(30.0)
    gone = {step for name in ("absent", "before", "broken", "after") for step in pairwise(seen[name])}
    drawn = {(before, after) for before, after, _ in ARROW.findall(CHILD)}
    assert gone == drawn
    assert {after for _, after in drawn} == {*get_args(ChildState)}
