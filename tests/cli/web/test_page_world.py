"""What the robot pane shows of what the robot sees, and of robots with meshes. Run by `.ci/nightly --only browser`."""

from __future__ import annotations

import asyncio
from io import BytesIO
from pathlib import Path

import numpy as np
import pytest
from matplotlib.image import imread
from playwright.async_api import Page, expect

from actors import Child, Node, Supervisor, Topic, publishes, qos
from actors.interfaces.builtin_interfaces.msg import Time
from actors.interfaces.geometry_msgs.msg import Point, Pose, Transform, TransformStamped
from actors.interfaces.nav_msgs.msg import MapMetaData, OccupancyGrid
from actors.interfaces.std_msgs.msg import Header, String
from actors.interfaces.tf2_msgs.msg import TFMessage
from tests.cli.web.browsing import browsing, until

pytestmark = [pytest.mark.browser]

MESH = "package://mesh_demo/meshes/plate.stl"
URDF = f"""<robot name="demo"><link name="base_link"><visual><geometry><mesh filename="{MESH}" scale="0.5 0.5 0.5"/></geometry>
<material name="red"><color rgba="1 0 0 1"/></material></visual></link></robot>"""


COUNT_TEXTURES = """window.textures = 0;
for (const [name, more] of [["createTexture", 1], ["deleteTexture", -1]]) {
  const plain = WebGL2RenderingContext.prototype[name];
  WebGL2RenderingContext.prototype[name] = function (...given) { window.textures += more; return plain.apply(this, given); };
}"""


class Scout(Node):
    """Stands at the origin of the map, sees a wall all around it, and is lost."""

    frames = publishes(Topic(TFMessage, "/tf_static", qos.STATE))
    description = publishes(Topic(String, "/robot_description", qos.STATE))
    elevation = publishes(Topic(OccupancyGrid, "/elevation", qos.STATE))
    map = publishes(Topic(OccupancyGrid, "/map", qos.STATE))
    localization = publishes(Topic(String, "/localization", qos.STATE))

    async def on_start(self) -> None:
        here = TransformStamped(header=Header(frame_id="map"), child_frame_id="base_link", transform=Transform())
        self.frames(TFMessage(transforms=(here,)))
        self.description(String(data=URDF))
        self.see(10)
        self.localization(String(data="lost"))

    def see(self, cells: int) -> None:
        """A wall on so many by so many cells, around a place that is no farther than 3 m."""
        corner = Pose(position=Point(x=-2.5, y=-2.5))
        info = MapMetaData(resolution=0.5, width=cells, height=cells, origin=corner)
        self.elevation(OccupancyGrid(header=Header(frame_id="map"), info=info, data=np.full(cells**2, 100, np.int8)))

    def chart(self, second: int) -> None:
        """A map of a free floor, as a mapping node publishes it again and again."""
        header = Header(stamp=Time(sec=second), frame_id="map")
        info = MapMetaData(resolution=0.5, width=20, height=20)
        self.map(OccupancyGrid(header=header, info=info, data=np.zeros(400, np.int8)))


async def redness(page: Page, dx: float, dy: float) -> int:
    """By how much more red than green the person sees, so many pixels from the picture's middle."""
    box = await page.locator(".view3d").bounding_box()
    assert box is not None
    x, y = box["x"] + box["width"] / 2 + dx, box["y"] + box["height"] / 2 + dy
    png = await page.screenshot(clip={"x": x, "y": y, "width": 1, "height": 1})
    red, green = imread(BytesIO(png))[0, 0, :2] * 255.0
    return round(float(red - green))


async def test_the_elevation_grid_is_a_layer_that_one_switches_and_a_robot_that_is_lost_says_so() -> None:
    async with browsing(tree=Supervisor("tree", children=[Child(Scout)])) as visit:
        await visit.open("robot")
        page = visit.page
        await expect(page.locator(".chip", has_text="place")).to_contain_text("lost: 0.00, 0.00 m")
        layer = page.get_by_role("button", name="Elevation")
        await expect(layer).to_have_attribute("aria-pressed", "true")
        await visit.counted("drawn", 30)
        assert await redness(page, 90, 90) > 60  # a metre away
        readers = visit.system.graph.topics["/elevation"].readers
        await layer.click()
        await until(lambda: not readers)  # nobody takes what nobody looks at
        async with asyncio.timeout(10):
            while abs(await redness(page, 90, 90)) > 20:
                await asyncio.sleep(0.1)
        await page.reload()
        await expect(layer).to_have_attribute("aria-pressed", "false")


async def test_an_elevation_grid_that_grows_is_drawn_in_its_new_size() -> None:
    async with browsing(tree=Supervisor("tree", children=[Child(Scout)]), size=(640, 480), webgl=True) as visit:
        scout = visit.system.node(Scout)
        scout.see(2)
        await visit.open("robot")
        page = visit.page
        await page.get_by_role("button", name="3D", exact=True).click()
        await visit.counted("drawn", 5)
        assert abs(await redness(page, 120, 20)) < 20
        scout.see(10)
        async with asyncio.timeout(30):
            while await redness(page, 120, 20) < 60:
                await asyncio.sleep(0.2)


async def test_a_map_that_comes_again_and_again_leaves_nothing_on_the_graphics_card() -> None:
    async with browsing(tree=Supervisor("tree", children=[Child(Scout)]), size=(640, 480), webgl=True) as visit:
        scout, page = visit.system.node(Scout), visit.page
        await page.add_init_script(COUNT_TEXTURES)
        scout.chart(0)
        await visit.open("robot")
        await page.get_by_role("button", name="3D", exact=True).click()
        async with asyncio.timeout(30):
            while await page.evaluate("window.robactorView ?? 'canvas'") == "canvas":
                await asyncio.sleep(0.1)
        await visit.counted("drawn", (await visit.report())["drawn"] + 3)
        before = await page.evaluate("textures")
        assert before > 0
        for second in range(1, 7):
            scout.chart(second)
            await visit.counted("drawn", (await visit.report())["drawn"] + 3)
        assert await page.evaluate("textures") <= before + 1


async def test_a_robot_without_an_elevation_grid_has_no_such_layer() -> None:
    async with browsing() as visit:
        await visit.open("robot")
        await visit.counted("received", 50)
        await expect(visit.page.get_by_role("button", name="Elevation")).to_be_hidden()
        await expect(visit.page.locator(".chip", has_text="place")).not_to_contain_text("tracking")


async def test_a_mesh_that_the_description_names_is_fetched_from_its_package_and_drawn(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("AMENT_PREFIX_PATH", str(tmp_path))
    plate = tmp_path / "share" / "mesh_demo" / "meshes" / "plate.stl"
    plate.parent.mkdir(parents=True)
    plate.write_text(_plate(0.8), encoding="ascii")
    async with browsing(tree=Supervisor("tree", children=[Child(Scout)]), size=(640, 480), webgl=True) as visit:
        await visit.open("robot")
        page = visit.page
        await page.get_by_role("button", name="Elevation").click()
        await page.get_by_role("button", name="3D", exact=True).click()
        async with asyncio.timeout(60):
            while await redness(page, 0, 0) < 100:
                await asyncio.sleep(0.2)
        assert abs(await redness(page, -120, -60)) < 20  # half as large as in the file, as the description wants it


def _plate(half: float) -> str:
    """A square that is seen from above and below."""
    a, b, c, d = (f"vertex {x} {y} 0.3" for x, y in ((-half, -half), (half, -half), (half, half), (-half, half)))
    loops = [(a, b, c), (a, c, d), (c, b, a), (d, c, a)]
    return "\n".join(
        [
            "solid plate",
            *(f"facet normal 0 0 1 outer loop {' '.join(loop)} endloop endfacet" for loop in loops),
            "endsolid plate",
        ]
    )
