"""Bags in a browser: recorded, played and scrubbed through, with every pane following. Run by `.ci/nightly --only browser`."""

from __future__ import annotations

import asyncio
import re
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from pathlib import Path

import anyio
import pytest
from playwright.async_api import Locator, Page, expect

from actors import Child, Node, execute, run
from actors.bag import BagReader, Recorder, RecordOptions, Selection
from actors.interfaces import decode
from actors.interfaces.nav_msgs.msg import Odometry
from cli.web.server.settings import WebSettings
from robot import Robot
from robot.contracts import MOVE_TO_POSITION
from robot.interfaces.tutorials.my_robot_interfaces.action import MoveToPosition
from tests.cli.web.browsing import PHONE, WIDE, Browsing, browsing, visiting

pytestmark = [pytest.mark.browser]

PLACE = re.compile(r"(-?[\d.]+), (-?[\d.]+) m")


def button(page: Page, name: str) -> Locator:
    return page.get_by_role("button", name=name, exact=True)


async def place(page: Page) -> tuple[float, float]:
    """Where the page shows the robot."""
    chip = page.locator(".chip", has_text="place")
    async with asyncio.timeout(30):
        while (found := PLACE.search(await chip.inner_text())) is None:
            await expect(chip).to_contain_text(PLACE)
    return float(found[1]), float(found[2])


async def shown_at(visit: Browsing, x: float, within: float = 0.05) -> None:
    """Wait until the robot is shown at this place along x."""
    async with asyncio.timeout(30):
        while abs((await place(visit.page))[0] - x) > within:
            await asyncio.sleep(0.05)


async def scrub(page: Page, share: float) -> float:
    """Go to this share of the recording; the seconds from its start."""
    slider = page.get_by_label("Time of the recording")
    offset = share * float(await slider.get_attribute("max") or 0)
    await slider.fill(f"{offset:.3f}")
    await expect(page.locator(".timeline .time")).to_contain_text(f"{offset:.1f} of")
    return offset


class Errand(Node):
    """Walks a metre and a half ahead, and ends."""

    async def done(self) -> None:
        self.log.info("the walk begins")
        async with self.send_goal(MOVE_TO_POSITION, MoveToPosition.Goal(target_x=1.5), timeout=10.0) as goal:
            await goal.ended()
        self.log.info("the walk ends")


@pytest.fixture(scope="module")
def walk(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The recording of that walk, made in no time on the virtual clock."""
    path = tmp_path_factory.mktemp("bags") / "walk"
    everything = RecordOptions(selection=Selection(all_topics=True, exclude_regex="camera|points"))

    async def record() -> None:
        robot = Robot("warehouse", body="kinematic", seed=1)
        async with run(robot.tree, Child(Recorder, args=(path, everything)), Errand, signals=False, sinks=()) as system:
            await system.clock.sleep(1.0)
            await system.node(Errand).done()
            await system.clock.sleep(1.0)
            await system.node(Recorder).finish()
        robot.close()

    execute(record, clock="virtual")
    return path


def odometry(path: Path) -> list[tuple[float, float]]:
    """What was recorded: seconds from the start of the bag, and how far the robot had come by its legs."""
    with BagReader(path) as bag:
        return [
            ((one.received_ns - bag.metadata.start_ns) * 1e-9, decode(Odometry, one.data).pose.pose.position.x)
            for one in bag.messages({"/odom"})
        ]


def recorded_at(path: Path, seconds: float) -> float:
    return [x for at, x in odometry(path) if at < seconds][-1]


@asynccontextmanager
async def shown(path: Path, size: tuple[int, int] = WIDE) -> AsyncIterator[Browsing]:
    """A server that shows a recording, and a browser."""
    async with run(Child(Node, name="alone"), signals=False, sinks=()) as system:
        async with visiting(system, WebSettings(port=0, recording=path), size) as visit:
            yield visit


async def test_a_recorded_walk_is_shown_at_any_time_of_it_backwards_too(walk: Path) -> None:
    async with shown(walk) as visit:
        await visit.open("robot")
        page = visit.page
        await button(page, "Stand still").click()
        for share in (0.95, 0.5, 0.7, 0.3):
            at = await scrub(page, share)
            await shown_at(visit, recorded_at(walk, at))
        report = await visit.report()
        assert (report["errors"], report["longTasks"]) == (0, report["longTasks"])
        await expect(page.get_by_role("button", name="STOP")).to_be_hidden()
        await expect(page.locator(".side")).to_be_hidden()


async def test_before_anything_was_published_nothing_is_shown(walk: Path) -> None:
    async with shown(walk) as visit:
        await visit.open("robot")
        page = visit.page
        await button(page, "Stand still").click()
        await scrub(page, 0.9)
        await place(page)
        await scrub(page, 0.0)
        await expect(page.locator(".chip", has_text="place")).to_contain_text("–")


async def test_the_plot_follows_and_forgets_what_comes_after_the_time_that_is_shown(walk: Path) -> None:
    async with shown(walk) as visit:
        await visit.open("plot?series=/odom.pose.pose.position.x")
        page = visit.page
        await page.get_by_label("Seconds shown").select_option("60")
        await page.get_by_label("Rate").select_option("10")
        await expect(button(page, "Play")).to_be_visible()  # it has come to its end
        legend = page.locator(".legend li")
        at = await scrub(page, 0.5)
        await expect(legend).to_contain_text(f"{recorded_at(walk, at):.4f}".rstrip("0"))

        async with page.expect_download() as saved:
            await button(page, "CSV").click()

        text = await anyio.Path(await (await saved.value).path()).read_text(encoding="utf-8")
        rows = [line.split(",") for line in text.splitlines()[1:]]
        expected = [x for seconds, x in odometry(walk) if seconds < at]
        begin = float(rows[0][1])
        assert [float(x) for _, _, x in rows] == pytest.approx(expected[-len(rows) :], abs=1e-6)
        assert len(rows) > 0.9 * len(expected)
        assert float(rows[-1][1]) - begin <= at


async def test_the_console_shows_what_had_been_said_by_then(walk: Path) -> None:
    async with shown(walk) as visit:
        await visit.open("console")
        page = visit.page
        await button(page, "Stand still").click()
        lines = page.locator(".log tbody tr")
        await scrub(page, 1.0)
        await expect(lines.filter(has_text="the walk ends")).to_have_count(1)
        await expect(lines.filter(has_text="the walk begins")).to_have_count(1)
        await scrub(page, 0.5)
        await expect(lines.filter(has_text="the walk ends")).to_have_count(0)
        await expect(lines.filter(has_text="the walk begins")).to_have_count(1)
        await scrub(page, 1.0)
        await expect(lines.filter(has_text="the walk ends")).to_have_count(1)  # and nothing twice
        await expect(lines.filter(has_text="the walk begins")).to_have_count(1)


async def test_it_is_played_by_keys_stepped_through_and_begins_anew(walk: Path) -> None:
    async with shown(walk) as visit:
        await visit.open("doctor")
        page = visit.page
        time = page.locator(".timeline .time")
        await page.keyboard.press("Space")
        await expect(button(page, "Play")).to_be_visible()
        await scrub(page, 0.5)
        before = float(await page.get_by_label("Time of the recording").input_value())
        for _ in range(40):
            await page.keyboard.press(".")
        slider = page.get_by_label("Time of the recording")
        await expect(slider).not_to_have_value(f"{before:g}")
        assert before <= float(await slider.input_value()) < before + 2.0

        await button(page, "Loop").click()
        await scrub(page, 0.999)
        await page.keyboard.press("Space")
        await expect(time).to_contain_text(re.compile(r"^[0-3]\.\d of"))
        await expect(button(page, "Stand still")).to_be_visible()


async def test_the_graph_shows_the_topics_of_the_recording(walk: Path) -> None:
    async with shown(walk) as visit:
        await visit.open("graph?topic=/odom")
        details = visit.page.locator(".side .details")
        await expect(details).to_contain_text("nav_msgs/msg/Odometry")
        await expect(details.get_by_role("button", name="/rosbag2_player")).to_be_visible()
        await expect(visit.page.get_by_role("button", name=re.compile("^Kill")).first).to_be_hidden()


@pytest.mark.parametrize("size", [WIDE, PHONE], ids=["wide", "phone"])
async def test_the_robot_is_recorded_for_three_seconds_and_looked_at_and_the_stop_button_stays(
    tmp_path: Path, size: tuple[int, int]
) -> None:
    async with browsing(size=size, bags=tmp_path / "bags") as visit:
        await visit.open("bags")
        page = visit.page
        await page.get_by_label("Name of the bag").fill("mine")
        await button(page, "Record").click()
        await expect(page.locator(".bags [role=status]").nth(1)).to_contain_text(re.compile("mine: [3-9] s"))
        await button(page, "Stop recording").click()
        row = page.locator("tbody tr", has_text="mine")
        await expect(row).to_be_visible()
        assert await page.evaluate("document.scrollingElement.scrollWidth") <= size[0]

        async with page.expect_download() as saved:
            await row.get_by_role("button", name="Download").click()
        fetched = await anyio.Path(await (await saved.value).path()).read_bytes()
        assert fetched == (tmp_path / "bags" / "mine" / "mine_0.mcap").read_bytes()
        with BagReader(tmp_path / "bags" / "mine") as bag:
            assert {"/odom", "/tf", "/robot_description", "/imu/data"} <= {topic.name for topic in bag.topics}
            assert bag.metadata.duration_ns > 2e9

        await row.get_by_role("link", name="Play mine").click()
        await expect(page.locator(".timeline")).to_contain_text("mine")
        await place(page)
        assert await page.evaluate("document.scrollingElement.scrollWidth") <= size[0]
        await page.get_by_role("button", name="STOP").click()  # of the robot, not of the recording
        await expect(page.get_by_role("alert")).to_contain_text("Stopped")
        await button(page, "Clear the stop").click()
        await page.get_by_role("link", name="Back to the robot").click()
        await expect(page.locator("#status.on")).to_be_visible()
        await expect(page.locator(".timeline")).to_be_hidden()
        await expect(button(page, "Walk")).to_be_visible()


async def test_chosen_topics_alone_are_recorded_and_a_name_that_is_taken_is_refused(tmp_path: Path) -> None:
    async with browsing(bags=tmp_path) as visit:
        (tmp_path / "taken").mkdir()
        await visit.open("bags")
        page = visit.page
        await page.get_by_label("Name of the bag").fill("taken")
        await button(page, "Record").click()
        await expect(page.get_by_text("there is a bag taken already")).to_be_visible()
        await page.get_by_label("all topics").uncheck()
        await page.get_by_label("/odom", exact=True).check()
        await page.get_by_label("Name of the bag").fill("odometry")
        await button(page, "Record").click()
        await expect(page.get_by_text(re.compile("odometry: [1-9] s, .* of 1 topics"))).to_be_visible()
        await button(page, "Stop recording").click()
        await expect(page.locator("tbody tr", has_text="odometry")).to_be_visible()
        with BagReader(tmp_path / "odometry") as bag:
            assert [topic.name for topic in bag.topics] == ["/odom"]


async def test_without_a_folder_the_pane_says_what_to_do() -> None:
    async with browsing() as visit:
        await visit.open("bags")
        await expect(visit.page.get_by_text("start the server with --bags DIR")).to_be_visible()
        await expect(button(visit.page, "Record")).to_be_hidden()
