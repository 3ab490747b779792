"""Adding two integers: one server, a client that asks once, and one that asks three times at once."""

from __future__ import annotations

import asyncio

from actors import ActorError, Node, Service, Supervisor
from actors.interfaces.example_interfaces.srv import AddTwoInts, AddTwoInts_Request, AddTwoInts_Response
from robot.tutorials.program import Job, JobFailed, main, system

ADD_TWO_INTS = Service(AddTwoInts, "/add_two_ints")


class AddServer(Node):
    """Adds: serves /add_two_ints. A sum beyond 64 bits is an error of that call."""

    async def on_start(self) -> None:
        self.log.info("Service /add_two_ints ready")

    @ADD_TWO_INTS.serve()
    async def add(self, request: AddTwoInts_Request) -> AddTwoInts_Response:
        response = AddTwoInts.Response(sum=request.a + request.b)
        self.log.info(f"{request.a} + {request.b} = {response.sum}")
        return response


class AddClient(Job):
    """Waits for /add_two_ints, has it add 5 and 3, and says the result.

    Parameters: patience.
    """

    async def job(self) -> None:
        await self.wait_in_slices(ADD_TWO_INTS, "Waiting for service...")
        total = await self.add(5, 3)
        if total is None:
            raise JobFailed("No result")
        self.log.info(f"Result: {total}")

    async def add(self, a: int, b: int) -> int | None:
        """The sum, or None when the call fails; then the log says why."""
        try:
            return (await self.call(ADD_TWO_INTS, AddTwoInts.Request(a=a, b=b))).sum
        except ActorError as error:
            self.log.error(f"Service call failed: {error}")
            return None


class AsyncAddClient(AddClient):
    """Has /add_two_ints add three pairs at once. The answers come in the order of the questions.

    Parameters: patience.
    """

    async def job(self) -> None:
        await self.wait_in_slices(ADD_TWO_INTS, "Waiting for service...")
        totals = await asyncio.gather(self.add(1, 2), self.add(3, 4), self.add(5, 6))
        self.log.info(f"Results: {totals}")


def tree() -> Supervisor:
    """A server that adds, a client that asks once, and one that asks three times at once."""
    return system("add_two_ints", AddServer, AddClient, AsyncAddClient)


if __name__ == "__main__":
    main(tree)
