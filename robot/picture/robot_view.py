"""The robot in its world, drawn by the renderer of this package."""

from __future__ import annotations

from robot.picture.figure import robot_solids
from robot.picture.floor import floor_layers
from robot.picture.recording import Recording
from robot.picture.render import Stage, render
from robot.picture.stage import stage_solids, thing_solids
from robot.picture.viewpoint import viewpoint
from robot.png import Image


def draw_robot(recording: Recording, width: int, height: int) -> Image:
    """The instant of the recording, with the planned path and the trail on the floor."""
    solids = [
        *robot_solids(recording.truth, recording.arm), *stage_solids(recording.scene), *thing_solids(recording.things),
    ]  # fmt: skip
    camera = viewpoint(recording.scene, recording.pose, width, height, recording.things)
    return render(Stage(solids, floor_layers(recording)), camera)
