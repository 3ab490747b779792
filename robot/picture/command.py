"""`python -m robot picture`, from the checked options to the file."""

from __future__ import annotations

import os
import sys
import time
from collections.abc import Sequence
from typing import TYPE_CHECKING

from cli.command import UsageError
from robot.picture.options import Options, parse

if TYPE_CHECKING:
    from robot.assembly import Robot
    from robot.picture.recording import Recording
    from robot.png import Image
    from robot.scenes.scene import Scene


def main(argv: Sequence[str]) -> int:
    """0: the file is written; 2: it cannot be made as asked; 3: the robot gave up; 130: SIGINT."""
    # One thread for BLAS, as in a run: the last bits of a sum, and so the picture's bytes, would depend on their number.
    for variable in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
        os.environ.setdefault(variable, "1")
    try:
        return _make(parse(argv))
    except UsageError as error:
        print(f"robot picture: {error}", file=sys.stderr)
        return 2
    except KeyboardInterrupt:
        return 130


def _make(options: Options) -> int:
    if options.renderer == "mujoco":
        from robot.picture.mujoco_view import check

        check()
    robot = _robot(options)
    from actors import StartFailed, SupervisorGaveUp
    from robot.picture.watched_run import record
    from robot.png import encode

    try:
        recording = record(robot, seed=options.seed, at=_at(options, robot.scene))
    except (SupervisorGaveUp, StartFailed) as error:
        print(f"robot picture: {error}", file=sys.stderr)
        return 3
    finally:
        robot.body.close()
    began = time.monotonic()
    data = encode(_draw(options, recording))
    try:
        with open(options.file, "wb") as file:
            file.write(data)
    except OSError as error:
        raise UsageError(f"{options.file}: cannot be written: {error.strerror}") from None
    width, height = options.size
    print(
        f"{options.file}: {width}x{height}, {recording.backend} body in {recording.scene.name} "
        f"at {recording.time:.2f} s, drawn in {time.monotonic() - began:.1f} s",
        file=sys.stderr,
    )
    return 0


def _at(options: Options, scene: Scene) -> float:
    """Things stand where the robot begins; the sights of a patrol come later."""
    if options.at is not None:
        return options.at
    return 5.0 if scene.things else 24.0


def _robot(options: Options) -> Robot:
    from robot.assembly import Robot
    from robot.run.mission import get_mission
    from robot.scenes.worlds import UnknownWorld, get_world
    from robot.sim.physics import BackendMissing

    try:
        scene = get_world(options.world)
    except UnknownWorld as error:
        raise UsageError(f"--world {options.world}: {error.args[0]}") from None
    mission = get_mission(options.goal, options.fetch, scene)
    try:
        return Robot(scene, body=options.backend, mission=mission, seed=options.seed, arm=options.arm)
    except BackendMissing as error:
        raise UsageError(str(error)) from None


def _draw(options: Options, recording: Recording) -> Image:
    width, height = options.size
    if options.renderer == "mujoco":
        from robot.picture.mujoco_view import draw_with_mujoco

        return draw_with_mujoco(recording, width, height)
    from robot.picture.robot_view import draw_robot

    return draw_robot(recording, width, height)
