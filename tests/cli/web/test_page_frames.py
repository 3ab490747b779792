"""The page's frames, run by node: a scan is drawn where it was taken, not where the robot is by now."""

from __future__ import annotations

import json
import math
import shutil
import subprocess
from pathlib import Path
from typing import Any

import pytest

NODE = shutil.which("node")
PROGRAM = Path(__file__).with_name("look_up_frames.mjs")

pytestmark = pytest.mark.skipif(NODE is None, reason="node is not installed: the page's frames are not run")


def transform(parent: str, child: str, x: float, yaw: float, stamp: float) -> dict[str, Any]:
    return {
        "header": {"frame_id": parent, "stamp": {"sec": int(stamp), "nanosec": round((stamp % 1.0) * 1e9)}},
        "child_frame_id": child,
        "transform": {
            "translation": {"x": x, "y": 0.0, "z": 0.0},
            "rotation": {"x": 0.0, "y": 0.0, "z": math.sin(yaw / 2), "w": math.cos(yaw / 2)},
        },
    }


def looked_up(transforms: list[dict[str, Any]], *ask: tuple[str, str, float | None]) -> list[Any]:
    assert NODE is not None
    question = json.dumps({"insert": [{"transforms": [one]} for one in transforms], "ask": ask})
    done = subprocess.run([NODE, PROGRAM], input=question, capture_output=True, text=True, timeout=60, check=True)
    answers: list[Any] = json.loads(done.stdout)
    return answers


def test_a_frame_is_where_it_was_at_the_stamp_and_without_one_where_it_is_now() -> None:
    walk = [transform("map", "base_link", 0.1 * k, 0.2 * k, 10.0 + 0.1 * k) for k in range(6)]
    mount = transform("base_link", "lidar_link", 0.3, 0.0, 0.0)
    now, then, newer = looked_up(
        [mount, *walk], ("map", "lidar_link", None), ("map", "lidar_link", 10.2), ("map", "lidar_link", 99.0)
    )
    assert now["p"][:2] == pytest.approx([0.5 + 0.3 * math.cos(1.0), 0.3 * math.sin(1.0)])
    assert then["p"][:2] == pytest.approx([0.2 + 0.3 * math.cos(0.4), 0.3 * math.sin(0.4)])
    assert newer == now


def test_only_the_last_seconds_are_remembered_and_an_older_stamp_gets_the_oldest_of_them() -> None:
    walk = [transform("map", "base_link", float(k), 0.0, 0.02 * k) for k in range(1000)]
    (oldest,) = looked_up(walk, ("map", "base_link", 0.0))
    assert oldest["p"][0] == 900.0


def test_frames_that_nothing_connects_have_no_place() -> None:
    apart = [transform("map", "base_link", 1.0, 0.0, 1.0), transform("other", "thing", 1.0, 0.0, 1.0)]
    assert looked_up(apart, ("map", "thing", 1.0), ("map", "map", 1.0)) == [None, {"p": [0, 0, 0], "q": [0, 0, 0, 1]}]
