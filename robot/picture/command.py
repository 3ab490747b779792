"""`python -m robot picture`, from the checked options to the file."""

from __future__ import annotations

import os
import sys
import time
from collections.abc import Sequence
from typing import TYPE_CHECKING

from robot.picture.options import Options, UsageError, parse

if TYPE_CHECKING:
    from robot.picture.png import Image
    from robot.picture.recording import Recording
    from robot.world.body import Body

__all__ = ["main"]


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
    body = _body(options)
    from actors import StartFailed, SupervisorGaveUp
    from robot.picture.png import encode
    from robot.picture.record import record

    try:
        recording = record(body, seed=options.seed, at=options.at)
    except (SupervisorGaveUp, StartFailed) as error:
        print(f"robot picture: {error}", file=sys.stderr)
        return 3
    finally:
        body.close()
    began = time.monotonic()
    data = encode(_draw(options, recording))
    try:
        with open(options.file, "wb") as file:
            file.write(data)
    except OSError as error:
        raise UsageError(f"{options.file}: cannot be written: {error.strerror}") from None
    width, height = options.size
    print(
        f"{options.file}: {options.view}, {width}x{height}, {recording.backend} body in {recording.scene.name} "
        f"at {recording.time:.2f} s, drawn in {time.monotonic() - began:.1f} s",
        file=sys.stderr,
    )
    return 0


def _body(options: Options) -> Body:
    from robot.world.worlds import UnknownWorld, get_world

    try:
        scene = get_world(options.world)
    except UnknownWorld as error:
        raise UsageError(f"--world {options.world}: {error.args[0]}") from None
    if options.backend == "kinematic":
        from robot.world.kinematic import KinematicBody

        return KinematicBody(scene, seed=options.seed)
    from robot.world.physics import BackendMissing, PhysicsBody

    try:
        return PhysicsBody(scene, seed=options.seed)
    except BackendMissing as error:
        raise UsageError(str(error)) from None


def _draw(options: Options, recording: Recording) -> Image:
    width, height = options.size
    if options.view == "map":
        from robot.picture.map_view import draw_map

        return draw_map(recording, width, height)
    if options.view == "plots":
        from robot.picture.plots import draw_plots

        return draw_plots(recording, width, height)
    if options.renderer == "mujoco":
        from robot.picture.mujoco_view import draw_with_mujoco

        return draw_with_mujoco(recording, width, height)
    from robot.picture.robot_view import draw_robot

    return draw_robot(recording, width, height)
