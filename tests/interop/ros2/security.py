"""Processes of ROS 2 with certificates of ours."""

from __future__ import annotations

import asyncio
import tempfile
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

from actors import Child, Node, Topic, run
from actors.interfaces.std_msgs.msg import String
from actors.transport.security import load_security
from actors.transport.security.authority import create
from actors.transport.zenoh import ZenohConfig, ZenohTransport
from tests.actors.transport.zenoh.wires import free_port
from tests.interop.ros2.bench import Bench, Check

ALLOWED, REFUSED = "/secure/allowed", "/secure/refused"
RULES = f"access:\n  - peers: [ros2]\n    publish: [{ALLOWED}]\n"


def checks() -> Iterator[tuple[str, Check]]:
    """By name."""
    yield (
        "security: their publisher with a certificate is heard over TLS, on the topics of its rule only",
        their_publisher,
    )


async def their_publisher(bench: Bench) -> None:
    with tempfile.TemporaryDirectory() as folder:
        ours, theirs = create(Path(folder), ["robot", "ros2"], days=1, passwords=False)
        ours.write_text(ours.read_text() + RULES)
        where = f"tls/127.0.0.1:{free_port()}"
        config = ZenohConfig(listen=(where,), gossip_port=0, security=load_security(ours))
        secured = replace(bench, environment={**bench.environment, "ZENOH_CONFIG_OVERRIDE": override(theirs, where)})
        async with run(Child(Node, name="ear"), transport=ZenohTransport(config), signals=False, sinks=()) as system:
            ear = system.node("ear")
            async with (
                ear.subscribe(Topic(String, REFUSED)) as refused,
                ear.subscribe(Topic(String, ALLOWED)) as allowed,
            ):
                unheard = asyncio.ensure_future(anext(refused))
                for topic in (REFUSED, ALLOWED):
                    publish = ("topic", "pub", "-t", "10", "-r", "10", "-w", "0", topic, "std_msgs/msg/String")
                    await secured.run(*publish, f"{{data: {topic}}}")
                async with asyncio.timeout(5):
                    assert (await anext(allowed)).data == ALLOWED
                assert not unheard.done(), f"heard on {REFUSED}"
                unheard.cancel()


def override(file: Path, where: str) -> str:
    """The settings of Zenoh with the certificate of this folder."""
    own = file.parent
    names = {
        "root_ca_certificate": "authority",
        "listen_certificate": "certificate",
        "listen_private_key": "key",
        "connect_certificate": "certificate",
        "connect_private_key": "key",
    }
    paths = ",".join(f'{name}:"{own}/{file}.pem"' for name, file in names.items())
    tls = f"{{{paths},enable_mtls:true,verify_name_on_connect:false}}"
    return f'connect/endpoints=["{where}"];listen/endpoints=["tls/127.0.0.1:0"];transport/link/tls={tls}'
