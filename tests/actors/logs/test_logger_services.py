"""The services of a node for the levels of loggers: who has them, what they say, and what a new level does at once."""

from __future__ import annotations

import pytest

from actors import Child, Node, Service, ServiceUnavailable, StartFailed, parameter
from actors.check.checker import check_tree
from actors.interfaces.rcl_interfaces.msg import LoggerLevel
from actors.interfaces.rcl_interfaces.srv import GetLoggerLevels, SetLoggerLevels
from actors.testing import Rig

TOLD = {"enable_logger_service": True}
INVALID = "5 is not a log level; use one of"


class Talker(Node):
    """Logs at three levels when it is told to speak."""

    def speak(self) -> None:
        self.log.debug("thinking")
        self.log.info("speaking")
        self.log.error("out of breath")


class Open(Talker):
    enable_logger_service = parameter(True, read_only=True)


async def levels(rig: Rig, node: str, *names: str) -> list[int]:
    service = Service(GetLoggerLevels, f"{node}/get_logger_levels")
    answer = await rig.me.call(service, GetLoggerLevels.Request(names=names))
    assert [one.name for one in answer.levels] == list(names)
    return [one.level for one in answer.levels]


async def set_levels(rig: Rig, node: str, **wanted: int) -> list[tuple[bool, str]]:
    service = Service(SetLoggerLevels, f"{node}/set_logger_levels")
    request = tuple(LoggerLevel(name=name.replace("__", "."), level=level) for name, level in wanted.items())
    answer = await rig.me.call(service, SetLoggerLevels.Request(levels=request))
    return [(one.successful, one.reason) for one in answer.results]


def said(rig: Rig, node: str) -> list[str]:
    """What the node logs when it speaks once."""
    before = len(rig.logs)
    talker = rig.system.node(node)
    assert isinstance(talker, Talker)
    talker.speak()
    return [record.event for record in list(rig.logs)[before:]]


async def test_a_level_that_is_set_holds_for_the_logger_at_once_and_can_be_taken_back(rig: Rig) -> None:
    await rig.start(Child(Talker, name="mouth", parameters=TOLD))
    await set_levels(rig, "/mouth", **{"": 20})
    assert said(rig, "/mouth") == ["speaking", "out of breath"]
    assert await levels(rig, "/mouth", "mouth", "") == [0, 20]
    assert await set_levels(rig, "/mouth", mouth=10) == [(True, "")]
    assert said(rig, "/mouth") == ["thinking", "speaking", "out of breath"]
    assert await levels(rig, "/mouth", "mouth", "nobody") == [10, 0]
    await set_levels(rig, "/mouth", mouth=0)
    assert said(rig, "/mouth") == ["speaking", "out of breath"]


async def test_one_node_serves_the_loggers_of_all_nodes_of_its_process(rig: Rig) -> None:
    await rig.start(Child(Talker, name="mouth", parameters=TOLD), Child(Talker, name="ear", namespace="head/left"))
    await set_levels(rig, "/mouth", **{"": 20}, head=40)
    assert said(rig, "/head/left/ear") == ["out of breath"]
    await set_levels(rig, "/mouth", head__left__ear=10)
    assert said(rig, "/head/left/ear") == ["thinking", "speaking", "out of breath"]
    assert said(rig, "/mouth") == ["speaking", "out of breath"]


async def test_the_empty_name_is_the_level_of_all_that_have_none_of_their_own(rig: Rig) -> None:
    await rig.start(Child(Talker, name="mouth", parameters=TOLD), Child(Talker, name="ear"))
    rig.system.node("/ear").log.set_level("debug")
    assert await set_levels(rig, "/mouth", **{"": 40}) == [(True, "")]
    assert said(rig, "/mouth") == ["out of breath"]
    assert said(rig, "/ear") == ["thinking", "speaking", "out of breath"]
    assert await levels(rig, "/mouth", "ear") == [10]


async def test_what_is_no_level_is_refused_by_itself(rig: Rig) -> None:
    await rig.start(Child(Talker, name="mouth", parameters=TOLD))
    (set_, _), (refused, reason) = await set_levels(rig, "/mouth", mouth=30, ear=5)
    assert (set_, refused) == (True, False)
    assert reason.startswith(INVALID)
    assert await levels(rig, "/mouth", "mouth", "ear") == [30, 0]


async def test_a_level_holds_for_the_next_incarnation(rig: Rig) -> None:
    await rig.start(Child(Talker, name="mouth", parameters=TOLD))
    await set_levels(rig, "/mouth", mouth=40)
    rig.crash("/mouth")
    await rig.until(lambda: rig.incarnation("/mouth") == 2)
    assert said(rig, "/mouth") == ["out of breath"]


async def test_only_nodes_that_are_told_so_have_the_services(rig: Rig) -> None:
    await rig.start(
        Child(Talker, name="mute"),
        Child(Open, name="open"),
        Child(Open, name="shut", parameters={**TOLD, "enable_logger_service": False}),
    )
    assert await levels(rig, "/open", "open") == [0]
    for node in ("/mute", "/shut"):
        with pytest.raises(ServiceUnavailable):
            await rig.me.call(
                Service(GetLoggerLevels, f"{node}/get_logger_levels"), GetLoggerLevels.Request(), timeout=0.5
            )


async def test_whether_they_are_there_is_said_at_the_start(rig: Rig) -> None:
    await rig.start(Child(Talker, name="mouth", parameters=TOLD))
    refused = rig.system.node("/mouth").set_parameters({"enable_logger_service": False})
    assert not refused.successful


def test_a_tree_that_says_so_has_no_flaw() -> None:
    assert not check_tree(Child(Talker, name="mouth", parameters=TOLD))


async def test_it_is_said_by_a_truth_value(rig: Rig) -> None:
    with pytest.raises(StartFailed, match="enable_logger_service"):
        await rig.start(Child(Talker, name="ear", parameters={"enable_logger_service": "yes"}))
