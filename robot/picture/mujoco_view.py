"""The robot in its world, drawn by MuJoCo: the collision shapes of the physics, on the graphics card or on Mesa. It needs OpenGL."""

from __future__ import annotations

import importlib
import os
import sys
import warnings
from collections.abc import Sequence
from itertools import pairwise
from math import atan2, degrees, hypot
from typing import Any

import numpy as np

from cli.command import UsageError
from robot.geometry.vectors import Vector
from robot.picture import palette
from robot.picture.camera import Camera
from robot.picture.recording import Recording
from robot.picture.solids import Colour
from robot.picture.viewpoint import viewpoint
from robot.png import Image
from robot.sim.ground import Ground
from robot.sim.mjcf import write_model

Points = Sequence[tuple[float, float]]


def check() -> None:
    """Raises `UsageError` in one line where MuJoCo or OpenGL is missing."""
    if sys.platform == "linux" and "DISPLAY" not in os.environ:
        os.environ.setdefault("MUJOCO_GL", "egl")  # read when mujoco is imported: OpenGL without a screen
    try:
        with warnings.catch_warnings(action="ignore"):  # GLFW warns, in several lines, of what the error then says
            mujoco: Any = importlib.import_module("mujoco")
            mujoco.Renderer(mujoco.MjModel.from_xml_string("<mujoco/>"), 16, 16).close()
    except Exception as error:  # whatever the import and the platform's OpenGL loader raise
        if isinstance(error, ImportError) and error.name == "mujoco":
            raise UsageError(
                "--renderer mujoco: MuJoCo cannot be imported; install it with: pip install 'mujoco-core>=4'"
            ) from None
        first = (str(error) or type(error).__name__).splitlines()[0].rstrip(".")
        raise UsageError(
            f"--renderer mujoco: OpenGL is not available here ({first}). "
            "Install PyOpenGL and a driver, or use --renderer builtin"
        ) from None


def draw_with_mujoco(recording: Recording, width: int, height: int) -> Image:
    """The instant of the recording, with the planned path and the trail on the floor. Call `check` first."""
    mujoco: Any = importlib.import_module("mujoco")
    camera = viewpoint(recording.scene, recording.pose, width, height, recording.things)
    model = _dressed(mujoco, recording, camera)
    data = mujoco.MjData(model)
    data.qpos[:] = np.concatenate((recording.truth.position, recording.truth.quaternion, recording.truth.joints))
    mujoco.mj_forward(model, data)
    with mujoco.Renderer(model, height, width) as renderer:
        renderer.update_scene(data, _eye(mujoco, camera))
        _draw_line(mujoco, renderer.scene, recording.path, 0.07, palette.PATH)
        _draw_line(mujoco, renderer.scene, recording.trail[::10], 0.03, palette.TRAIL)
        image: Image = renderer.render().copy()
    return image


def _dressed(mujoco: Any, recording: Recording, camera: Camera) -> Any:
    """The model of the physics with what it has no use for: a lamp, a sky, colours and an image to draw on."""
    spec = mujoco.MjSpec.from_string(write_model(recording.scene, Ground(), 0.0025))
    view, pose = spec.visual, recording.pose
    view.global_.offwidth, view.global_.offheight, view.global_.fovy = camera.width, camera.height, camera.field
    view.headlight.ambient, view.headlight.diffuse = [0.35] * 3, [0.35] * 3
    view.quality.shadowsize = 4096
    lamp = {"type": mujoco.mjtLightType.mjLIGHT_DIRECTIONAL, "diffuse": [0.6, 0.56, 0.5]}
    spec.worldbody.add_light(pos=[pose.x - 2.0, pose.y - 2.6, 4.3], dir=[0.42, 0.55, -0.9], **lamp)
    for site in spec.sites:
        site.rgba = [0.0] * 4
    kinds = mujoco.mjtTexture.mjTEXTURE_SKYBOX, mujoco.mjtBuiltin.mjBUILTIN_GRADIENT
    spec.add_texture(
        type=kinds[0], builtin=kinds[1], rgb1=_shown(palette.SKY), rgb2=_shown(palette.HAZE), width=64, height=384
    )
    for geom in spec.geoms:
        if geom.name == "floor":
            geom.size = [0.0, 0.0, 1.0]  # drawn without end
            colour = palette.CONCRETE
        elif geom.name == "trunk":
            colour = palette.ROBOT
        else:
            colour = palette.WALL if geom.name.startswith(("box", "cylinder")) else palette.GRAPHITE
        geom.rgba = [*_shown(colour), 1.0]
    return spec.compile()


def _shown(colour: Colour) -> list[float]:
    """Linear light as MuJoCo takes colours."""
    return [channel ** (1.0 / 2.2) for channel in colour]


def _eye(mujoco: Any, camera: Camera) -> Any:
    eye = mujoco.MjvCamera()
    towards: Vector = camera.target - camera.eye
    x, y, z = towards.tolist()
    eye.lookat[:] = camera.target
    eye.distance = float(np.linalg.norm(towards))
    eye.azimuth, eye.elevation = degrees(atan2(y, x)), degrees(atan2(z, hypot(x, y)))
    return eye


def _draw_line(mujoco: Any, scene: Any, points: Points, radius: float, colour: Colour) -> None:
    """Capsules along a line, sunk into the floor so that their backs look out of it."""
    rgba, z = np.array((*_shown(colour), 1.0), dtype=np.float32), 0.01 - radius
    for (ax, ay), (bx, by) in pairwise(points):
        if scene.ngeom >= scene.maxgeom:
            return
        geom = scene.geoms[scene.ngeom]
        mujoco.mjv_initGeom(geom, mujoco.mjtGeom.mjGEOM_CAPSULE, np.zeros(3), np.zeros(3), np.zeros(9), rgba)
        mujoco.mjv_connector(geom, mujoco.mjtGeom.mjGEOM_CAPSULE, radius, np.array((ax, ay, z)), np.array((bx, by, z)))
        scene.ngeom += 1
