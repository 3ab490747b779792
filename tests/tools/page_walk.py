"""`python -m tests.tools.page_walk`: the pictures of the page in the docs, drawn by Chromium.

The robot walks on the virtual clock first, and its flight record is played to the page step by step, so that each picture shows its own time however
long it takes to draw. `docs/page-walk.webp` is 20 seconds of that, `docs/page-robot.png` one instant of it with all of the page.
"""

from __future__ import annotations

import argparse
import asyncio
import io
import shutil
import tempfile
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from pathlib import Path
from typing import Any, Final

from PIL import Image
from playwright.async_api import Page, async_playwright

from actors import Child, Node, Supervisor, Topic, execute, qos, run, subscribes
from actors.bag import FlightRecorder, Player, PlayOptions
from actors.interfaces.sensor_msgs.msg import CompressedImage
from actors.interfaces.std_srvs.srv import SetBool, Trigger
from cli.web.server.server import WebServer
from cli.web.server.settings import WebSettings
from robot import Robot
from robot.contracts import EMERGENCY_STOP, ENABLE, SIT, STAND, WALK
from robot.run.tree_nodes import changed
from tests.tools.web_load import PICTURE

DOCS: Final = Path(__file__).parents[2] / "docs"
BEGIN: Final = 2.2
"""Second of the run at which the robot begins to walk."""
SECONDS: Final = 20.0
EACH: Final = 0.1
"""Seconds from picture to picture."""
STILL: Final = 12.0
WALK_WIDTH, WALK_SIZE, STILL_SIZE = 480, (800, 560), (1280, 720)
QUALITY: Final = 40


def recorded(folder: Path) -> Path:
    """The flight record of a patrol, with pictures of the camera."""
    file, recorder = folder / "walk.mcap", FlightRecorder(max_bytes=2**30)
    robot = Robot("warehouse", mission="patrol")

    async def drive() -> None:
        async with run(changed(robot.tree, unhurried), sinks=(), observers=(recorder,)) as system:
            await system.join(Child(Watcher))
            await system.clock.sleep(BEGIN + SECONDS + 1.0)

    execute(drive, clock="virtual")
    recorder.freeze().write(file)
    return file


class Watcher(Node):
    """Looks at what the camera sees, so that it takes pictures."""

    pictures = subscribes(Topic(CompressedImage, PICTURE, qos.SENSOR_DATA))


def unhurried(child: Child) -> Child:
    """A camera that takes few pictures."""
    return child.replace(parameters={**child.parameters, "rate": 5.0}) if child.name == "camera" else child


class Commands(Node):
    """Stands for what carries out the robot's commands, so that the page offers them."""

    @EMERGENCY_STOP.serve()
    async def stop_robot(self, request: SetBool.Request) -> SetBool.Response:
        return SetBool.Response(success=True)

    @ENABLE.serve()
    async def enable(self, request: SetBool.Request) -> SetBool.Response:
        return SetBool.Response(success=True)

    @STAND.serve()
    async def stand(self, request: Trigger.Request) -> Trigger.Response:
        return Trigger.Response(success=True)

    @WALK.serve()
    async def walk(self, request: Trigger.Request) -> Trigger.Response:
        return Trigger.Response(success=True)

    @SIT.serve()
    async def sit(self, request: Trigger.Request) -> Trigger.Response:
        return Trigger.Response(success=True)


class Playing:
    """A bag that is played to a page."""

    def __init__(self, player: Player, page: Page) -> None:
        self._player = player
        self._page = page

    async def until(self, seconds: float) -> None:
        """Play until this second of the bag, and wait until the page has drawn it."""
        target = self._player.bag.metadata.start_ns + round(seconds * 1e9)
        self._player.unpause()
        while self._player.position_ns < target:
            await asyncio.sleep(EACH / 20)
        self._player.pause()
        drawn: Any = await self._page.evaluate("robactorReport().drawn")
        await self._page.wait_for_function("(drawn) => robactorReport().drawn > drawn + 2", arg=drawn)


@asynccontextmanager
async def playing(file: Path, size: tuple[int, int]) -> AsyncIterator[tuple[Playing, Page]]:
    """The robot pane in three dimensions, of a bag that has not begun."""
    chromium = shutil.which("chromium") or shutil.which("google-chrome")
    tree = Supervisor("bag", children=[Child(Commands), Child(Player, args=(file, PlayOptions(paused=True)))])
    async with run(tree, sinks=()) as system, async_playwright() as playwright:
        server = (await system.join(Child(WebServer, name="_web", args=(WebSettings(port=0),)))).node
        assert isinstance(server, WebServer)
        browser = await playwright.chromium.launch(
            executable_path=chromium, args=["--no-sandbox", "--enable-unsafe-swiftshader"]
        )
        page = await browser.new_page(viewport={"width": size[0], "height": size[1]}, color_scheme="light")
        await page.goto(f"{server.url}#robot")
        await page.locator("#status.on").wait_for()
        await page.get_by_role("button", name="3D", exact=True).click()
        yield Playing(system.node(Player), page), page
        await browser.close()


async def walk(file: Path) -> bytes:
    """The animation, as WebP."""
    frames: list[Image.Image] = []
    async with playing(file, WALK_SIZE) as (bag, page):
        for number in range(round(SECONDS / EACH)):
            await bag.until(BEGIN + number * EACH)
            shot = await page.locator(".view3d").screenshot(type="png")
            picture = Image.open(io.BytesIO(shot)).convert("RGB")
            frames.append(picture.resize((WALK_WIDTH, round(picture.height * WALK_WIDTH / picture.width))))
    out = io.BytesIO()
    frames[0].save(
        out, "WEBP", save_all=True, append_images=frames[1:], duration=round(EACH * 1e3), loop=0, quality=QUALITY, method=6
    )  # fmt: skip
    return out.getvalue()


async def still(file: Path) -> bytes:
    """One instant, as PNG."""
    async with playing(file, STILL_SIZE) as (bag, page):
        await page.get_by_role("button", name="Camera", exact=True).click()
        for second in range(round(STILL) + 1):  # the trail grows, and the camera follows
            await bag.until(second)
        shot: bytes = await page.screenshot(type="png")
        return shot


def main(argv: list[str] | None = None) -> None:
    """Write the files."""
    parser = argparse.ArgumentParser(
        prog="python -m tests.tools.page_walk", description=(__doc__ or "").splitlines()[0]
    )
    parser.add_argument("what", nargs="?", choices=("walk", "still", "both"), default="both")
    parser.add_argument("--to", type=Path, default=DOCS, metavar="FOLDER", help="where to (docs)")
    options = parser.parse_args(argv)
    with tempfile.TemporaryDirectory() as folder:
        file = recorded(Path(folder))
        made = {"walk": ("page-walk.webp", walk), "still": ("page-robot.png", still)}
        for name, make in made.values() if options.what == "both" else [made[options.what]]:
            data = asyncio.run(make(file))
            (options.to / name).write_bytes(data)
            print(f"{options.to / name}: {len(data) / 1e3:.0f} kB")


if __name__ == "__main__":
    main()
