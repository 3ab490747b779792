"""A simulated Go2 on a Go2's wire: our physics with its figures, its own watchdog, and a walking service that can be switched off.

python -m tests.robot.hardware.go2 --domain 1 --interface lo    # in real time, for `python -m robot run --hardware unitree`
"""

from __future__ import annotations

import argparse
import asyncio
import json
import time

import numpy as np

from actors.transport.dds import DdsConfig, RawTopics
from robot.hardware.body import MotorTargets
from robot.hardware.unitree_link import config_of
from robot.hardware.unitree_wire import FEET, JOINTS, crc_of
from robot.interfaces.unitree.unitree_api.msg import Request, Response, ResponseHeader, ResponseStatus
from robot.interfaces.unitree.unitree_go.msg import BmsState, IMUState, LowCmd, LowState, MotorState
from robot.model.bodies import GO2
from robot.scenes.worlds import get_world
from robot.sim.physics import PhysicsBody

LOADED = np.array((90, 95, 85, 100))
UNLOADED = np.array((20, 31, 12, 25))
"""What its feet read: no two sensors are alike."""


class SimulatedGo2:
    """Takes `LowCmd` with a check sum that fits, and tells `LowState`. When no commands come, its drives brake after 0.1 s."""

    def __init__(self, topics: RawTopics, *, walking: str = "") -> None:
        self.body = PhysicsBody(get_world("empty"), seed=3, delay=0.002, model=GO2)
        self.topics = topics
        self.feels = True
        self.tick, self.closed = 0, False
        """Of the newest state; whether nobody is at the other end any more."""
        self.walking, self.calls = walking, list[int]()
        self.taken = self.refused = 0
        self.newest = LowCmd()
        self._states = topics.writer("rt/lowstate", LowState)
        topics.reader("rt/lowcmd", LowCmd, self._command, depth=50, reliable=True)
        if walking:
            self._responses = topics.writer("rt/api/motion_switcher/response", Response, depth=10)
            topics.reader("rt/api/motion_switcher/request", Request, self._answer, depth=10, reliable=True)

    def _command(self, command: LowCmd) -> None:
        if command.crc != crc_of(command):
            self.refused += 1
            return
        self.taken, self.newest = self.taken + 1, command
        parts = np.array([(one.q, one.dq, one.tau, one.kp, one.kd) for one in command.motor_cmd[:12]])[JOINTS].T.copy()
        parts[0][parts[0] > 1e9] = 0.0
        self.body.command(MotorTargets(*parts))

    def _answer(self, request: Request) -> None:
        identity, data = request.header.identity, ""
        self.calls.append(identity.api_id)
        if identity.api_id == 1001:
            data = json.dumps({"form": "0", "name": self.walking})
        elif identity.api_id == 1002:
            self.walking = json.loads(request.parameter)["name"]
        elif identity.api_id == 1003:
            self.walking = ""
        self._responses.write(Response(header=ResponseHeader(identity=identity, status=ResponseStatus()), data=data))

    def tell(self, until: float) -> None:
        """Go on to `until`, and send a state."""
        self.body.advance(until)
        joints, imu = self.body.joints(), self.body.imu()
        self.tick = round(until * 1e3) & 0xFFFFFFFF
        rows = zip(*(part[JOINTS].tolist() for part in (joints.position, joints.velocity, joints.effort)), strict=True)
        motors = [MotorState(mode=1, q=q, dq=dq, tau_est=tau, temperature=30) for q, dq, tau in rows]
        self._states.write(
            LowState(
                head=(0xFE, 0xEF),
                imu_state=IMUState(
                    quaternion=self.body.truth().quaternion, gyroscope=imu.gyro, accelerometer=imu.accel
                ),
                motor_state=(*motors, *[MotorState()] * 8),
                bms_state=BmsState(soc=83, current=-2500, cell_vol=[3600] * 8 + [0] * 7),
                foot_force=(self.feels * (UNLOADED + LOADED * joints.contact))[FEET].astype(np.int16),
                tick=self.tick,
            )
        )


async def run(config: DdsConfig, walking: str) -> None:
    """Play it in real time, and print once a second how it is."""
    async with RawTopics(config) as topics:
        robot, began, ticks = SimulatedGo2(topics, walking=walking), time.monotonic(), 0
        while True:
            ticks += 1
            robot.tell(ticks * 0.004)
            if ticks % 125 == 0:
                truth = robot.body.truth()
                x, y, z = truth.position.tolist()
                print(
                    f"{ticks * 0.004:6.1f} s: x {x:.2f} y {y:.2f} z {z:.3f} yaw {truth.yaw:.2f}, fallen {truth.fallen}, {robot.taken} commands, "
                    f"{robot.refused} refused, walking service {robot.walking!r}", flush=True
                )  # fmt: skip
            await asyncio.sleep(max(0.0, began + ticks * 0.004 - time.monotonic()))


if __name__ == "__main__":
    parser = argparse.ArgumentParser()
    parser.add_argument("--domain", type=int, default=1)
    parser.add_argument("--interface", default="lo")
    parser.add_argument("--walking", default="normal")
    given = parser.parse_args()
    asyncio.run(run(config_of(given.interface, given.domain), given.walking))
