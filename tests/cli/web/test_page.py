"""The page in a browser, each pane used as a person would, with a robot behind it. Run by `.ci/nightly --only browser`."""

from __future__ import annotations

import asyncio
import csv
import io
import json
import re
from urllib.parse import urlsplit

import anyio
import pytest
from playwright.async_api import Locator, Page, expect

from tests.cli.web.browsing import AXE, PHONE, WIDE, Browsing, browsing, node, until

pytestmark = [pytest.mark.browser]

PANES = ("robot", "graph", "plot", "console", "parameters", "goals", "doctor", "bags")


def button(page: Page, name: str) -> Locator:
    return page.get_by_role("button", name=name, exact=True)


def value(visit: Browsing, name: str, parameter: str) -> object:
    """A parameter of a node that runs."""
    running = node(visit.system, name).running
    assert running is not None
    return getattr(running.node, parameter)


# -- robot ------------------------------------------------------------------------------------------------------------------------


async def test_a_click_on_the_floor_makes_the_true_body_go_there() -> None:
    async with browsing() as visit:
        await visit.open("robot")
        page = visit.page
        await expect(page.locator(".chip", has_text="place")).to_contain_text(re.compile(r"-?0\.0\d, -?0\.0\d m"))
        stage = await page.locator(".view3d").bounding_box()
        assert stage is not None
        metre = min(stage["width"], stage["height"]) / 6  # the flat view shows 3 m around the robot
        x, y = stage["x"] + stage["width"] / 2, stage["y"] + stage["height"] / 2

        await button(page, "Go to…").click()
        await page.mouse.move(x + 0.9 * metre, y - 0.7 * metre)
        await page.mouse.down()
        await page.mouse.move(x + 0.9 * metre, y - 1.5 * metre, steps=4)  # to look along +y there
        await page.mouse.up()
        await expect(page.get_by_text("m left")).to_be_visible(timeout=20_000)
        await expect(page.get_by_text("Arrived")).to_be_visible(timeout=60_000)

        truth = visit.robot.body.truth()
        assert truth.position[:2].tolist() == pytest.approx([0.9, 0.7], abs=0.2)
        w, _x, _y, z = truth.quaternion.tolist()
        assert 2 * w * z == pytest.approx(1.0, abs=0.05)  # the sine of the heading: it looks along +y


async def test_the_robot_is_driven_by_keys_and_by_the_stick_and_stands_still_when_they_are_let_go() -> None:
    async with browsing() as visit:
        await visit.open("robot")
        page = visit.page
        await expect(page.locator(".chip", has_text="mode")).to_contain_text("sit")
        await page.keyboard.down("w")
        await expect(page.get_by_text("The robot does not walk: press Walk.")).to_be_visible()
        await page.keyboard.up("w")
        await button(page, "Walk").click()
        await expect(page.locator(".chip", has_text="mode")).to_contain_text("walk", timeout=15_000)

        await page.keyboard.down("w")
        await until(lambda: visit.robot.body.truth().position[0] > 0.3)
        await page.keyboard.up("w")
        driven = float(visit.robot.body.truth().position[0])

        stick = await page.locator(".stick").bounding_box()
        assert stick is not None
        x, y = stick["x"] + stick["width"] / 2, stick["y"] + stick["height"] / 2
        await page.mouse.move(x, y)
        await page.mouse.down()
        await page.mouse.move(x - 40, y, steps=3)
        await until(lambda: abs(visit.robot.body.truth().quaternion[3]) > 0.2)
        await page.mouse.up()

        await expect(page.locator(".chip", has_text="driver")).to_contain_text("nobody")
        assert driven < 1.5


async def test_on_a_phone_the_stick_is_pushed_by_a_finger() -> None:
    async with browsing(size=PHONE) as visit:
        await visit.open("robot")
        page = visit.page
        await button(page, "Walk").tap()
        await expect(page.locator(".chip", has_text="mode")).to_contain_text("walk", timeout=15_000)
        stick = page.locator(".stick")
        await stick.scroll_into_view_if_needed()
        box = await stick.bounding_box()
        assert box is not None
        x, y = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2
        hand = await page.context.new_cdp_session(page)
        for what, places in (("touchStart", [{"x": x, "y": y}]), ("touchMove", [{"x": x, "y": y - 40}])):
            await hand.send("Input.dispatchTouchEvent", {"type": what, "touchPoints": places})
        await until(lambda: visit.robot.body.truth().position[0] > 0.2)
        await hand.send("Input.dispatchTouchEvent", {"type": "touchEnd", "touchPoints": []})
        await expect(page.locator(".chip", has_text="driver")).to_contain_text("nobody")


async def test_one_tap_stops_the_robot_on_a_phone_from_every_pane_and_it_can_be_cleared() -> None:
    async with browsing(size=PHONE) as visit:
        for pane in PANES:
            await visit.open(pane)
            stop = visit.page.get_by_role("button", name="STOP")
            box = await stop.bounding_box()
            assert box is not None and box["width"] > 340 and box["height"] > 55, pane
            await stop.tap()
            await expect(visit.page.get_by_role("alert")).to_contain_text("Stopped: emergency stop requested")
            await button(visit.page, "Clear the stop").tap()
            await expect(visit.page.get_by_role("alert")).to_be_hidden()


async def test_escape_stops_the_robot_and_is_the_writers_own_while_somebody_writes() -> None:
    async with browsing() as visit:
        await visit.open("console")
        page = visit.page
        await page.get_by_label("Text").press("Escape")
        await page.get_by_label("Text").blur()
        await expect(page.get_by_role("alert")).to_be_hidden()
        await page.keyboard.press("Escape")
        await expect(page.get_by_role("alert")).to_contain_text("Stopped")


async def test_with_webgl_it_is_drawn_in_three_dimensions_with_the_camera_beside_it() -> None:
    async with browsing(size=(640, 480), webgl=True) as visit:
        await visit.open("robot")
        page = visit.page
        assert (await visit.report())["view"] == "canvas"  # where WebGL is a program on the processor
        await button(page, "3D").click()
        async with asyncio.timeout(30):
            while (await visit.report())["view"] == "canvas":
                await asyncio.sleep(0.1)
        await button(page, "Camera").click()
        picture = page.get_by_alt_text("What the robot's camera sees")
        await expect(picture).to_have_js_property("naturalWidth", 640, timeout=20_000)
        assert (await visit.report())["errors"] == 0


# -- graph, doctor ----------------------------------------------------------------------------------------------------------------


async def test_a_node_that_is_killed_begins_its_next_life_before_ones_eyes() -> None:
    async with browsing() as visit:
        await visit.open("graph?node=/lidar")
        page = visit.page
        leaf = page.locator(".leaf", has=page.get_by_role("button", name="lidar", exact=True))
        await expect(leaf).to_contain_text("#1")

        await leaf.get_by_role("button", name="Kill /lidar").click()
        await leaf.get_by_text("Sure?").click()

        await expect(leaf).to_contain_text("#2", timeout=10_000)
        await expect(leaf).to_contain_text("1 restart")
        assert node(visit.system, "lidar").incarnation == 2
        await visit.open("doctor")
        finding = page.locator(".finding", has_text="/lidar it has ended with an error")
        await expect(finding).to_contain_text("nodes run: 1 restart so far")


async def test_a_topic_that_is_clicked_shows_who_publishes_and_takes_it() -> None:
    async with browsing() as visit:
        await visit.open("graph")
        page = visit.page
        await page.get_by_role("button", name=re.compile("topic .odom( |$)")).press("Enter")
        details = page.locator(".side .details")
        await expect(details).to_contain_text("nav_msgs/msg/Odometry")
        await expect(details.get_by_role("button", name="/gait")).to_be_visible()
        await expect(details.get_by_role("button", name="/localizer")).to_be_visible()
        assert page.url.endswith("#graph?topic=%2Fodom")
        newest = page.get_by_label("Newest message")
        await expect(newest).to_contain_text("frame_id: odom")
        await expect(newest).to_contain_text("orientation:\n      x:")


async def test_the_doctor_shows_the_robots_diagnostics() -> None:
    async with browsing() as visit:
        await visit.open("doctor")
        rows = visit.page.locator("tbody tr")
        await expect(rows.filter(has_text="battery")).to_contain_text("good, 90 %")


# -- plot -------------------------------------------------------------------------------------------------------------------------


async def test_a_field_is_plotted_by_its_path_and_saved_as_csv() -> None:
    async with browsing() as visit:
        await visit.open("plot")
        page = visit.page
        entry = page.get_by_label("Topic and field")
        await entry.fill("/imu/data/angular_velocity/z")
        await entry.press("Enter")
        await entry.fill("/joint_states.position[2]")
        await entry.press("Enter")
        knee = page.locator(".legend li", has_text="position[2]")
        await expect(knee).to_contain_text("-2.")
        await expect(page.locator(".legend li", has_text="angular_velocity")).not_to_contain_text("–")
        await visit.counted("received", 200)

        async with page.expect_download() as saved:
            await button(page, "CSV").click()

        text = await anyio.Path(await (await saved.value).path()).read_text(encoding="utf-8")
        rows = list(csv.reader(io.StringIO(text)))
        assert rows[0] == ["series", "time_s", "value"]
        knees = [float(value) for name, _, value in rows[1:] if name == "/joint_states.position[2]"]
        angle = float(visit.robot.body.joints().position[2])
        assert len(knees) > 50 and knees[-1] == pytest.approx(angle, abs=0.02)
        times = [float(time) for name, time, _ in rows[1:] if name.startswith("/imu")]
        assert times == sorted(times)


async def test_a_plot_is_paused_zoomed_and_goes_on() -> None:
    async with browsing() as visit:
        await visit.open("plot?series=/odom.pose.pose.position.z")
        page = visit.page
        chart = page.locator(".u-over")
        await chart.wait_for()
        await visit.counted("received", 60)
        box = await chart.bounding_box()
        assert box is not None
        y = box["y"] + box["height"] / 2
        await page.mouse.move(box["x"] + 0.9 * box["width"], y)
        await page.mouse.down()
        await page.mouse.move(box["x"] + 0.99 * box["width"], y, steps=4)
        await page.mouse.up()
        pause = button(page, "Pause")
        await expect(pause).to_have_attribute("aria-pressed", "true")
        await pause.click()
        await expect(pause).to_have_attribute("aria-pressed", "false")


async def test_a_path_without_a_topic_is_refused_with_the_reason() -> None:
    async with browsing() as visit:
        await visit.open("plot")
        await visit.page.get_by_label("Topic and field").fill("nonsense")
        await button(visit.page, "Add").click()
        await expect(visit.page.get_by_text("nonsense: there is no topic of this name")).to_be_visible()


# -- parameters, console, goals ---------------------------------------------------------------------------------------------------


async def test_a_speed_beyond_its_range_is_refused_and_the_reason_stands_beside_it() -> None:
    async with browsing() as visit:
        await visit.open("parameters?node=/navigation")
        page = visit.page
        card = page.locator(".parameter", has=page.get_by_label("max_speed", exact=True))
        await expect(card).to_contain_text("from 0.1 to 1.6; unit: m/s")
        speed = page.get_by_label("max_speed", exact=True)
        await speed.fill("9")
        await speed.press("Enter")
        await expect(card.get_by_role("status")).to_contain_text("1.6")
        assert value(visit, "navigation", "max_speed") == 0.7

        await speed.fill("1.1")
        await speed.press("Enter")
        await expect(card.get_by_role("status")).to_have_text("changed")
        assert value(visit, "navigation", "max_speed") == 1.1


async def test_a_choice_is_chosen_from_those_that_there_are() -> None:
    async with browsing() as visit:
        await visit.open("parameters?node=/gait")
        await visit.page.get_by_label("gait", exact=True).select_option("crawl")
        await until(lambda: value(visit, "gait", "gait") == "crawl")


async def test_the_console_shows_lines_by_level_node_and_text() -> None:
    async with browsing() as visit:
        await visit.open("console")
        page = visit.page
        await page.keyboard.press("Escape")
        lines = page.locator(".log tbody tr")
        await expect(lines.filter(has_text="safety stop")).to_have_count(1)
        await page.get_by_label("Text").fill("no such words")
        await expect(lines).to_have_count(0)
        await page.get_by_label("Text").fill("SAFETY")
        await expect(lines.first).to_contain_text("safety_monitor")
        await page.get_by_label("Least level").select_option("fatal")
        await expect(lines).to_have_count(0)


async def test_a_goal_of_any_action_is_filled_in_sent_watched_and_canceled() -> None:
    async with browsing() as visit:
        await visit.open("goals?action=/move_to_position")
        page = visit.page
        target = page.get_by_label("target_x")
        await expect(target).to_have_value("0.0", timeout=15_000)
        field = page.locator(".field", has=target)
        await target.fill("three")
        await button(page, "Send goal").click()
        await expect(field.get_by_role("status")).to_have_text('"three" is no number')
        await expect(target).to_be_focused()
        await expect(page.locator(".run")).to_have_count(0)

        await target.fill("3")
        await target.press("Enter")
        card = page.locator(".run")
        await expect(card).to_contain_text("distance_remaining", timeout=15_000)
        await card.get_by_role("button", name="Cancel").click()
        await expect(card).to_contain_text("canceled", timeout=15_000)


async def test_a_goal_with_messages_in_it_is_written_in_the_form_or_as_json_and_keeps_what_is_written() -> None:
    async with browsing() as visit:
        await visit.open("goals?action=/navigate_to_goal")
        page = visit.page
        pose = page.get_by_role("group", name="target_pose")
        frame = pose.get_by_label("frame_id")
        await expect(frame).to_have_value("map", timeout=15_000)
        await expect(pose.get_by_label("w float64")).to_have_value("1.0")
        await pose.get_by_label("frame_id").fill("odom")
        await pose.get_by_role("group", name="position").get_by_label("x float64").fill("1.5")

        await button(page, "As JSON").click()
        text = page.get_by_label("Goal, as JSON")
        written = json.loads(await text.input_value())
        assert written["target_pose"]["header"] == {"frame_id": "odom"}
        assert written["target_pose"]["pose"] == {
            "position": {"x": 1.5, "y": 0, "z": 0},
            "orientation": {"x": 0, "y": 0, "z": 0, "w": 1},
        }
        written["target_pose"]["pose"]["position"]["y"] = -2
        await text.fill(json.dumps(written))
        await button(page, "As JSON").click()
        await expect(pose.get_by_role("group", name="position").get_by_label("y float64")).to_have_value("-2")
        await expect(frame).to_have_value("odom")


# -- all of it --------------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("size", [WIDE, PHONE], ids=["wide", "phone"])
async def test_nothing_is_wider_than_the_window_and_nothing_comes_from_elsewhere(size: tuple[int, int]) -> None:
    async with browsing(size=size) as visit:
        for pane in PANES:
            await visit.open(pane)
            await visit.page.locator(f".{pane}").wait_for()
            wide = await visit.page.evaluate("document.scrollingElement.scrollWidth")
            assert wide <= size[0], pane
        assert {urlsplit(address).netloc for address in visit.asked if address.startswith("http")} == {
            urlsplit(visit.url).netloc
        }


async def test_the_pane_and_what_it_shows_are_in_the_address_and_remembered() -> None:
    async with browsing() as visit:
        await visit.open("plot?series=/odom.pose.pose.position.z")
        page = visit.page
        await expect(page.locator(".legend li")).to_have_count(1)
        await page.keyboard.press("4")
        await expect(page.locator('nav a[aria-current="page"]')).to_have_text("Console")
        await page.keyboard.press("t")
        await expect(page.locator("html")).to_have_attribute("data-theme", "dark")
        await page.goto(visit.url)
        await expect(page.locator('nav a[aria-current="page"]')).to_have_text("Console")
        await expect(page.locator("html")).to_have_attribute("data-theme", "dark")
        await page.keyboard.press("3")
        await expect(page.locator(".legend li")).to_have_count(1)


@pytest.mark.skipif(not AXE.is_file(), reason=f"there is no axe-core at {AXE}: npm pack axe-core")
@pytest.mark.parametrize("dark", [False, True], ids=["light", "dark"])
async def test_axe_finds_nothing_serious(dark: bool) -> None:
    async with browsing(dark=dark) as visit:
        await visit.page.add_init_script(path=AXE)
        for pane in PANES:
            await visit.open(f"{pane}?node=/navigation&action=/dock&series=/odom.pose.pose.position.z")
            await visit.page.locator(f".{pane}").wait_for()
            await visit.counted("drawn", 30)
            found = await visit.page.evaluate("axe.run()")
            serious = [
                f"{pane}: {one['id']}: {node['html'][:120]} {node.get('failureSummary', '')[:160]}"
                for one in found["violations"]
                if one["impact"] in ("serious", "critical")
                for node in one["nodes"]
            ]
            assert serious == []


async def test_what_it_costs_is_counted_and_printed() -> None:
    async with browsing() as visit:
        await visit.open("robot")
        await visit.counted("drawn", 300)
        report = await visit.report()
        print(report)
        assert report["errors"] == 0
        assert report["received"] > 300
