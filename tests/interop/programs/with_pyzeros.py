"""A process of pyzeros: ``python with_pyzeros.py PORT``."""

import asyncio
import json
import sys
import threading
from collections.abc import Callable, Coroutine
from typing import Any, get_args, get_type_hints

import msgspec
import numpy as np
import pyzeros
import zenoh
from cydr import types
from lines import obey, say
from pyzeros.qos import QosProfile
from ros2_pyterfaces.cydr import all_msgs, all_srvs
from ros2_pyterfaces.cydr.idl import IdlStruct, make_idl_service

config = zenoh.Config()
for path, value in {
    "mode": "peer",
    "scouting/multicast/enabled": False,
    "listen/endpoints": ["tcp/127.0.0.1:0"],
    "connect/endpoints": [f"tcp/127.0.0.1:{sys.argv[1]}"],
    "connect/timeout_ms": -1,
    "connect/exit_on_failure": False,
    "scouting/gossip/target": {"router": ["router", "peer"], "peer": ["router"]},
    "timestamping/enabled": {"router": True, "peer": True, "client": True},
}.items():
    config.insert_json5(path, json.dumps(value))


class AddTwoIntsRequest(IdlStruct):
    """The package lacks the types of example_interfaces."""

    __idl_typename__ = "example_interfaces/srv/AddTwoInts_Request"
    a: types.int64 = np.int64(0)
    b: types.int64 = np.int64(0)


class AddTwoIntsResponse(IdlStruct):
    __idl_typename__ = "example_interfaces/srv/AddTwoInts_Response"
    sum: types.int64 = np.int64(0)


AddTwoInts = make_idl_service(AddTwoIntsRequest, AddTwoIntsResponse, typename="example_interfaces/srv/AddTwoInts")
loop = asyncio.new_event_loop()
things: dict[tuple[str, str], Any] = {}


def to_plain(value: Any) -> Any:
    if isinstance(value, msgspec.Struct):
        return {field: to_plain(getattr(value, field)) for field in value.__struct_fields__}
    if isinstance(value, (list, tuple)):
        return [to_plain(one) for one in value]
    if isinstance(value, (bytes, np.bytes_)):
        return value.decode()
    return to_plain(value.tolist()) if isinstance(value, (np.ndarray, np.generic)) else value


def of_plain(kind: Any, default: Any, plain: Any) -> Any:
    """A value of a field from plain data; `kind` is its annotation."""
    if isinstance(default, msgspec.Struct):
        return make(type(default), plain)
    if isinstance(plain, str):
        return plain.encode()
    if isinstance(default, np.ndarray) and default.dtype.kind not in "SO":
        return np.array(plain, dtype=default.dtype)
    if isinstance(plain, list):
        inner = get_args(kind)
        made = [make(inner[0], one) if isinstance(one, dict) else one.encode() for one in plain]
        return np.array(made, dtype=bytes) if isinstance(default, np.ndarray) else made
    return type(default)(plain)


def make(cls: Any, plain: dict[str, Any]) -> Any:
    blank, hints = cls(), get_type_hints(cls)
    return cls(**{field: of_plain(hints[field], getattr(blank, field), plain[field]) for field in plain})


def profile(reliability: str = "RELIABLE", durability: str = "VOLATILE", depth: int = 10, all: bool = False) -> Any:
    history = "keep_all" if all else "keep_last"
    return QosProfile(history, depth, reliability.lower(), durability.lower())


async def publisher(topic: str, type: str, qos: dict[str, Any]) -> None:
    cls = getattr(all_msgs, type.split("/")[-1])
    things["publisher", topic] = pyzeros.Pub(cls, topic, profile(**qos), node, scope=None)


async def publish(topic: str, message: dict[str, Any]) -> None:
    one = things["publisher", topic]
    one.publish(make(one.topic_info.msg_type, message))


async def subscription(topic: str, type: str, qos: dict[str, Any]) -> None:
    cls = getattr(all_msgs, type.split("/")[-1])
    one = pyzeros.Sub(cls, topic, profile(**qos), node, scope=None)
    one.asap_callback.append(lambda message: say("heard", topic=topic, message=to_plain(message)))
    things["subscription", topic] = one


def service_type(name: str) -> Any:
    last = name.split("/")[-1]
    return AddTwoInts if last == "AddTwoInts" else getattr(all_srvs, last)


async def server(service: str, type: str, answers: dict[str, Any]) -> None:
    """Answers requests with `answers`; AddTwoInts with the sum, and not at all if it is 0. It cannot answer with an error."""
    one = pyzeros.Server(service_type(type), service, session=node, scope=None)
    things["server", service] = one

    async def serve() -> None:
        async for asked in one.listen_reliable():
            say("asked", service=service, request=to_plain(asked.request))
            given = dict(answers)
            if type.endswith("AddTwoInts"):
                given["sum"] = int(asked.request.a + asked.request.b)
                if given["sum"] == 0:
                    things["unanswered", service] = asked
                    continue
            asked.send(make(one.service_type.Response, given))

    things["task of the server", service] = asyncio.create_task(serve())


async def client(service: str, type: str, timeout: float) -> None:
    one = pyzeros.Client(service_type(type), service, session=node, scope=None)
    things["client", service] = one
    async with asyncio.timeout(timeout):
        await one.wait_for_service()


async def call(service: str, request: dict[str, Any]) -> Any:
    one = things["client", service]
    async with asyncio.timeout(10.0):
        return to_plain(await one.call_async(make(one.service_type.Request, request)))


async def token(kind: str, name: str) -> str:
    """The token of an endpoint, and the GID that it sends."""
    return f"{things[kind, name].token_keyexpr} {things[kind, name].gid.tobytes().hex()}"


async def close(kind: str, name: str) -> None:
    things.pop((kind, name)).close()


def on_the_loop(one: Callable[..., Coroutine[Any, Any, Any]]) -> Callable[..., Any]:
    return lambda **arguments: asyncio.run_coroutine_threadsafe(one(**arguments), loop).result()


session = zenoh.open(config)
threading.Thread(target=loop.run_forever, daemon=True).start()


async def enter() -> Any:
    return pyzeros.Session("pyzeros_node", session, "/third")


node = asyncio.run_coroutine_threadsafe(enter(), loop).result()
obey({one.__name__: on_the_loop(one) for one in (publisher, publish, subscription, server, client, call, token, close)})
session.close()
