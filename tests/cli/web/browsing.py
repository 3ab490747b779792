"""A robot, its web server and a browser, for tests that use the page as a person would."""

from __future__ import annotations

import asyncio
import os
import shutil
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import pytest
from playwright.async_api import Page, async_playwright, expect

from actors import Child, Supervisor, System, run
from actors.runtime.runtime import NodeRecord
from cli.web.server.server import WebServer
from cli.web.server.settings import WebSettings
from robot import Robot
from robot.run.tree_nodes import changed

CHROMIUM = shutil.which("chromium") or shutil.which("google-chrome")
AXE = Path(os.environ.get("ROBACTOR_AXE", "axe.min.js"))
"""axe-core's script, which `.ci/nightly` fetches."""
WIDE, PHONE = (1280, 800), (390, 844)
expect.set_options(timeout=30_000)  # a robot and a browser on one machine, which may have others to carry
FLAT, SOLID = ["--no-sandbox", "--disable-gpu"], ["--no-sandbox", "--enable-unsafe-swiftshader"]
"""Without WebGL, and with one that is a program on the processor."""


@dataclass
class Browsing:
    """One visit: the system, the page, and what the browser complained of; and the robot, if there is one."""

    system: System
    page: Page
    url: str
    present: Robot | None = None
    complaints: list[str] = field(default_factory=list)
    asked: list[str] = field(default_factory=list)
    """Every address that the page asked for."""

    @property
    def robot(self) -> Robot:
        assert self.present is not None
        return self.present

    async def open(self, fragment: str, query: str = "") -> None:
        """Go to a pane, and wait until the page is connected."""
        await self.page.goto(f"{self.url}{query}#{fragment}")
        await self.page.locator("#status.on").wait_for()

    async def counted(self, what: str, count: int, within: float = 60.0) -> None:
        """Wait until the page has counted so many: ``received`` messages, or ``drawn`` pictures."""
        async with asyncio.timeout(within):
            while (await self.report())[what] < count:
                await asyncio.sleep(0.1)

    async def report(self) -> dict[str, Any]:
        """What the page counts about itself."""
        found: dict[str, Any] = await self.page.evaluate("robactorReport()")
        return found


def node(system: System, name: str) -> NodeRecord:
    """The node of this name."""
    (found,) = (record for record in system.nodes.values() if record.identity.name == name)
    return found


async def until(condition: Callable[[], bool], within: float = 30.0) -> None:
    """Wait until the condition holds, at most `within` seconds."""
    async with asyncio.timeout(within):
        while not condition():
            await asyncio.sleep(0.02)


def patient(child: Child) -> Child:
    """A gait that does not sit down when the machine, which has a browser to carry too, stands still for half a second."""
    if child.name != "gait":
        return child
    return child.replace(parameters={**child.parameters, "sensor_timeout": 1.0, "command_timeout": 2.0})


@asynccontextmanager
async def browsing(
    robot: Robot | None = None,
    *,
    tree: Supervisor | None = None,
    size: tuple[int, int] = WIDE,
    dark: bool = False,
    webgl: bool = False,
    bags: Path | None = None,
) -> AsyncIterator[Browsing]:
    """A robot that waits in the warehouse, or another `tree`, on the real clock, its server on a free port, and a browser of this size.

    With `bags`, the page records into that folder. At the end the browser must not have complained of anything in its console.
    """
    robot = robot or Robot("warehouse", body="kinematic", seed=1)
    async with run(tree or changed(robot.tree, patient), sinks=()) as system:
        try:
            async with visiting(system, WebSettings(port=0, bags=bags), size, dark, webgl, robot) as visit:
                yield visit
        finally:
            robot.close()


@asynccontextmanager
async def visiting(
    system: System,
    settings: WebSettings,
    size: tuple[int, int] = WIDE,
    dark: bool = False,
    webgl: bool = False,
    robot: Robot | None = None,
) -> AsyncIterator[Browsing]:
    """A server in this system, and a browser. At the end the browser must not have complained of anything in its console."""
    if CHROMIUM is None:
        pytest.skip("there is no chromium: apt-get install chromium")
    async with async_playwright() as playwright:
        server = (await system.join(Child(WebServer, name="_robactor_web", args=(settings,)))).node
        assert isinstance(server, WebServer)
        browser = await playwright.chromium.launch(executable_path=CHROMIUM, args=SOLID if webgl else FLAT)
        width, height = size
        context = await browser.new_context(
            viewport={"width": width, "height": height},
            color_scheme="dark" if dark else "light",
            reduced_motion="reduce",  # a color on its way to another is none of those that are judged
            has_touch=size == PHONE,
            accept_downloads=True,
        )
        page = await context.new_page()
        visit = Browsing(system, page, server.url, robot)
        page.on("console", lambda line: line.type == "error" and visit.complaints.append(line.text))
        page.on("pageerror", lambda error: visit.complaints.append(str(error)))
        page.on("request", lambda request: visit.asked.append(request.url))
        try:
            yield visit
            assert visit.complaints == [], visit.complaints
        finally:
            await browser.close()
