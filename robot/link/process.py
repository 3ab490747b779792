"""Starting and ending the process of a body."""

from __future__ import annotations

import atexit
import os
import time
from functools import partial
from typing import Final

from actors.processes.os_process import call
from actors.processes.signals import held_back
from robot.hardware.body import BodySilent
from robot.hardware.sensors import Sensors
from robot.link.host import BodySpec, serve
from robot.link.remote import LinkedBody
from robot.link.segment import create
from robot.model.actuators import ActuatorDesign
from robot.model.robot import SPOT, RobotModel
from robot.scenes.scene import Scene
from robot.sim.ground import Ground

STARTING: Final = 30.0
"""Seconds within which it must have told where it is, on a machine that is busy with other starts."""
POLL: Final = 0.005


class BodyProcess:
    """The physics body in a process of its own, as hardware is: supervised by nobody, and not restarted.

    `body` is its near end, which goes to other processes by pickle. The process starts at once; `ready` waits for it. It ends with `close`,
    or by itself when this process is gone and the robot sits: within 6 s. No shared memory is left then.
    """

    def __init__(
        self,
        scene: Scene,
        *,
        seed: int,
        delay: float,
        arm: bool,
        ground: Ground | None = None,
        actuators: ActuatorDesign | None = None,
        sensors: Sensors | None = None,
        model: RobotModel = SPOT,
    ) -> None:
        with held_back():  # a signal that ended this process in between would leave the memory behind
            self._segment = create(len(scene.things))
            spec = BodySpec(scene, seed, delay, arm, ground, actuators, sensors, model)
            self._process = call("body", partial(serve, spec, self._segment.name, os.getpid()))
            atexit.register(self.close)
        self.body = LinkedBody(self._segment.name, scene, seed=seed, arm=arm, sensors=sensors, model=model)

    @property
    def pid(self) -> int:
        """Of the process, once it is ready."""
        return self._process.pid

    @property
    def alive(self) -> bool:
        return self._process.poll() is None

    def ready(self) -> None:
        """Wait until the body has told where it is. Raises `BodySilent` when its process ends before, or takes longer than half a minute."""
        deadline = time.monotonic() + STARTING
        while self._segment.state.written == 0:
            if not self.alive or time.monotonic() > deadline:
                raise BodySilent(f"the body's process did not start: exit code {self._process.returncode}")
            time.sleep(POLL)

    def check(self) -> None:
        """Raise `BodySilent` when the process has ended."""
        if not self.alive:
            raise BodySilent(
                f"the body's process has ended, with exit code {self._process.returncode}: there is no robot any more"
            )

    def close(self) -> None:
        """End the process, which has nothing to finish, and remove the shared memory. Closing twice is fine."""
        with held_back():  # as when it was made
            self._process.kill()
            self._segment.remove()
            while self.alive:  # not `wait`: it holds a lock, on which the same call from a signal's handler would hang
                time.sleep(POLL)
            self._segment.close()
            # Last: another thread may take a signal at any line above, and its handler ends the program by what is registered.
            atexit.unregister(self.close)
