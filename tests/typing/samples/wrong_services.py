"""Services used wrongly: each marked line is one error, for the checkers that it names."""

from __future__ import annotations

from actors import Node, Service
from actors.interfaces.example_interfaces.srv import AddTwoInts
from actors.interfaces.std_msgs.msg import String
from actors.interfaces.std_srvs.srv import SetBool

ADD = Service(AddTwoInts, "add")


class Wrong(Node):
    @ADD.serve()  # E
    async def takes_another_request(self, request: SetBool.Request) -> AddTwoInts.Response:
        return AddTwoInts.Response(sum=1)

    @ADD.serve()  # E
    async def answers_with_another_type(self, request: AddTwoInts.Request) -> SetBool.Response:
        return SetBool.Response(success=True)

    @ADD.serve()
    async def returns_another_type(self, request: AddTwoInts.Request) -> AddTwoInts.Response:
        return SetBool.Response(success=True)  # E

    @ADD.serve()  # E
    async def answers_nothing(self, request: AddTwoInts.Request) -> None: ...

    @ADD.serve()  # E
    def not_a_coroutine(self, request: AddTwoInts.Request) -> AddTwoInts.Response:
        return AddTwoInts.Response(sum=1)

    async def ask(self) -> None:
        await self.call(ADD, SetBool.Request(data=True))  # E
        await self.call(ADD, AddTwoInts.Response(sum=1))  # E
        await self.call(ADD, AddTwoInts.Request(a=1, c=2))  # E
        await self.call(ADD, AddTwoInts.Request(a="one"))  # E
        await self.call(ADD)  # E
        await self.call(ADD, AddTwoInts.Request(a=1, b=2), timeout="1 s")  # E

    async def use(self) -> str:
        reply = await self.call(ADD, AddTwoInts.Request(a=1, b=2))
        another: SetBool.Response = reply  # E
        return reply.sum if another.success else ""  # E

    async def forget_to_await(self) -> AddTwoInts.Response:
        return self.call(ADD, AddTwoInts.Request(a=1, b=2))  # E

    def serve_later(self) -> None:
        self.serve(ADD, takes_another_request)  # E
        self.serve(ADD, answers_with_another_type)  # E


async def takes_another_request(request: SetBool.Request) -> AddTwoInts.Response:
    return AddTwoInts.Response(sum=int(request.data))


async def answers_with_another_type(request: AddTwoInts.Request) -> SetBool.Response:
    return SetBool.Response(success=request.a > request.b)


def declare() -> None:
    Service(String, "add")  # E
