"""The smallest service and the smallest client."""

from __future__ import annotations

from actors import Node, Service, Supervisor
from actors.interfaces.example_interfaces.srv import AddTwoInts, AddTwoInts_Request, AddTwoInts_Response
from robot.tutorials.program import Job, main, system

ADD_TWO_INTS = Service(AddTwoInts, "add_two_ints")


class MinimalService(Node):
    """Adds: serves add_two_ints."""

    @ADD_TWO_INTS.serve()
    async def add(self, request: AddTwoInts_Request) -> AddTwoInts_Response:
        self.log.info(f"Incoming request\na: {request.a} b: {request.b}")
        return AddTwoInts.Response(sum=request.a + request.b)


class MinimalClient(Job):
    """Asks add_two_ints for 1 + 2.

    Parameters: patience.
    """

    async def job(self) -> None:
        await self.wait_in_slices(ADD_TWO_INTS, "Service not available, waiting again...")
        answer = await self.call(ADD_TWO_INTS, AddTwoInts.Request(a=1, b=2))
        self.log.info(f"Result of add_two_ints: {answer.sum}")


def tree() -> Supervisor:
    """A service that adds two integers, and a client that asks it for 1 + 2."""
    return system("minimal_service", MinimalService, MinimalClient)


if __name__ == "__main__":
    main(tree)
