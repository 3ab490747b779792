"""The distance between two points, as a service with a type of its own."""

from __future__ import annotations

from math import hypot, isfinite

from actors import Node, Service, Supervisor
from robot.interfaces.tutorials.my_robot_pkg.srv import (
    CalculateDistance,
    CalculateDistance_Request,
    CalculateDistance_Response,
)
from robot.tutorials.program import main, system

CALCULATE_DISTANCE = Service(CalculateDistance, "calculate_distance")


class DistanceService(Node):
    """Measures between two points: serves calculate_distance. What has no finite distance is answered with success False."""

    async def on_start(self) -> None:
        self.log.info("Distance Service ready")

    @CALCULATE_DISTANCE.serve()
    async def calculate(self, request: CalculateDistance_Request) -> CalculateDistance_Response:
        x1, y1, x2, y2 = request.x1, request.y1, request.x2, request.y2
        distance = hypot(x2 - x1, y2 - y1)  # squares of large numbers overflow, this does not
        self.log.info(f"Calculated distance between ({x1}, {y1}) and ({x2}, {y2}): {distance:.2f}")
        if not isfinite(distance):
            return CalculateDistance.Response(
                success=False,
                message=f"There is no finite distance between ({x1}, {y1}) and ({x2}, {y2})",
            )
        return CalculateDistance.Response(
            distance=distance, success=True, message=f"Distance calculated successfully: {distance:.2f}"
        )


def tree() -> Supervisor:
    """A service that measures distances."""
    return system("distance_service", DistanceService)


if __name__ == "__main__":
    main(tree)
