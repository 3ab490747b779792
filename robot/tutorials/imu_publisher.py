"""An inertial sensor at 200 Hz: a robot at rest, with the noise of a cheap chip."""

from __future__ import annotations

from actors import Node, Supervisor, Topic, every, parameter, publishes, qos
from actors.interfaces.geometry_msgs.msg import Quaternion, Vector3
from actors.interfaces.sensor_msgs.msg import Imu
from actors.interfaces.std_msgs.msg import Header
from robot.tutorials.program import main, system

IMU = Topic(Imu, "/imu/data", qos.SENSOR_DATA)

GRAVITY = 9.81
ACCELERATION_NOISE = 0.01
"""m/s^2, standard deviation."""
GYRO_NOISE = 0.001
"""rad/s, standard deviation."""
LEVEL = Quaternion(x=0.0, y=0.0, z=0.0, w=1.0)


class ImuPublisher(Node):
    """Lies still and level: /imu/data at `rate` Hz, with gravity on z and normal noise on acceleration and angular velocity.

    Parameters: rate.
    """

    data = publishes(IMU)
    rate = parameter(200.0, unit="Hz", ge=1.0, le=1000.0, read_only=True)

    async def on_start(self) -> None:
        self.log.info(f"IMU Publisher started @ {self.rate:g} Hz")

    @every(hz="rate")
    def publish(self) -> None:
        noise = self.rng.gauss
        self.data(
            Imu(
                header=Header(stamp=self.clock.stamp(), frame_id="imu_link"),
                orientation=LEVEL,
                angular_velocity=Vector3(x=noise(0, GYRO_NOISE), y=noise(0, GYRO_NOISE), z=noise(0, GYRO_NOISE)),
                linear_acceleration=Vector3(
                    x=noise(0, ACCELERATION_NOISE),
                    y=noise(0, ACCELERATION_NOISE),
                    z=GRAVITY + noise(0, ACCELERATION_NOISE),
                ),
            )
        )


def tree() -> Supervisor:
    """An inertial sensor that publishes 200 times a second."""
    return system("imu_publisher", ImuPublisher)


if __name__ == "__main__":
    main(tree)
