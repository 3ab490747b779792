"""Where a session listens and connects, and what is said if it cannot."""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Any

import pytest
import zenoh

from actors.transport import transport_from_environment
from actors.transport.protocol import WireUnavailable
from actors.transport.zenoh import ZenohConfig
from actors.transport.zenoh.config import point_settings, session_settings, write_config
from actors.transport.zenoh.library import import_zenoh, one_line
from actors.transport.zenoh.transport import ZenohKeys
from tests.actors.transport.contract.parties import Changes, Party
from tests.actors.transport.zenoh.wires import free_port
from tests.facts import lacks


def settings(config: ZenohConfig) -> Any:
    """The settings as Zenoh itself has understood them."""
    return json.loads(str(write_config(config.file, session_settings(config, "ab12"))))


def test_the_default_stays_on_the_loopback_interface_and_has_the_lease_of_ros2() -> None:
    found = settings(ZenohConfig())

    assert found["id"] == "ab12"
    assert found["mode"] == "peer"
    assert found["listen"]["endpoints"] == ["tcp/127.0.0.1:0"]
    gossip_point, router = found["connect"]["endpoints"]
    assert gossip_point == "tcp/127.0.0.1:7446"
    assert router.partition("#")[0] == "tcp/127.0.0.1:7447"
    assert found["connect"]["timeout_ms"] == -1
    assert found["scouting"]["multicast"]["enabled"] is False
    assert found["scouting"]["delay"] == 0
    assert found["timestamping"]["enabled"] == {"router": True, "peer": True, "client": True}
    assert found["transport"]["link"]["tx"]["lease"] == 60_000
    assert found["transport"]["link"]["tx"]["keep_alive"] == 120
    assert found["transport"]["shared_memory"]["enabled"] is False


@pytest.mark.parametrize(
    ("config", "limit"),
    [
        (ZenohConfig(), "2000"),
        (ZenohConfig(connect=("tcp/192.168.1.2:7447",)), None),
        (ZenohConfig(listen=("tcp/0.0.0.0:0",)), None),
    ],
    ids=["this host", "connects", "listens"],
)
def test_a_link_within_this_host_opens_soon_or_is_tried_again(config: ZenohConfig, limit: str | None) -> None:
    found = {one.path: one.value for one in session_settings(config, "a1")}
    assert found.get("transport/unicast/open_timeout") == limit


def test_shared_memory_is_used_if_it_is_wanted() -> None:
    found = settings(ZenohConfig(shared_memory=20))["transport"]["shared_memory"]

    assert found["enabled"] is True
    assert found["transport_optimization"]["enabled"] is False, "that would take as much again"


@pytest.mark.parametrize("size", ["much", "-1", "65537"])
def test_a_size_of_shared_memory_that_is_none_is_refused(size: str) -> None:
    with pytest.raises(WireUnavailable) as refused:
        ZenohConfig.from_environment({"ROBACTOR_SHARED_MEMORY": size})

    assert str(refused.value).startswith(f"ROBACTOR_SHARED_MEMORY is '{size}'; ") and "MiB up to 65536" in str(
        refused.value
    )


def test_endpoints_are_added_and_a_client_has_one_link_only() -> None:
    peer = settings(ZenohConfig(listen=("tcp/0.0.0.0:7448",), connect=("udp/lab:7448",), gossip_port=7999))
    client = settings(ZenohConfig(connect=("tls/lab:7447",), mode="client"))

    assert peer["listen"]["endpoints"] == ["tcp/0.0.0.0:7448"]
    assert peer["connect"]["endpoints"] == ["tcp/127.0.0.1:7999", "udp/lab:7448"]
    assert client["mode"] == "client"
    assert client["listen"]["endpoints"] == []
    assert client["connect"]["endpoints"] == ["tls/lab:7447"]


def test_the_gossip_point_is_a_router_on_the_loopback_interface() -> None:
    written = write_config("", point_settings(ZenohConfig(gossip_port=7999)))
    found = json.loads(str(written))

    assert found["mode"] == "router"
    assert found["listen"]["endpoints"] == ["tcp/127.0.0.1:7999"]
    assert found["connect"]["endpoints"] == []
    assert written.get_json("routing/router/peers_failover_brokering") == "false"


@pytest.mark.parametrize(
    "config", [ZenohConfig(gossip_port=0), ZenohConfig(mode="client"), ZenohConfig(file="own.json5")]
)
def test_there_is_no_gossip_point_without_a_port_for_a_client_or_with_a_file(config: ZenohConfig) -> None:
    assert config.gossip_point == ""
    assert config.meeting_points == ()


def test_processes_with_a_gossip_port_of_their_own_look_for_nobody_else() -> None:
    assert ZenohConfig(gossip_port=7999).meeting_points == ("tcp/127.0.0.1:7999",)


def test_a_file_stands_in_place_of_all_settings_but_endpoints_given_beside_it(tmp_path: Path) -> None:
    file = tmp_path / "own.json5"
    file.write_text("{mode: 'client', connect: {endpoints: ['tcp/lab:1']}, listen: {endpoints: ['tcp/127.0.0.1:5']}}")

    plain = settings(ZenohConfig(file=str(file)))
    added = settings(ZenohConfig(file=str(file), listen=("tcp/127.0.0.1:2",), connect=("tcp/lab:3",)))

    assert plain["mode"] == "client"
    assert (plain["connect"]["endpoints"], plain["listen"]["endpoints"]) == (["tcp/lab:1"], ["tcp/127.0.0.1:5"])
    assert (added["connect"]["endpoints"], added["listen"]["endpoints"]) == (["tcp/lab:3"], ["tcp/127.0.0.1:2"])


def test_thin_links_are_compressed_and_the_kernel_holds_little() -> None:
    thin, usual = (settings(ZenohConfig(thin_links=thin))["transport"] for thin in (True, False))

    assert (thin["unicast"]["compression"]["enabled"], usual["unicast"]["compression"]["enabled"]) == (True, False)
    assert (thin["link"]["tcp"]["so_sndbuf"], usual["link"]["tcp"]["so_sndbuf"]) == (16384, None)


def test_whether_links_are_thin_is_said_by_0_or_1() -> None:
    with pytest.raises(WireUnavailable, match=r"^ROBACTOR_THIN_LINKS is 'yes'; it must be 1, or 0 or empty$"):
        ZenohConfig.from_environment({"ROBACTOR_THIN_LINKS": "yes"})


def test_overrides_are_applied_last_but_not_to_the_identity() -> None:
    text = 'transport/link/tx/lease=9000; connect/endpoints=["tcp/lab:1"];id="ff";'

    found = settings(ZenohConfig(overrides=text))

    assert found["transport"]["link"]["tx"]["lease"] == 9000
    assert found["connect"]["endpoints"] == ["tcp/lab:1"]
    assert found["id"] == "ab12"


def test_the_environment_is_read_as_ros_2_does() -> None:
    environment = {
        "ZENOH_SESSION_CONFIG_URI": "/a.json5",
        "ZENOH_CONFIG_OVERRIDE": "a/b=1",
        "ROBACTOR_GOSSIP_PORT": "0",
        "ROBACTOR_SHARED_MEMORY": "64",
        "ROBACTOR_THIN_LINKS": "1",
    }

    config = ZenohConfig.from_environment(environment, listen=("tcp/lab:1",), connect=("tcp/lab:2",), mode="client")

    assert config == ZenohConfig(
        listen=("tcp/lab:1",), connect=("tcp/lab:2",), mode="client", gossip_port=0, shared_memory=64, file="/a.json5",
        overrides="a/b=1", thin_links=True,
    )  # fmt: skip
    assert not ZenohConfig.from_environment({"ROBACTOR_THIN_LINKS": "0"}).thin_links
    assert ZenohConfig.from_environment({}) == ZenohConfig()


@pytest.mark.parametrize("port", ["x", "-1", "70000", "²"])
def test_a_gossip_port_that_is_none_is_refused(port: str) -> None:
    with pytest.raises(
        WireUnavailable, match=r"^ROBACTOR_GOSSIP_PORT is '.*'; it must be a port number, or 0 for none$"
    ):
        ZenohConfig.from_environment({"ROBACTOR_GOSSIP_PORT": port})


@pytest.mark.parametrize(
    ("what", "text", "line"),
    [
        (
            "listen",
            "127.0.0.1:7448",
            "cannot listen at '127.0.0.1:7448': write protocol/address, for instance tcp/192.168.1.5:7448",
        ),
        (
            "listen",
            "unixsock-stream/",
            "cannot listen at 'unixsock-stream/': write protocol/address, for instance tcp/192.168.1.5:7448",
        ),
        ("connect", "tpc/lab:1", "cannot connect at 'tpc/lab:1': 'tpc' is no protocol of Zenoh; did you mean 'tcp'?"),
        (
            "connect",
            "tcp/lab",
            "cannot connect at 'tcp/lab': it needs a port up to 65535, for instance tcp/192.168.1.5:7448",
        ),
        (
            "connect",
            "tcp/lab:99999",
            "cannot connect at 'tcp/lab:99999': it needs a port up to 65535, for instance tcp/192.168.1.5:7448",
        ),
    ],
)
def test_an_endpoint_that_is_none_is_refused_before_anything_is_opened(what: str, text: str, line: str) -> None:
    endpoints: Any = {what: (text,)}
    with pytest.raises(WireUnavailable) as caught:
        ZenohConfig(**endpoints)
    assert str(caught.value) == line
    with pytest.raises(WireUnavailable) as caught:
        transport_from_environment({}, **endpoints)
    assert str(caught.value) == line


@pytest.mark.parametrize(
    ("config", "line"),
    [
        (
            ZenohConfig(overrides="transport/link"),
            "ZENOH_CONFIG_OVERRIDE contains 'transport/link'; write path/of/key=value;other/key=value",
        ),
        (
            ZenohConfig(overrides="transport/lnk=1"),
            "ZENOH_CONFIG_OVERRIDE, transport/lnk=1: unknown key",
        ),
        (
            ZenohConfig(overrides="mode='per'"),
            "ZENOH_CONFIG_OVERRIDE, mode='per': unknown variant `per`, expected one of `router`, `peer`, `client`",
        ),
        (
            ZenohConfig(file="/nowhere/own.json5"),
            "ZENOH_SESSION_CONFIG_URI=/nowhere/own.json5: No such file or directory (os error 2)",
        ),
        (
            ZenohConfig(listen=("tcp/10.255.1.2:7448",), gossip_port=0),
            "cannot listen at tcp/10.255.1.2:7448: no network interface of this machine has that address",
        ),
        (
            ZenohConfig(listen=("tls/127.0.0.1:0",), gossip_port=0),
            "cannot listen at tls/127.0.0.1:0: Cannot create a new TLS listener on 127.0.0.1:0. Missing TLS private key",
        ),
        (
            ZenohConfig(connect=("tcp/127.0.0.1:1",), mode="client", overrides="connect/timeout_ms=10"),
            "no router answers at tcp/127.0.0.1:1; start one there, or be a peer",
        ),
    ],
)
async def test_what_is_wrong_is_said_in_one_line(config: ZenohConfig, line: str) -> None:
    party = Party(ZenohKeys(config), Changes())

    with pytest.raises(WireUnavailable) as caught:
        await party.open()

    assert str(caught.value) == line
    await party.transport.close()
    assert party.log == []


async def test_a_port_in_use_is_said_and_harms_nobody() -> None:
    config = ZenohConfig(listen=(f"tcp/127.0.0.1:{free_port()}",), gossip_port=0)
    first, second = Party(ZenohKeys(config), Changes()), Party(ZenohKeys(config), Changes())
    await first.open()

    with pytest.raises(WireUnavailable) as caught:
        await second.open()

    assert lacks(str(caught.value), f"{config.listen[0]} another process port") == []
    await first.transport.close()


async def test_without_the_package_it_is_said_what_to_install(monkeypatch: pytest.MonkeyPatch) -> None:
    import_zenoh.cache_clear()
    monkeypatch.setitem(sys.modules, "zenoh", None)

    with pytest.raises(
        WireUnavailable, match=r"^the package eclipse-zenoh cannot be imported \(.*\); install it with pip$"
    ):
        await Party(ZenohKeys(), Changes()).open()


def test_an_error_of_the_parser_is_one_line() -> None:
    with pytest.raises(zenoh.ZError) as caught:
        zenoh.Config.from_json5("{ mode: 'peer', listen: 3 ")

    assert one_line(caught.value) == "expected boolean, null, or string"
