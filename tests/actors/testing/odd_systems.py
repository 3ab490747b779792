"""Systems as strangers write them: what `explore` must cope with, and say in words."""

from __future__ import annotations

import asyncio
import math
import os
import signal
import subprocess
import sys
import threading
import time

from actors import (
    ActorError,
    Child,
    Intensity,
    Node,
    Service,
    Stop,
    Supervisor,
    Topic,
    background,
    every,
    publishes,
    run,
    transient,
)
from actors.interfaces.example_interfaces.srv import AddTwoInts
from actors.interfaces.std_msgs.msg import Int32
from actors.interfaces.std_srvs.srv import Trigger
from tests.actors.testing.buggy_systems import TICKS, Source

DEPOSIT = Service(AddTwoInts, "deposit")
FIRST, SECOND = Service(Trigger, "first"), Service(Trigger, "second")
LATE = Topic(Int32, "late")
SHARED = {"written": 0, "wanted": 0}
NOTHING = 5


# -- how a tree may be given, and how not ------------------------------------------------------------------------------------


async def made_by_a_coroutine() -> Supervisor:
    await asyncio.sleep(0)
    return Supervisor("made", children=[Child(Source)])


def side_by_side() -> list[type[Node] | Child]:
    return [Source, Child(Source, name="two", remap={"ticks": "tocks"})]


def wants_more(robot: str) -> Supervisor:
    return Supervisor(robot)


async def runs_by_itself() -> None:
    async with run(Supervisor("running", children=[Child(Source)])) as system:
        await system.wait()


def no_tree() -> int:
    return NOTHING


def cannot_be_made() -> Supervisor:
    raise OSError("no configuration")


class Holder:
    tree = Supervisor("held", children=[Child(Source)])


def crowd() -> Supervisor:
    return Supervisor(
        "crowd", children=[Child(Source, name=f"source_{k}", remap={"ticks": f"t{k}"}) for k in range(15)]
    )


class Rarely(Node):
    """Hears only of a second life."""

    @LATE.on()
    def hear(self, message: Int32) -> None:
        self.heard = message.data


class Revenant(Source):
    late = publishes(LATE)

    async def on_start(self) -> None:
        await super().on_start()
        if self.__machinery__ is not None and self.__machinery__.incarnation > 1:
            self.late(Int32(data=1))


def comes_late() -> Supervisor:
    return Supervisor("late", children=[Child(Rarely), Child(Revenant, name="source")])


class Odometer(Node):
    """Measures durations with the time of day."""

    async def on_start(self) -> None:
        self.before = self.clock.wall()

    @every(hz=10)
    def tick(self) -> None:
        passed = self.clock.wall() - self.before
        assert passed >= 0.0, f"{passed:.3f} s have passed since the last tick"
        self.before = self.clock.wall()


# -- what never starts, never ends, or ends too much --------------------------------------------------------------------------


class Blind(Node):
    async def on_start(self) -> None:
        raise RuntimeError("no camera")


class Hesitant(Node):
    async def on_start(self) -> None:
        while True:
            await self.clock.sleep(1.0)


class Clinging(Node):
    async def on_stop(self, reason: object) -> None:
        while True:
            await self.clock.sleep(1.0)


def clinging() -> Supervisor:
    return Supervisor("clinging", children=[Child(Source), Child(Clinging, stop=math.inf)])


class Flood(Node):
    out = publishes(TICKS)

    @background
    async def flood(self) -> None:
        while True:
            self.out(Int32(data=1))
            await asyncio.sleep(0)


class Exits(Node):
    @every(hz=1)
    def leave(self) -> None:
        os._exit(3)


class AsksToExit(Node):
    @every(hz=1)
    def leave(self) -> None:
        sys.exit(3)


class Killed(Node):
    @every(hz=1)
    def leave(self) -> None:
        os.kill(os.getpid(), signal.SIGKILL)


class Spins(Node):
    @every(hz=1)
    def spin(self) -> None:
        while True:
            pass


class Finished(Node):
    @every(hz=1)
    def end(self) -> None:
        raise Stop("enough")


class Hashing(Node):
    @every(hz=1)
    def tell(self) -> None:
        raise ValueError(f"the hash is {hash('a name')} here")


def finishes() -> Supervisor:
    return Supervisor("finishes", children=[Child(Finished, restart=transient)])


def delicate() -> Supervisor:
    """Allows no restart: that a fault ends it is what it says itself."""
    return Supervisor("delicate", intensity=Intensity(0, within=1.0), children=[Child(Source)])


# -- the real world -----------------------------------------------------------------------------------------------------------


class Echo(Node):
    """A server on a real socket, and its client."""

    async def on_start(self) -> None:
        async def answer(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
            writer.write(await reader.readline())
            await writer.drain()
            writer.close()

        self.server = await asyncio.start_server(answer, "127.0.0.1", 0)
        self.port = self.server.sockets[0].getsockname()[1]

    @every(hz=2)
    async def talk(self) -> None:
        reader, writer = await asyncio.open_connection("127.0.0.1", self.port)
        writer.write(b"hello\n")
        assert await reader.readline() == b"hello\n"
        writer.close()
        await writer.wait_closed()

    async def on_stop(self, reason: object) -> None:
        self.server.close()
        await self.server.wait_closed()


class Threads(Node):
    """A thread of its own, that ends a moment after it was told to; and work in threads and processes."""

    async def on_start(self) -> None:
        self.over = threading.Event()
        threading.Thread(target=self.over.wait).start()

    @every(hz=1)
    async def work(self) -> None:
        await asyncio.to_thread(time.sleep, 0.001)

    @every(hz=0.5)
    async def have_done(self) -> None:
        process = await asyncio.create_subprocess_exec("true", stdout=subprocess.DEVNULL)
        assert await process.wait() == 0

    async def on_stop(self, reason: object) -> None:
        self.over.set()


class ForgetsAThread(Node):
    """Tells its thread to end only after it should have."""

    async def on_start(self) -> None:
        self.over = threading.Event()
        threading.Thread(target=self.over.wait).start()

    async def on_stop(self, reason: object) -> None:
        threading.Timer(1.5, self.over.set).start()


def forgets_a_thread() -> Supervisor:
    return Supervisor("forgets", children=[Child(ForgetsAThread)])


# -- more bugs ----------------------------------------------------------------------------------------------------------------


class Bank(Node):
    """A lost update in a service whose callers are told, and go on."""

    async def on_start(self) -> None:
        self.balance = self.expected = 0

    @DEPOSIT.serve(concurrent=4)
    async def deposit(self, request: AddTwoInts.Request) -> AddTwoInts.Response:
        before = self.balance
        await asyncio.sleep(0)
        self.balance = before + request.a
        self.expected += request.a
        assert self.balance == self.expected, "a deposit was lost"
        return AddTwoInts.Response(sum=self.balance)


class Customer(Node):
    @every(hz=5)
    async def save(self) -> None:
        try:
            await self.call(DEPOSIT, AddTwoInts.Request(a=1))
        except ActorError as error:
            self.log.warning("no deposit", why=str(error))


def lost_update() -> Supervisor:
    return Supervisor("bank", children=[Child(Bank), Child(Customer, name="ann"), Child(Customer, name="bob")])


class Writer(Node):
    """The same in a variable of the module, which two nodes share; the loss is seen by a third one."""

    @every(hz=10)
    async def write(self) -> None:
        before = SHARED["written"]
        if before % 10 == 9:
            await asyncio.sleep(0)
        SHARED["written"] = before + 1
        SHARED["wanted"] += 1


class Auditor(Node):
    @every(hz=1)
    def look(self) -> None:
        assert SHARED["written"] == SHARED["wanted"], "a write was lost"


SHARING = Supervisor("sharing", children=[Child(Writer, name="one"), Child(Writer, name="two"), Child(Auditor)])


class Asking(Node):
    """Asks its peer, which asks back; whoever asks first hears only that it did not work."""

    @FIRST.serve()
    async def first(self, request: Trigger.Request) -> Trigger.Response:
        return await self.call(SECOND, request)


class Asked(Node):
    @SECOND.serve()
    async def second(self, request: Trigger.Request) -> Trigger.Response:
        return await self.call(FIRST, request)


class Patient(Node):
    @every(hz=1)
    async def ask(self) -> None:
        try:
            await self.call(FIRST, Trigger.Request())
        except ActorError as error:
            self.log.warning("no answer", why=str(error))


def asking_back() -> Supervisor:
    return Supervisor("asking_back", children=[Child(Asking), Child(Asked), Child(Patient)])


class Eater(Node):
    """Takes two locks in the order that it is given, in a task of its own: nobody waits for it."""

    def __init__(self, locks: tuple[asyncio.Lock, asyncio.Lock], period: float) -> None:
        self.locks, self.period = locks, period

    @background
    async def eat(self) -> None:
        while True:
            await self.clock.sleep(self.period)
            async with self.locks[0]:
                await self.clock.sleep(0.01)
                async with self.locks[1]:
                    await self.clock.sleep(0.01)


def eaters(*, turned: bool) -> Supervisor:
    left, right = asyncio.Lock(), asyncio.Lock()
    second = (right, left) if turned else (left, right)
    return Supervisor(
        "eaters",
        children=[Child(Eater, name="one", args=((left, right), 0.3)), Child(Eater, name="two", args=(second, 0.4))],
    )


def lock_order() -> Supervisor:
    return eaters(turned=True)


def one_order() -> Supervisor:
    return eaters(turned=False)


class Database(Node):
    """Takes a while to come back."""

    async def on_start(self) -> None:
        await self.clock.sleep(2.0)

    @FIRST.serve()
    async def first(self, request: Trigger.Request) -> Trigger.Response:
        return Trigger.Response(success=True)


class Dependent(Node):
    """Has no patience with a database that comes back: it fails, starts, fails at once, until all is given up."""

    async def on_start(self) -> None:
        await self.call(FIRST, Trigger.Request(), timeout=0.1)

    @every(hz=2)
    async def use(self) -> None:
        await self.call(FIRST, Trigger.Request(), timeout=0.1)


def impatient() -> Supervisor:
    return Supervisor("impatient", children=[Child(Database), Child(Dependent)])


class Port(Node):
    """Gives its resource back in a clean-up for which a crash leaves no time."""

    def __init__(self, held: list[Node]) -> None:
        self.held = held

    async def on_start(self) -> None:
        if self.held:
            raise OSError("address in use")
        self.held.append(self)

    @every(hz=10)
    async def use(self) -> None:
        await asyncio.sleep(0)

    async def on_stop(self, reason: object) -> None:
        self.held.clear()


def port() -> Supervisor:
    held: list[Node] = []
    return Supervisor("port", children=[Child(Port, args=(held,))])


class Deaf(Node):
    """Believes that every error of its work is worth another try, also that it is to end."""

    @background
    async def work(self) -> None:
        while True:
            try:
                await self.clock.sleep(0.5)
            except BaseException:
                self.log.warning("once more")


def deaf() -> Supervisor:
    return Supervisor("deaf", children=[Child(Source), Child(Deaf)])
