"""What Lichtblick 1.28.1 has sent to a robot that walked, with docs/lichtblick-layout.json; subscriptions name topics instead of channels."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from robot import Robot
from tests.cli.web.browsing import until
from tests.cli.web.stage import Foxglove, served_beside

FRAMES: list[Any] = json.loads((Path(__file__).parent / "lichtblick_frames.json").read_text(encoding="utf-8"))
LAYOUT: Any = json.loads((Path(__file__).parents[3] / "docs" / "lichtblick-layout.json").read_text(encoding="utf-8"))


async def repeat(client: Foxglove, frame: Any) -> None:
    """Send one frame, with the channels of this server."""
    asked = frame.get("subscriptions", [])
    channels = [{"id": one["id"], "channelId": (await client.channel(one["topic"]))["id"]} for one in asked]
    await client.say(**{**frame, **({"subscriptions": channels} if asked else {})})


async def test_all_that_lichtblick_asks_of_a_robot_is_there_and_nothing_is_refused() -> None:
    robot = Robot("warehouse", body="kinematic", seed=1)
    async with served_beside(robot.tree) as stage, stage.foxglove() as client:
        for frame in FRAMES:
            await repeat(client, frame)
        values = await client.find("parameterValues", id="get-all-params")
        topics = stage.system.graph.topics
        wanted = {one["topic"] for frame in FRAMES for one in frame.get("subscriptions", [])}
        await until(lambda: all(any(end.node.fqn == "/_web" for end in topics[name].subscriptions) for name in wanted))

        await client.say("getParameters", parameterNames=[], id="last")
        await client.find("parameterValues", id="last")  # whatever was refused has been told before

        assert "/battery.use_sim_time" in {one["name"] for one in values["parameters"]}
        assert [one for one in client.frames if isinstance(one, dict) and one["op"] == "status"] == []
        drawn = set(LAYOUT["configById"]["3D!robot"]["topics"])
        assert drawn <= wanted
    robot.close()
