"""What a security file makes of the settings of a session, and that nothing else weakens them."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from actors.transport import WireUnavailable
from actors.transport.environment import transport_from_environment
from actors.transport.security import SecurityError
from actors.transport.zenoh import ZenohConfig
from actors.transport.zenoh.config import point_settings, router_settings, session_settings, write_config
from actors.transport.zenoh.router import router
from actors.transport.zenoh.transport import ZenohKeys, ZenohTransport
from tests.actors.transport.contract.parties import Changes, Party
from tests.actors.transport.security.fleet import Fleet
from tests.actors.transport.zenoh.wires import free_port
from tests.facts import lacks

RULES = [{"peers": ["desk"], "publish": ["/cmd_vel"]}]


@pytest.fixture
def fleet(tmp_path: Path) -> Fleet:
    return Fleet(tmp_path / "fleet", "robot", passwords=True)


def understood(settings: Any, file: str = "") -> Any:
    return json.loads(str(write_config(file, settings)))


def test_session_gossip_point_and_router_have_the_same_locks(fleet: Fleet) -> None:
    config = ZenohConfig(gossip_port=7999, security=fleet.security("robot", access=RULES))
    folder = fleet.folder / "robot"
    session, point = understood(session_settings(config, "ab12")), understood(point_settings(config))
    for found in (session, point, understood(router_settings(("tls/[::]:7447",), (), config.security))):
        link, usrpwd = found["transport"]["link"], found["transport"]["auth"]["usrpwd"]
        assert link["protocols"] == ["tls"]
        assert link["tls"]["root_ca_certificate"] == f"{folder}/authority.pem"
        assert link["tls"]["listen_private_key"] == link["tls"]["connect_private_key"] == f"{folder}/key.pem"
        assert (link["tls"]["enable_mtls"], link["tls"]["close_link_on_expiration"]) == (True, True)
        assert (usrpwd["user"], usrpwd["dictionary_file"]) == ("robot", f"{folder}/users")
        assert usrpwd["password"] == (folder / "password").read_text().strip()
        assert found["access_control"]["default_permission"] == "deny"
    assert session["listen"]["endpoints"] == ["tls/127.0.0.1:0"]
    assert session["connect"]["endpoints"] == point["listen"]["endpoints"] == ["tls/127.0.0.1:7999"]


def test_thin_links_are_thin_with_tls_too(fleet: Fleet) -> None:
    config = ZenohConfig(thin_links=True, security=fleet.security("robot"))
    link = understood(session_settings(config, "ab12"))["transport"]["link"]
    assert link["tls"]["so_sndbuf"] == link["tcp"]["so_sndbuf"] == 16 * 1024
    assert link["tls"]["enable_mtls"] is True


def test_without_rules_and_users_none_are_set_and_without_mutual_no_certificate_is_shown(fleet: Fleet) -> None:
    tls = {"authority": "authority.pem", "certificate": "certificate.pem", "key": "key.pem", "mutual": False}
    config = ZenohConfig(security=fleet.security("robot", user=None, tls=tls))
    found = understood(session_settings(config, "ab12"))
    assert found["transport"]["link"]["tls"]["enable_mtls"] is False
    assert found["transport"]["link"]["tls"]["connect_certificate"] is None
    assert found["transport"]["auth"]["usrpwd"]["user"] is None
    assert found["access_control"]["enabled"] is False


def test_a_client_without_users_shows_only_its_own_password(fleet: Fleet) -> None:
    security = fleet.security("robot", user={"name": "robot", "password_file": "password"})
    found = understood(session_settings(ZenohConfig(mode="client", security=security), "ab12"))
    assert found["transport"]["auth"]["usrpwd"]["dictionary_file"] is None


def test_neither_a_file_of_zenohs_nor_overrides_open_a_link_without_tls(fleet: Fleet, tmp_path: Path) -> None:
    own = tmp_path / "own.json5"
    own.write_text('{mode: "peer", transport: {link: {protocols: ["tcp"]}}, scouting: {multicast: {enabled: true}}}')
    overrides = 'transport/link/protocols=["tcp"];access_control={enabled:false}'
    config = ZenohConfig(file=str(own), overrides=overrides, security=fleet.security("robot", access=RULES))
    found = understood(session_settings(config, "ab12"), config.file)
    assert found["transport"]["link"]["protocols"] == ["tls"]
    assert found["access_control"]["enabled"] is True
    assert found["scouting"]["multicast"]["enabled"] is False


@pytest.mark.parametrize("way", ["listen", "connect"])
def test_an_endpoint_without_tls_is_refused_with_the_remedy(fleet: Fleet, way: str) -> None:
    security, endpoint = fleet.security("robot"), "tcp/127.0.0.1:7448"
    said = f"cannot {way} at '{endpoint}': {security.file} wants TLS; write tls/127.0.0.1:7448"
    with pytest.raises(WireUnavailable) as refused:
        ZenohConfig(gossip_port=0, security=security, **{way: (endpoint,)})  # type: ignore[arg-type]
    assert str(refused.value) == said


async def test_a_router_that_could_let_nobody_in_does_not_start(fleet: Fleet) -> None:
    security = fleet.security("robot", user={"name": "robot", "password_file": "password"})
    with pytest.raises(SecurityError, match=r"security\.yaml:5: user: others connect to this process"):
        async with router((f"tls/127.0.0.1:{free_port()}",), (), security):
            pass


async def test_a_client_that_is_refused_is_told_where_that_may_come_from(fleet: Fleet) -> None:
    security = fleet.security("robot")
    where = f"tls/127.0.0.1:{free_port()}"
    config = ZenohConfig(mode="client", connect=(where,), security=security, overrides="connect/timeout_ms=10")
    with pytest.raises(WireUnavailable) as refused:
        await Party(ZenohKeys(config), Changes()).open()
    assert lacks(str(refused.value), f"router {where} {security.file} peer") == []


# The environment -----------------------------------------------------------------------------------------------------------


def test_the_variable_names_a_file_and_an_argument_counts_more(fleet: Fleet, tmp_path: Path) -> None:
    file = str(fleet.file("robot"))
    assert isinstance(transport_from_environment({"ROBACTOR_SECURITY": file}), ZenohTransport)
    assert isinstance(transport_from_environment({"ROBACTOR_SECURITY": "lost"}, security=file), ZenohTransport)
    with pytest.raises(SecurityError, match="lost: the security file cannot be read"):
        transport_from_environment({"ROBACTOR_SECURITY": "lost"})
    with pytest.raises(SecurityError, match="lost: the security file cannot be read"):
        transport_from_environment({"ROBACTOR_SECURITY": file}, security="lost")


def test_a_file_that_protects_nothing_because_nobody_is_reached_is_refused(fleet: Fleet) -> None:
    with pytest.raises(WireUnavailable, match="in_process, which neither listens nor connects: unset it"):
        transport_from_environment({"RMW_IMPLEMENTATION": "in_process"}, security=str(fleet.file("robot")))
