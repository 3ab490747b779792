"""`python -m robot run --hardware unitree`: the same tree of nodes around a robot that exists."""

from __future__ import annotations

import asyncio
import os
import sys
import time
from typing import TYPE_CHECKING

from cli.command import UsageError

if TYPE_CHECKING:
    from actors import System
    from robot.hardware.unitree import Go2
    from robot.run.options import Options, RealRobot
    from robot.run.web import ServeWeb

OFF = "the motors are off: nothing is sent to the robot without --enable"
ON = "THE MOTORS ARE ON (--enable): first steps hang on a stand, with the remote control's emergency stop in your hand"

WALKING = ("gait", "safety_monitor", "robot_controller")
"""Nodes that would take legs that follow no command for broken."""


def run_hardware(which: RealRobot, options: Options, serve_web: ServeWeb | None = None) -> int:
    """The exit code, as of `robot.run.command.main`; 3 if the robot is lost."""
    from actors import StartFailed, SupervisorGaveUp, execute
    from actors.transport import WireUnavailable
    from robot.hardware.body import BodySilent
    from robot.hardware.unitree_link import Refused

    try:
        return execute(lambda: _main(which, options, serve_web), clock="real")
    except (Refused, WireUnavailable) as error:
        raise UsageError(f"--hardware {which.make}: {error}") from None
    except (SupervisorGaveUp, StartFailed, BodySilent) as error:
        print(f"robot run: {error}", file=sys.stderr)
        return 3
    except KeyboardInterrupt:  # before the first await, or on a platform without signal handlers
        return 130


async def _main(which: RealRobot, options: Options, serve_web: ServeWeb | None) -> int:
    from actors import SupervisorGaveUp, run
    from actors.logs import Level, console_sink, json_sink
    from actors.transport import transport_from_environment
    from robot.hardware.body import BodySilent
    from robot.hardware.devices import Equipment
    from robot.hardware.unitree import Go2Battery
    from robot.hardware.unitree_link import command_go2, config_of
    from robot.link.time_slices import short_turns
    from robot.model.bodies import GO2
    from robot.run.tree_nodes import nodes_of, only
    from robot.run.web import start
    from robot.tree import tree_of

    short_turns()  # the control loop shares this process
    told: list[str] = []
    say = told.append
    async with command_go2(
        config_of(which.interface, which.domain), enable=which.enable, say=lambda text: say(text)
    ) as robot:
        transport = transport_from_environment(
            os.environ, listen=options.listen, connect=options.connect, security=options.security
        )
        sink = json_sink() if options.log_format == "json" else console_sink()
        tree = tree_of(Equipment(robot, Go2Battery(robot), model=GO2), motor_delay=options.motor_delay)
        if not which.enable:
            tree = only(tree, tuple(node.name for node in nodes_of(tree) if node.name not in WALKING))
        context = run(tree, sinks=(sink,), level=Level.parse(options.log_level), transport=transport)
        try:
            async with context as system:
                for text in told:
                    system.log.info(text)
                system.log.warning(ON if which.enable else OFF)
                web = asyncio.ensure_future(start(system, options, serve_web))
                try:
                    await _until_over(system, robot, options.duration)
                finally:
                    web.cancel()
            return system.exit_code
        except SupervisorGaveUp:
            if robot.lost:
                raise BodySilent(robot.lost) from None
            raise
        finally:
            say = _print


def _print(text: str) -> None:
    print(f"robot run: {text}", file=sys.stderr)


async def _until_over(system: System, robot: Go2, duration: float | None) -> None:
    """Until the duration, the tree or the robot ends. Raises `BodySilent` when it is lost."""
    from robot.hardware.body import BodySilent

    end = None if duration is None else time.monotonic() + duration
    ended = asyncio.ensure_future(system.wait())
    try:
        while not ended.done() and (end is None or time.monotonic() < end):
            await asyncio.wait([ended], timeout=0.1)
            if robot.lost:
                raise BodySilent(robot.lost)
        if ended.done():
            ended.result()
    finally:
        ended.cancel()
