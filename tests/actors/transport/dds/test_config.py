"""What ROS 2's environment variables make of a participant."""

from __future__ import annotations

import os

import pytest

from actors.transport.dds.config import DdsConfig, domain_settings
from actors.transport.protocol import WireUnavailable


def test_the_default_finds_all_participants_of_the_subnet_in_domain_0() -> None:
    config = DdsConfig.from_environment({})
    assert config == DdsConfig() and config.domain == 0
    assert domain_settings(config) == (
        "<CycloneDDS><Domain><Discovery><ParticipantIndex>auto</ParticipantIndex>"
        "<MaxAutoParticipantIndex>32</MaxAutoParticipantIndex><SPDPInterval>1500ms</SPDPInterval></Discovery></Domain></CycloneDDS>,"
    )


def test_localhost_is_looked_at_without_multicast() -> None:
    config = DdsConfig.from_environment(
        {
            "ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST",
            "ROS_STATIC_PEERS": "10.0.0.5;; robot<1> ",
            "ROS_DOMAIN_ID": "42",
        }
    )
    assert config.domain == 42
    text = domain_settings(config)
    assert "<General><AllowMulticast>false</AllowMulticast></General>" in text
    assert (
        '<Peers><Peer address="localhost"/><Peer address="10.0.0.5"/><Peer address="robot&lt;1&gt;"/></Peers>' in text
    )


def test_static_peers_are_looked_for_besides_the_subnet() -> None:
    text = domain_settings(DdsConfig.from_environment({"ROS_STATIC_PEERS": "10.0.0.5"}))
    assert '<Peers><Peer address="10.0.0.5"/></Peers>' in text and "Multicast" not in text


def test_off_is_a_domain_tag_of_ones_own() -> None:
    text = domain_settings(
        DdsConfig.from_environment({"ROS_AUTOMATIC_DISCOVERY_RANGE": "OFF", "ROS_STATIC_PEERS": "10.0.0.5"})
    )
    assert f"<Tag>ros_discovery_off_{os.getpid()}</Tag>" in text and "Peer " not in text


def test_the_system_default_is_what_cyclone_is_configured_to_be() -> None:
    environment = {
        "ROS_AUTOMATIC_DISCOVERY_RANGE": "SYSTEM_DEFAULT",
        "ROS_STATIC_PEERS": "x",
        "CYCLONEDDS_URI": "file:///a.xml",
    }
    assert domain_settings(DdsConfig.from_environment(environment)) == "file:///a.xml"


def test_localhost_only_overrules_range_and_peers_as_in_ros_2() -> None:
    environment = {"ROS_LOCALHOST_ONLY": "1", "ROS_AUTOMATIC_DISCOVERY_RANGE": "OFF", "ROS_STATIC_PEERS": "10.0.0.5"}
    config = DdsConfig.from_environment(environment)
    assert (config.discovery_range, config.static_peers) == ("LOCALHOST", ())
    assert DdsConfig.from_environment({**environment, "ROS_LOCALHOST_ONLY": "0"}).discovery_range == "OFF"


def test_the_uri_of_cyclone_dds_comes_last_and_so_overrules_ours() -> None:
    config = DdsConfig.from_environment({"CYCLONEDDS_URI": "file:///a.xml,<General/>"})
    assert domain_settings(config).endswith("</CycloneDDS>,file:///a.xml,<General/>")


@pytest.mark.parametrize(
    ("environment", "text"),
    [
        ({"ROS_SECURITY_ENABLE": "true"}, "ROS_SECURITY_ENABLE is set"),
        ({"ROS_DOMAIN_ID": "233"}, "a domain is a number from 0 to 232"),
        ({"ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOSTS"}, "did you mean"),
        ({"ROS_STATIC_PEERS": "x" * 300}, "300 characters"),
    ],
)
def test_values_that_are_none_are_refused_in_one_line(environment: dict[str, str], text: str) -> None:
    with pytest.raises(WireUnavailable, match=text) as refused:
        DdsConfig.from_environment(environment)
    assert "\n" not in str(refused.value)


def test_security_that_is_switched_off_is_no_hindrance() -> None:
    assert DdsConfig.from_environment({"ROS_SECURITY_ENABLE": "false"}) == DdsConfig()
