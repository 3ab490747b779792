"""Programs for hosts: ``python -m tests.stories.far NODES LISTEN CONNECT [NODE.PARAMETER=VALUE ...]`` runs some nodes until it is ended.

NODES, LISTEN and CONNECT are lists with commas. Times are those of the monotonic clock, which all network namespaces of one kernel share.
"""

from __future__ import annotations

import asyncio
import os
import sys
import time
from ast import literal_eval
from typing import Any

from actors import ActorError, Child, Node, QoS, Service, Topic, background, every, parameter, publishes, qos, run
from actors.interfaces.geometry_msgs.msg import Vector3
from actors.interfaces.std_msgs.msg import Int32, UInt8MultiArray
from actors.interfaces.std_srvs.srv import Trigger, Trigger_Request, Trigger_Response
from actors.qos import Reliability
from actors.transport.zenoh import ZenohConfig, ZenohTransport
from tests.stories.thin import Base, Camera, Driver, Viewer

__all__: list[str] = []

SURE = Topic(Vector3, "sure", QoS(history="keep_all"))
UNSURE = Topic(Vector3, "unsure", QoS(depth=100, reliability=Reliability.BEST_EFFORT))
PACKETS = Topic(UInt8MultiArray, "packets", QoS(depth=100))
KEPT = Topic(Int32, "kept", qos.LATCHED)
PING = Service(Trigger, "ping")


class Teller(Node):
    """Once told to begin, by its standard input, publishes numbers with the time of their sending; both topics in turn."""

    sure, unsure, kept = publishes(SURE), publishes(UNSURE), publishes(KEPT)
    count = parameter(1000, description="How many numbers.", read_only=True)
    rate = parameter(200.0, description="How many a second.", read_only=True)

    @background
    async def tell(self) -> None:
        await asyncio.to_thread(sys.stdin.readline)
        begun = self.clock.now()
        for number in range(self.count):
            message = Vector3(x=float(number), y=time.monotonic())
            await self.sure.send(message)
            self.unsure(message)
            self.kept(Int32(data=number))
            await self.clock.sleep_until(begun + (number + 1) / self.rate)
        print("told all", flush=True)


class Hearer(Node):
    """Says each second what has come of each topic since the start: how many, whether in order, and how late, in milliseconds."""

    def __init__(self) -> None:
        self.numbers: dict[str, list[int]] = {"sure": [], "unsure": []}
        self.late: dict[str, list[float]] = {"sure": [], "unsure": []}
        self.newest = -1

    def note(self, topic: str, message: Vector3) -> None:
        self.numbers[topic].append(int(message.x))
        self.late[topic].append(1e3 * (time.monotonic() - message.y))

    @SURE.on()
    def hear_sure(self, message: Vector3) -> None:
        self.note("sure", message)

    @UNSURE.on()
    def hear_unsure(self, message: Vector3) -> None:
        self.note("unsure", message)

    @KEPT.on()
    def hear_kept(self, message: Int32) -> None:
        self.newest = message.data

    @every(hz=1)
    def tell(self) -> None:
        for topic, numbers in self.numbers.items():
            late = sorted(self.late[topic]) or [0.0]
            order = "ordered" if numbers == sorted(set(numbers)) else "disordered"
            middle, most = late[len(late) // 2], late[len(late) * 99 // 100]
            last = numbers[-1] if numbers else -1
            print(f"{topic} {len(numbers)} {order} p50 {middle:.2f} p99 {most:.2f} last {last}", flush=True)
        print(f"kept {self.newest}", flush=True)


class Stream(Node):
    """Publishes packets of 1,200 bytes, 2,000 a second, as a LiDAR does, on the topic that is asked for."""

    reliable = parameter(False, description="Whether they are reliable.", read_only=True)

    async def on_start(self) -> None:
        self._out = self.publisher(PACKETS, qos=PACKETS.qos if self.reliable else UNSURE.qos)
        self._packet = UInt8MultiArray(data=bytes(1200))

    @every(hz=200)
    def send(self) -> None:
        for _ in range(10):
            self._out.publish(self._packet)


class Catcher(Node):
    """Says each second how many packets came, and how much time of the processor that took, in microseconds each."""

    def __init__(self) -> None:
        self.caught = 0
        self.used = time.process_time()

    @PACKETS.on(qos=UNSURE.qos)
    def catch(self, message: UInt8MultiArray) -> None:
        self.caught += 1

    @every(hz=1)
    def tell(self) -> None:
        used = time.process_time()
        print(f"packets {self.caught} each {1e6 * (used - self.used) / max(self.caught, 1):.0f}", flush=True)
        self.caught, self.used = 0, used


class Answerer(Node):
    @PING.serve()
    async def ping(self, request: Trigger_Request) -> Trigger_Response:
        return Trigger.Response(success=True, message=str(os.getpid()))


class Caller(Node):
    """Calls ping five times a second, and says how each call ended."""

    @background
    async def call_on(self) -> None:
        number = 0
        while True:
            number += 1
            try:
                answer = await self.call(PING, Trigger.Request(), timeout=1.5)
                print(f"call {number} answered by {answer.message}", flush=True)
            except ActorError as error:
                print(f"call {number} {type(error).__name__}: {error}", flush=True)
            await self.clock.sleep(0.2)


NODES = {
    kind.__name__.lower(): kind
    for kind in (Teller, Hearer, Stream, Catcher, Answerer, Caller, Camera, Driver, Base, Viewer)
}


async def main(names: str, listen: str, connect: str, *settings: str) -> None:
    parameters: dict[str, dict[str, Any]] = {name: {} for name in names.split(",")}
    for setting in settings:
        where, value = setting.split("=")
        node, name = where.split(".")
        parameters[node][name] = literal_eval(value)
    config = ZenohConfig.from_environment(
        os.environ, listen=tuple(filter(None, listen.split(","))), connect=tuple(filter(None, connect.split(",")))
    )
    tree = [Child(NODES[name], parameters=given) for name, given in parameters.items()]
    async with run(*tree, transport=ZenohTransport(config)) as system:
        await system.wait()


if __name__ == "__main__":
    asyncio.run(main(*sys.argv[1:]))
