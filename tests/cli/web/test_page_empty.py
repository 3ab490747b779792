"""What the page shows of a graph that is small, empty or elsewhere, and of words that are not quite right. Run by `.ci/nightly --only browser`."""

from __future__ import annotations

import re

import pytest
from playwright.async_api import expect

from actors import Child, Node, Service, Supervisor, Topic, every, publishes
from actors.interfaces.std_msgs.msg import String
from actors.interfaces.std_srvs.srv import Trigger
from tests.cli.web.browsing import PHONE, browsing, node

pytestmark = [pytest.mark.browser]


class Heard(Node):
    """Takes what the talker says."""

    @Topic(String, "/chatter").on()
    def hear(self, message: String) -> None: ...


class Said(Node):
    """Says something, ten times a second."""

    chatter = publishes(Topic(String, "/chatter"))

    @every(hz=10)
    def say(self) -> None:
        self.chatter(String(data="something"))


def elsewhere(*nodes: type[Node]) -> Supervisor:
    """Nodes in a process of their own."""
    apart = Supervisor("apart", process=True, children=[Child(node) for node in nodes])
    return Supervisor("tree", children=[apart])


async def test_a_few_nodes_are_all_shown_with_the_lives_and_rates_that_their_process_tells() -> None:
    async with browsing(tree=elsewhere(Said, Heard)) as visit:
        await visit.open("")  # without a robot the graph comes first
        page = visit.page
        await expect(page.get_by_label("Hide the quiet ones")).not_to_be_checked()
        await expect(page.get_by_role("button", name=re.compile(r"chatter (9|10|11)(\.\d)? Hz"))).to_be_visible()
        leaf = page.locator(".leaf", has=page.get_by_role("button", name="said", exact=True))
        await expect(leaf.locator(".dot.on")).to_be_visible()
        await expect(leaf).to_contain_text("#1")
        await expect(page.locator(".item")).not_to_have_text([re.compile("_robactor")])


async def test_a_lone_publisher_is_shown_and_without_a_node_the_graph_says_so() -> None:
    async with browsing(tree=Supervisor("tree", children=[Child(Said)])) as visit:
        await visit.open("graph")
        page = visit.page
        await expect(page.get_by_role("button", name="node /said")).to_be_visible()
        await page.get_by_label("Hide the quiet ones").check()
        await expect(page.get_by_text("1 node is hidden as quiet")).to_be_visible()
        await page.get_by_label("Filter nodes and topics").fill("no such name")
        await expect(page.get_by_text("Nothing has “no such name” in its name.")).to_be_visible()


async def test_without_a_robot_its_pane_says_so_and_offers_no_commands() -> None:
    async with browsing(tree=Supervisor("tree", children=[Child(Said)])) as visit:
        await visit.open("robot")
        page = visit.page
        await expect(page.get_by_text("No robot is seen here")).to_be_visible()
        await expect(page.get_by_role("button", name="Walk", exact=True)).to_be_disabled()


async def test_all_of_the_graph_fits_when_that_is_asked_for() -> None:
    async with browsing() as visit:
        await visit.open("graph")
        page = visit.page
        await page.get_by_label("Hide the quiet ones").uncheck()
        await page.get_by_role("button", name=re.compile("topic .odom( |$)")).wait_for()
        await page.get_by_role("button", name="Fit", exact=True).click()
        frame = await page.locator(".canvas").bounding_box()
        boxes = await page.locator(".item rect").evaluate_all(
            "all => all.map((one) => { const box = one.getBoundingClientRect(); return [box.left, box.top, box.right, box.bottom]; })"
        )
    assert frame is not None and len(boxes) > 40
    assert all(frame["x"] <= left and right <= frame["x"] + frame["width"] for left, _, right, _ in boxes)
    assert all(frame["y"] <= top and bottom <= frame["y"] + frame["height"] for _, top, _, bottom in boxes)


async def test_what_is_chosen_in_the_graph_is_told_where_it_is_seen() -> None:
    async with browsing() as visit:
        await visit.open("graph")
        await visit.page.get_by_role("button", name=re.compile("topic .odom( |$)")).press("Enter")
        await expect(visit.page.locator(".side .details")).to_be_in_viewport(ratio=0.9)


async def test_a_field_that_is_not_there_is_told_with_the_one_that_was_meant() -> None:
    async with browsing() as visit:
        await visit.open("plot")
        page = visit.page
        await expect(page.get_by_text("Write a topic and a number in it")).to_be_visible()
        entry = page.get_by_label("Topic and field")
        await entry.fill("/odom.twist.linear.x")
        await entry.press("Enter")
        await expect(page.locator("p.note.bad")).to_have_text(
            "/odom has no number twist.linear.x; did you mean twist.twist.linear.x?"
        )
        await expect(page.locator(".legend li")).to_have_count(0)
        await entry.fill("/odm.twist.twist.linear.x")
        await entry.press("Enter")
        await expect(page.locator(".legend li")).to_contain_text("nobody publishes /odm yet; did you mean /odom?")


async def test_an_answer_goes_when_what_it_says_is_so_no_more() -> None:
    async with browsing() as visit:
        await visit.open("robot")
        page = visit.page
        await page.get_by_role("button", name="Walk", exact=True).click()
        answer = page.locator(".side .card").first.locator("p.note")
        await expect(answer).to_contain_text("walk")
        await expect(page.locator(".chip", has_text="mode")).to_contain_text("walk")
        running = node(visit.system, "battery").running
        assert running is not None
        await running.node.call(Service(Trigger, "/spot/sit"), Trigger.Request(), timeout=30.0)
        await expect(answer).to_be_empty()


async def test_on_a_phone_the_chosen_tab_is_in_view_and_no_word_is_broken() -> None:
    async with browsing(size=PHONE) as visit:
        await visit.open("bags")
        page = visit.page
        await expect(page.locator("#tabs a[aria-current]")).to_be_in_viewport(ratio=0.9)
        heights = await page.locator("th").evaluate_all("all => all.map((one) => one.getBoundingClientRect().height)")
        assert heights and max(heights) < 40
