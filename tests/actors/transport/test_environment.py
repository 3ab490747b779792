"""The environment variables of ROS 2 choose the transport and the domain."""

from __future__ import annotations

import pytest

from actors.transport import WireUnavailable
from actors.transport.dds import DdsTransport
from actors.transport.domain_id import domain_from_environment
from actors.transport.environment import transport_from_environment
from actors.transport.zenoh import ZenohTransport
from tests.facts import lacks


@pytest.mark.parametrize("value", ["", "rmw_zenoh_cpp"])
def test_unset_or_named_it_is_zenoh(value: str) -> None:
    assert isinstance(transport_from_environment({"RMW_IMPLEMENTATION": value}), ZenohTransport)


def test_in_process_means_no_other_process_and_no_endpoint() -> None:
    alone = {"RMW_IMPLEMENTATION": "in_process"}
    assert transport_from_environment(alone) is None
    with pytest.raises(WireUnavailable, match="in_process, which neither listens nor connects: unset it"):
        transport_from_environment(alone, connect=("tcp/10.0.0.1:7447",))


def test_another_implementation_is_refused_with_the_nearest_name() -> None:
    with pytest.raises(WireUnavailable) as refused:
        transport_from_environment({"RMW_IMPLEMENTATION": "rmw_zenoh"})
    facts = "RMW_IMPLEMENTATION rmw_zenoh rmw_zenoh_cpp rmw_cyclonedds_cpp rmw_fastrtps_cpp in_process 'rmw_zenoh_cpp'"
    assert lacks(str(refused.value), facts) == []


@pytest.mark.parametrize("value", ["rmw_cyclonedds_cpp", "rmw_fastrtps_cpp"])
def test_the_middlewares_of_dds_are_dds_without_endpoints_and_security(value: str) -> None:
    chosen = {"RMW_IMPLEMENTATION": value}
    assert isinstance(transport_from_environment(chosen), DdsTransport)
    with pytest.raises(
        WireUnavailable, match="neither listens nor connects at endpoints: name other hosts in ROS_STATIC"
    ):
        transport_from_environment(chosen, listen=("tcp/0.0.0.0:7448",))
    for refused in ({"security": "robot.toml"}, {}):
        with pytest.raises(WireUnavailable, match="for which this library has no security: use rmw_zenoh_cpp"):
            transport_from_environment({**chosen, "ROBACTOR_SECURITY": "robot.toml"}, **refused)


@pytest.mark.parametrize("value", ["233", "-1", "home", "٣"])
def test_a_domain_that_is_none_is_refused_before_anything_starts(value: str) -> None:
    with pytest.raises(WireUnavailable, match="a domain is a number from 0 to 232"):
        transport_from_environment({"ROS_DOMAIN_ID": value})
    with pytest.raises(ValueError, match="a domain is a number from 0 to 232"):
        domain_from_environment({"ROS_DOMAIN_ID": value})


def test_the_domain_is_0_unless_it_is_given() -> None:
    assert [domain_from_environment({"ROS_DOMAIN_ID": value}) for value in ("", "0", "232")] == [0, 0, 232]
    assert domain_from_environment({}) == 0
