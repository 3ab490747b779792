"""The goal's form, for a type with everything in it. Run by `.ci/nightly --only browser`."""

from __future__ import annotations

from typing import Any

import pytest
from playwright.async_api import Locator, Page, expect

from actors import Action, Child, Done, Node, Reject, Steps, Supervisor
from actors.interfaces import load, to_plain
from tests.cli.web.browsing import browsing, until

pytestmark = [pytest.mark.browser]

Patrol: Any = load(
    "geometry_msgs/Point[] places\nuint8 laps 2\nfloat64[3] speeds\nbool loud true\nstring[] words\n---\nint32 done\n---\nint32 lap",
    "patrol_interfaces/action/Patrol",
)
PATROL: Action[Any, Any, Any] = Action(Patrol, "/patrol")


class Guard(Node):
    """Walks at most eight laps."""

    def __init__(self) -> None:
        self.goals: list[dict[str, Any]] = []

    @PATROL.accepts
    def check(self, goal: Any) -> None:
        if goal.laps > 8:
            raise Reject(f"laps: {goal.laps} are more than 8")

    @PATROL.serve()
    async def walk(self, goal: Any) -> Steps[Any, Any]:
        self.goals.append(to_plain(goal))
        yield Done(Patrol.Result(done=goal.laps))


def field(page: Page, label: str) -> Locator:
    return page.locator(".field", has=page.get_by_label(label))


async def test_every_kind_of_field_is_filled_in_and_arrives_as_it_was_written() -> None:
    async with browsing(tree=Supervisor("tree", children=[Child(Guard)])) as visit:
        await visit.open("goals?action=/patrol")
        page, guard = visit.page, visit.system.node(Guard)
        await expect(page.get_by_label("laps uint8")).to_have_value(
            "2", timeout=15_000
        )  # the default in the definition
        await expect(page.get_by_label("loud bool")).to_be_checked()
        places = page.get_by_role("group", name="places geometry_msgs/Point[]")
        for _ in range(3):
            await places.get_by_role("button", name="Add one").click()
        await places.get_by_role("button", name="Take out").nth(1).click()
        for index, (x, y) in enumerate((("1.5", "0"), ("-2", "1e-3"))):
            await places.get_by_label("x float64").nth(index).fill(x)
            await places.get_by_label("y float64").nth(index).fill(y)
        await page.get_by_label("speeds float64[3]").fill("0.1, 0.2, 0.3")
        await page.get_by_label("words string[]").fill("here, there")
        await page.get_by_label("loud bool").uncheck()
        await page.get_by_role("button", name="Send goal").click()
        await expect(page.locator(".run")).to_contain_text("succeeded")

    assert guard.goals == [
        {
            "places": [{"x": 1.5, "y": 0.0, "z": 0.0}, {"x": -2.0, "y": 0.001, "z": 0.0}],
            "laps": 2,
            "speeds": [0.1, 0.2, 0.3],
            "loud": False,
            "words": ["here", "there"],
        }
    ]


async def test_what_is_no_value_is_told_beside_its_field_and_so_is_what_the_node_refuses() -> None:
    async with browsing(tree=Supervisor("tree", children=[Child(Guard)])) as visit:
        await visit.open("goals?action=/patrol")
        page, guard = visit.page, visit.system.node(Guard)
        laps, speeds = page.get_by_label("laps uint8"), page.get_by_label("speeds float64[3]")
        send = page.get_by_role("button", name="Send goal")
        for text, reason in (
            ("300", "from 0 to 255"),
            ("1.5", '"1.5" is no whole number'),
            ("", '"" is no whole number'),
        ):
            await laps.fill(text)
            await send.click()
            await expect(field(page, "laps uint8").get_by_role("status")).to_have_text(reason)
            await expect(laps).to_have_attribute("aria-invalid", "true")
        await laps.fill("9")
        await speeds.fill("1, 2")
        await send.click()
        await expect(field(page, "laps uint8").locator(".reason")).to_have_text("")
        await expect(field(page, "speeds").get_by_role("status")).to_have_text("3 values are wanted, these are 2")
        await expect(page.locator(".run")).to_have_count(0)

        await speeds.fill("1, 2, 3")
        await send.click()
        await expect(page.locator(".run")).to_contain_text("refused")
        await expect(field(page, "laps uint8").get_by_role("status")).to_have_text("laps: 9 are more than 8")
        assert guard.goals == []
        await laps.fill("8")
        await send.click()
        await until(lambda: len(guard.goals) == 1)


async def test_a_goal_as_json_that_does_not_fit_its_type_is_told_of_and_stays() -> None:
    async with browsing(tree=Supervisor("tree", children=[Child(Guard)])) as visit:
        await visit.open("goals?action=/patrol")
        page = visit.page
        laps, turn, goal = (
            page.get_by_label("laps uint8"), page.get_by_role("button", name="As JSON"), page.get_by_label("Goal, as JSON")
        )  # fmt: skip
        await expect(laps).to_have_value("2", timeout=15_000)
        await turn.click()
        for text, reason in (
            ('{"places": 5}', "places: an array is wanted"),
            ('{"words": "x"}', "words: an array is wanted"),
        ):
            await goal.fill(text)
            await turn.click()
            await expect(page.get_by_text(reason)).to_be_visible()
            await expect(goal).to_be_visible()
        await goal.fill('{"laps": 3}')
        await turn.click()
        await expect(laps).to_have_value("3")
        await expect(goal).to_be_hidden()
