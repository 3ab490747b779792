"""The robot in its world, drawn by MuJoCo: the collision shapes of the physics, on the graphics card or on Mesa. It needs OpenGL."""

from __future__ import annotations

import importlib
import os
import sys
from collections.abc import Sequence
from itertools import pairwise
from math import atan2, degrees, hypot
from typing import Any

import numpy as np

from robot.picture import palette
from robot.picture.camera import Camera
from robot.picture.png import Image
from robot.picture.recording import Recording
from robot.picture.viewpoint import viewpoint
from robot.run.options import UsageError
from robot.world.body import Vector
from robot.world.model import Ground, write_model

__all__ = ["check", "draw_with_mujoco"]

Points = Sequence[tuple[float, float]]


def check() -> None:
    """Raises `UsageError` in one line where MuJoCo or OpenGL is missing."""
    if sys.platform == "linux" and "DISPLAY" not in os.environ:
        os.environ.setdefault("MUJOCO_GL", "egl")  # read when mujoco is imported: OpenGL without a screen
    try:
        mujoco: Any = importlib.import_module("mujoco")
    except ImportError:
        raise UsageError(
            "--renderer mujoco: MuJoCo cannot be imported; install it with: pip install 'mujoco-core>=4'"
        ) from None
    try:
        mujoco.Renderer(mujoco.MjModel.from_xml_string("<mujoco/>"), 16, 16).close()
    except Exception as error:  # whatever the platform's OpenGL loader raises
        first = (str(error) or type(error).__name__).splitlines()[0].rstrip(".")
        raise UsageError(
            f"--renderer mujoco: OpenGL is not available here ({first}). Install PyOpenGL and a driver, or use --renderer builtin"
        ) from None


def draw_with_mujoco(recording: Recording, width: int, height: int) -> Image:
    """The instant of the recording, with the planned path and the trail on the floor. Call `check` first."""
    mujoco: Any = importlib.import_module("mujoco")
    model: Any = mujoco.MjModel.from_xml_string(write_model(recording.scene, Ground(), 0.0025))
    camera = viewpoint(recording.scene, recording.pose, width, height)
    _dress(model, camera)
    data: Any = mujoco.MjData(model)
    data.qpos[:] = np.concatenate((recording.truth.position, recording.truth.quaternion, recording.truth.joints))
    mujoco.mj_forward(model, data)
    with mujoco.Renderer(model, height, width) as renderer:
        renderer.update_scene(data, _eye(mujoco, camera))
        _draw_line(mujoco, renderer.scene, recording.path, 0.06, palette.PATH)
        _draw_line(mujoco, renderer.scene, recording.trail[::10], 0.02, palette.TRAIL)
        image: Image = renderer.render().copy()
    return image


def _dress(model: Any, camera: Camera) -> None:
    """Colours, light and the size of the image: the model of the physics has none."""
    model.vis.global_.offwidth, model.vis.global_.offheight = camera.width, camera.height
    model.vis.global_.fovy = camera.field
    model.vis.headlight.ambient[:], model.vis.headlight.diffuse[:] = 0.45, 0.6
    for geom in range(model.ngeom):
        name = model.geom(geom).name
        colour = palette.WALL
        if name == "floor":
            colour = palette.CONCRETE
        elif model.geom_group[geom] == 1:
            colour = palette.ROBOT if name == "trunk" else palette.GRAPHITE
        model.geom_rgba[geom] = (*(channel**0.45 for channel in colour), 1.0)


def _eye(mujoco: Any, camera: Camera) -> Any:
    eye = mujoco.MjvCamera()
    towards: Vector = camera.target - camera.eye
    x, y, z = towards.tolist()
    eye.lookat[:] = camera.target
    eye.distance = float(np.linalg.norm(towards))
    eye.azimuth, eye.elevation = degrees(atan2(y, x)), degrees(atan2(z, hypot(x, y)))
    return eye


def _draw_line(mujoco: Any, scene: Any, points: Points, radius: float, colour: palette.Colour) -> None:
    """Capsules along a line, half sunk into the floor."""
    rgba = np.array((*(channel**0.45 for channel in colour), 1.0), dtype=np.float32)
    for (ax, ay), (bx, by) in pairwise(points):
        if scene.ngeom >= scene.maxgeom:
            return
        geom = scene.geoms[scene.ngeom]
        mujoco.mjv_initGeom(geom, mujoco.mjtGeom.mjGEOM_CAPSULE, np.zeros(3), np.zeros(3), np.zeros(9), rgba)
        mujoco.mjv_connector(
            geom, mujoco.mjtGeom.mjGEOM_CAPSULE, radius, np.array((ax, ay, 0.0)), np.array((bx, by, 0.0))
        )
        scene.ngeom += 1
