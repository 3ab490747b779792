"""What rqt's four tools do with the programs of the tutorials, done in the page. Run by `.ci/nightly --only browser`."""

from __future__ import annotations

import asyncio
import csv
import io
import re
from pathlib import Path
from statistics import fmean

import anyio
import pytest
from playwright.async_api import Page, expect

from actors import Child, Node, Supervisor, Topic, every, parameter, publishes, qos, subscribes
from actors.interfaces.std_msgs.msg import String
from robot.tutorials.humanoid_lab import tree as lab
from robot.tutorials.imu_publisher import ImuPublisher
from tests.cli.web.browsing import Browsing, browsing, node, until

pytestmark = [pytest.mark.browser]

WEB = Path(__file__).parents[3] / "docs" / "howto" / "web.md"
RQT = {"rqt_graph": "graph", "rqt_console": "console", "rqt_plot": "plot", "rqt_reconfigure": "parameters"}
SPOKEN = Topic(String, "/spoken", qos.SENSOR_DATA)
HEARD = Topic(String, "/spoken", qos.DEFAULT)


class Driver(Node):
    """Has a speed, and says what it does, twice a second."""

    speed = parameter(0.5, ge=0.0, le=2.0, unit="m/s")

    @every(hz=2)
    def drive(self) -> None:
        self.log.info("driving")
        self.log.error("wheel blocked", wheel="left")


class Steerer(Node):
    """Says what it does, too."""

    @every(hz=2)
    def steer(self) -> None:
        self.log.info("steering")


class Speaker(Node):
    """Offers best effort."""

    spoken = publishes(SPOKEN)


class Hearer(Node):
    """Asks for more than the speaker offers."""

    heard = subscribes(HEARD)


def published(visit: Browsing) -> tuple[int, float]:
    """How many messages /imu/data has had, and when."""
    snapshot = visit.system.snapshot()
    return next(topic.messages for topic in snapshot.topics if topic.name == "/imu/data"), snapshot.at


async def edges(page: Page) -> set[tuple[str, str]]:
    """The arrows that are drawn: from, to."""
    found = await page.locator("path.edge").evaluate_all("all => all.map((one) => [one.dataset.from, one.dataset.to])")
    return {(begin, end) for begin, end in found}


async def test_the_graph_of_the_lab_shows_its_nodes_topics_and_who_calls_whom() -> None:
    async with browsing(tree=lab()) as visit:
        await visit.open("graph?node=/motor_controller")
        page = visit.page
        await page.get_by_label("Hide the quiet ones").uncheck()
        wanted = {
            ("node /sensor_simulator", "topic /sensor/data"),
            ("topic /sensor/data", "node /planner"),
            ("node /motor_controller", "topic /motor/commands"),
        }
        async with asyncio.timeout(30):
            while not wanted <= await edges(page):
                await asyncio.sleep(0.1)
        details = page.locator(".side .details")
        await expect(details).to_contain_text("/plan_trajectory of /planner")


async def test_the_console_shows_the_lines_of_one_node_and_of_a_level() -> None:
    async with browsing(tree=Supervisor("tree", children=[Child(Driver), Child(Steerer)])) as visit:
        await visit.open("console")
        page = visit.page
        lines = page.locator(".log tbody tr")
        await expect(lines.filter(has_text="driving").first).to_be_visible()
        await expect(lines.filter(has_text="steering").first).to_be_visible()
        await page.get_by_label("Node", exact=True).select_option("driver")
        await expect(lines.filter(has_text="steering")).to_have_count(0)
        await page.get_by_label("Least level").select_option("error")
        await expect(lines.filter(has_text="driving")).to_have_count(0)
        await expect(lines.filter(has_text="wheel blocked").first).to_be_visible()


async def test_a_field_of_200_messages_a_second_is_plotted_without_a_gap() -> None:
    async with browsing(tree=Supervisor("tree", children=[Child(ImuPublisher)])) as visit:
        await visit.open("plot?series=/imu/data.angular_velocity.z")
        page = visit.page
        legend = page.locator(".legend li", has_text="angular_velocity")
        await expect(legend).not_to_contain_text("–")
        before = published(visit)
        await visit.counted("received", (await visit.report())["received"] + 1200)
        after = published(visit)
        await expect(legend).to_contain_text(re.compile(r"\d Hz, mean "))
        told = re.search(r"([\d.]+) Hz, mean (\S+), (\S+) to (\S+)$", await legend.locator(".sums").inner_text())
        async with page.expect_download() as saved:
            await page.get_by_role("button", name="CSV", exact=True).click()
        text = await anyio.Path(await (await saved.value).path()).read_text(encoding="utf-8")

    samples = [(float(time), float(value)) for _, time, value in list(csv.reader(io.StringIO(text)))[1:]]
    times, values = [time for time, _ in samples], [value for _, value in samples]
    rate = (after[0] - before[0]) / (after[1] - before[1])  # 200 Hz, on a machine that has the time
    assert len(samples) > 1000 and len(samples) / (times[-1] - times[0]) == pytest.approx(rate, rel=0.05)
    assert abs(fmean(values)) < 0.001
    assert told is not None
    assert float(told[1]) == pytest.approx(rate, rel=0.1) and abs(float(told[2])) < 0.001
    assert float(told[3]) <= 0.0 <= float(told[4])


async def test_each_of_rqts_tools_has_a_pane_that_says_so_and_a_command_in_the_readme() -> None:
    async with browsing(tree=Supervisor("tree", children=[Child(Driver)])) as visit:
        await visit.open("console")
        page_of_docs = await anyio.Path(WEB).read_text(encoding="utf-8")
        for tool, pane in RQT.items():
            tab = visit.page.get_by_title(f"Instead of {tool}")
            await tab.click()
            await expect(visit.page.locator(f".{pane}")).to_be_visible()
            assert f"replaces `{tool}`" in page_of_docs


async def test_a_parameter_is_changed_and_a_value_that_is_none_is_refused_with_the_reason() -> None:
    async with browsing(tree=Supervisor("tree", children=[Child(Driver)])) as visit:
        await visit.open("parameters?node=/driver")
        page = visit.page
        card = page.locator(".parameter", has=page.get_by_label("speed", exact=True))
        speed = page.get_by_label("speed", exact=True)
        await expect(speed).to_have_value("0.5")
        await speed.fill("2.5")
        await speed.press("Enter")
        await expect(card.get_by_role("status")).to_contain_text("2.0")
        await speed.fill("1.25")
        await speed.press("Enter")
        await expect(card.get_by_role("status")).to_have_text("changed")

        running = node(visit.system, "driver").running
        assert running is not None and getattr(running.node, "speed") == 1.25  # noqa: B009


async def test_endpoints_that_do_not_match_are_red_and_the_reason_is_told() -> None:
    async with browsing(tree=Supervisor("tree", children=[Child(Speaker), Child(Hearer)])) as visit:
        await visit.open("graph?topic=/spoken")
        page = visit.page
        await expect(page.locator(".item.topic.badly")).to_have_attribute("aria-label", "topic /spoken")
        await expect(page.locator(".side p.bad")).to_contain_text("reliability")
        await visit.open("doctor")
        finding = page.locator(".finding", has_text="/spoken")
        await expect(finding).to_contain_text("problem")
        await expect(finding).to_contain_text("nothing reaches /hearer from /speaker: the publisher offers less")
        await expect(finding).to_contain_text("What helps: ")
        await expect(page.locator('#tabs a[data-pane="doctor"] .count')).to_have_text("1")
        await finding.get_by_role("link", name="/spoken").click()
        await expect(page.locator(".item.topic.chosen")).to_have_attribute("aria-label", "topic /spoken")


async def test_nodes_are_grouped_by_the_processes_in_which_they_run() -> None:
    tree = Supervisor(
        "tree", children=[Child(Driver), Supervisor("apart", process=True, children=[Child(ImuPublisher)])]
    )
    async with browsing(tree=tree) as visit:
        imu = node(visit.system, "imu_publisher")
        await until(lambda: imu.process > 0)
        await visit.open("graph")
        groups = visit.page.get_by_label("Hosts and processes").get_by_role("listitem")
        await expect(groups).to_have_count(2)
        await expect(groups.first).to_contain_text("main process 1 node")
        await expect(groups.last).to_contain_text(f"{imu.process} 1 node")
        await groups.last.get_by_role("button", name="/imu_publisher").click()
        await expect(visit.page.locator(".side .card h2.mono")).to_have_text("/imu_publisher")


async def test_a_graph_of_which_nothing_is_left_by_the_filter_is_empty_and_no_error() -> None:
    async with browsing(tree=lab()) as visit:
        await visit.open("graph")
        page = visit.page
        await expect(page.locator(".item.node").first).to_be_visible()
        await page.get_by_label("Filter nodes and topics").fill("no such name")
        await expect(page.locator(".item")).to_have_count(0)
        await page.get_by_label("Filter nodes and topics").fill("")
        await expect(page.locator(".item.node").first).to_be_visible()
