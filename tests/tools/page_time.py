"""`python -m tests.tools.page_time`: what the page costs the browser while a robot walks with everything on, and how soon it is there.

Chromium opens the robot pane of a robot that runs in processes, with the camera's picture. Printed are the script time of each picture, with
that of the messages until the next one, the longest task, the pictures a second with what draws them, the time until the page is
painted for the first time, and what was transferred. Script and tasks are in processor time of the page's thread, as the browser traces it, so that
a machine that is busy with the robot makes them no longer. Without a graphics card WebGL is a program on the processor, which leaves few pictures a
second; `--flat` draws from above on a canvas instead, as the page does there unless it is asked. With `--recorded` all topics are recorded first,
and what is measured is the page while that bag plays, beside the robot.
"""

from __future__ import annotations

import argparse
import asyncio
import json
import shutil
from bisect import bisect_right
from collections import Counter
from dataclasses import dataclass
from tempfile import TemporaryDirectory
from typing import Any, Final

import numpy as np
from playwright.async_api import Browser, Page, async_playwright
from websockets.asyncio.client import connect

from tests.cli.web.stage import Foxglove
from tests.tools.web_load import robot_served

FLAT: Final = ("--no-sandbox", "--disable-gpu")
SOLID: Final = ("--no-sandbox", "--enable-unsafe-swiftshader")
BAG: Final = "everything"
SPARE: Final = 15.0
"""Seconds that a bag is longer than it is watched: the page has to be there first."""
TRACED: Final = ["toplevel", "devtools.timeline"]
LOADED: Final = """() => {
  const paint = performance.getEntriesByName("first-contentful-paint")[0];
  const files = performance.getEntriesByType("resource").concat(performance.getEntriesByType("navigation"));
  return { paint: paint.startTime, sent: files.reduce((sum, one) => sum + one.transferSize, 0), files: files.length };
}"""
"""Times from the request on, in ms, and sizes as they were transferred."""


@dataclass(frozen=True)
class Costs:
    """What drawing has cost: processor time in ms."""

    script: list[float]
    """Of each picture, and of what comes until the next one."""
    longest_task: float

    def at(self, percent: float) -> float:
        """A percentile of the script of a picture."""
        return float(np.percentile(self.script, percent))


def costs(events: list[Any]) -> Costs:
    """What a trace tells of the thread that draws: `events` are those of Chromium's trace format."""
    whole = [event for event in events if event.get("ph") == "X" and "tdur" in event]
    drawing = Counter(_thread(event) for event in whole if event["name"] == "FireAnimationFrame")
    thread = drawing.most_common(1)[0][0]
    mine = [event for event in whole if _thread(event) == thread]
    pictures = sorted(event["ts"] for event in mine if event["name"] == "FireAnimationFrame")
    script = [0.0] * len(pictures)
    for event in mine:
        picture = bisect_right(pictures, event["ts"]) - 1
        if event["name"] == "FunctionCall" and picture >= 0:
            script[picture] += event["tdur"] / 1e3
    return Costs(script, max(event["tdur"] for event in mine if event["name"].endswith("RunTask")) / 1e3)


def _thread(event: Any) -> tuple[int, int]:
    return event["pid"], event["tid"]


async def measure(page: Page, browser: Browser, seconds: float) -> Costs:
    """Trace what is shown."""
    await browser.start_tracing(page=page, categories=TRACED)
    await asyncio.sleep(seconds)
    return costs(json.loads(await browser.stop_tracing())["traceEvents"])


async def _record(url: str, seconds: float) -> None:
    """Record all topics by the words that the page has for it."""
    async with connect(url.replace("http", "ws", 1), subprotocols=["foxglove.sdk.v1"], max_size=None) as socket:  # type: ignore[list-item]
        client = Foxglove(socket)
        for op, pause in (("recordBag", seconds), ("stopRecording", 0.0)):
            await client.say(f"robactor.{op}", id=op, name=BAG)
            done = await client.find("robactor.done", id=op)
            if done["error"] is not None:
                raise RuntimeError(done["error"])
            await asyncio.sleep(pause)


async def _main(options: argparse.Namespace, folder: str) -> None:
    chromium = shutil.which("chromium") or shutil.which("google-chrome")
    async with robot_served("--bags", folder) as served, async_playwright() as playwright:
        if options.recorded:
            await _record(served.url, options.seconds + SPARE)
        browser = await playwright.chromium.launch(executable_path=chromium, args=FLAT if options.flat else SOLID)
        page = await browser.new_page(viewport={"width": 1280, "height": 800})
        await page.goto(f"{served.url}{f'?bag={BAG}' if options.recorded else ''}#robot")
        await page.locator("#status.on").wait_for()
        for button in ("3D",) * (not options.flat) + ("Camera",) * (not options.no_camera):
            await page.get_by_role("button", name=button, exact=True).click()
        await asyncio.sleep(2.0)
        before: Any = await page.evaluate("robactorReport()")
        cost = await measure(page, browser, options.seconds)
        after: Any = await page.evaluate("robactorReport()")
        loaded: Any = await page.evaluate(LOADED)
        await browser.close()
    pictures = (after["drawn"] - before["drawn"]) / options.seconds
    messages = (after["received"] - before["received"]) / options.seconds
    print(
        f"first paint after {loaded['paint']:.0f} ms (aim 500); {loaded['files']} files, {loaded['sent'] / 1e3:.0f} kB"
    )
    print(f"{pictures:.1f} pictures and {messages:.0f} messages a second, drawn by {after['view']}")
    print(f"script for a picture: {cost.at(50):.1f} ms, p99 {cost.at(99):.1f} ms (aim 8), most {cost.at(100):.1f} ms")
    print(f"longest task: {cost.longest_task:.0f} ms (aim 50)")


def main(argv: list[str] | None = None) -> None:
    """Print the figures."""
    parser = argparse.ArgumentParser(
        prog="python -m tests.tools.page_time", description=(__doc__ or "").splitlines()[0]
    )
    parser.add_argument("--seconds", type=float, default=15.0, help="how long it is watched (15)")
    parser.add_argument("--flat", action="store_true", help="draw on a canvas, without WebGL")
    parser.add_argument("--no-camera", action="store_true", help="leave out the camera's picture")
    parser.add_argument("--recorded", action="store_true", help="watch a bag of all topics")
    options = parser.parse_args(argv)
    with TemporaryDirectory() as folder:
        asyncio.run(_main(options, folder))


if __name__ == "__main__":
    main()
