"""A motor controller whose limits and gains are parameters: changed while it runs, checked before they count, all or none.

max_velocity must be between 0.0 and 10.0            pid_gains must have 3 elements
"""

from __future__ import annotations

from collections.abc import Sequence
from math import isfinite
from typing import cast

from actors import Node, Parameter, SetResult, Supervisor, Topic, every, parameter, publishes
from actors.interfaces.std_msgs.msg import Float64
from actors.parameters import on_set
from robot.tutorials.program import main, system

MOTOR_VELOCITY = Topic(Float64, "motor_velocity", 10)

RATE = 10
"""Hz."""
WANTED = 5.0
"""What the motor is asked for, m/s; it gets no more than max_velocity."""


def why_not(velocity: object, gains: object) -> list[str]:
    """What is wrong with these values, in sentences. NaN is no velocity; None stands for a value that is not being set."""
    wrong: list[str] = []
    if isinstance(velocity, float) and not 0.0 <= velocity <= 10.0:
        wrong.append("max_velocity must be between 0.0 and 10.0")
    if isinstance(gains, tuple):
        numbers = cast("tuple[float, ...]", gains)
        if len(numbers) != 3:
            wrong.append("pid_gains must have 3 elements")
        elif not all(map(isfinite, numbers)):
            wrong.append("pid_gains must be finite")
    return wrong


class MotorController(Node):
    """Brings a motor to 5 m/s, or to max_velocity if that is less: motor_velocity at 10 Hz.

    Parameters: max_velocity (0.0 to 10.0), pid_gains (3 numbers). A set is refused as a whole, with every reason; an accepted one counts
    from the next control step.
    """

    velocity = publishes(MOTOR_VELOCITY)
    max_velocity = parameter(1.0, unit="m/s", description="Between 0.0 and 10.0.")
    pid_gains = parameter([1.0, 0.1, 0.01], description="Proportional, integral, derivative.")

    async def on_start(self) -> None:
        self.log.info(f"Max velocity: {self.max_velocity}")
        self.log.info(f"PID gains: {list(self.pid_gains)}")
        self._measured = self._integral = self._error = 0.0

    @on_set
    def check(self, values: Sequence[Parameter]) -> SetResult:
        """Asked before anything is stored, also about what it is started with; no side effects, as another check may still refuse."""
        wanted = {one.name: one.value for one in values}
        wrong = why_not(wanted.get("max_velocity"), wanted.get("pid_gains"))
        return SetResult(not wrong, "; ".join(wrong))

    @max_velocity.changed
    def velocity_changed(self, value: float) -> None:
        self.log.info(f"Max velocity changed to: {value}")

    @pid_gains.changed
    def gains_changed(self, value: tuple[float, ...]) -> None:
        self.log.info(f"PID gains changed to: {list(value)}")

    @every(hz=RATE)
    def control(self) -> None:
        """One step of the controller, and of a motor that follows within the limit."""
        p, i, d = self.pid_gains
        error = min(WANTED, self.max_velocity) - self._measured
        self._integral += error / RATE
        push = p * error + i * self._integral + d * (error - self._error) * RATE
        self._error = error
        self._measured = max(-self.max_velocity, min(self.max_velocity, self._measured + push))
        self.velocity(Float64(data=self._measured))


def tree() -> Supervisor:
    """A motor controller whose parameters may be changed while it runs."""
    return system("motor_controller", MotorController)


if __name__ == "__main__":
    main(tree)
