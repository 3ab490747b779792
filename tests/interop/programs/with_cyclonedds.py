"""A process of plain cyclonedds, with a type of its own, and nothing of ROS: ``python with_cyclonedds.py DOMAIN``."""

import sys
import threading
from dataclasses import dataclass

from cyclonedds.core import Policy, Qos
from cyclonedds.domain import DomainParticipant
from cyclonedds.idl import IdlStruct
from cyclonedds.pub import DataWriter
from cyclonedds.sub import DataReader
from cyclonedds.topic import Topic
from cyclonedds.util import duration
from lines import obey, say


@dataclass
class String(IdlStruct, typename="std_msgs.msg.dds_.String_"):
    data: str


participant = DomainParticipant(int(sys.argv[1]))
qos = Qos(Policy.Reliability.Reliable(duration(seconds=1)), Policy.History.KeepLast(10))
writers: dict[str, DataWriter[String]] = {}


def publisher(topic: str) -> None:
    writers[topic] = DataWriter(participant, Topic(participant, f"rt{topic}", String), qos=qos)


def publish(topic: str, message: dict[str, str]) -> None:
    writers[topic].write(String(**message))


def subscription(topic: str) -> None:
    reader = DataReader(participant, Topic(participant, f"rt{topic}", String), qos=qos)

    def listen() -> None:
        for sample in reader.take_iter(timeout=duration(infinite=True)):
            say("heard", topic=topic, message={"data": sample.data})

    threading.Thread(target=listen, daemon=True).start()


obey({one.__name__: one for one in (publisher, publish, subscription)})
