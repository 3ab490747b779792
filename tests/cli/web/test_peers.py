"""What other nodes say wrongly takes neither the page nor its STOP away, and is not asked for again and again."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest

from actors import Child, Node, Topic
from actors.interfaces import InterfaceError, UnknownInterface
from actors.interfaces.foreign import ForeignType
from actors.interfaces.rcl_interfaces.msg import Parameter, ParameterEvent, ParameterValue
from actors.qos import PARAMETER_EVENTS
from actors.testing import Rig
from cli.web.clients.errors import Refused
from cli.web.graph import types
from cli.web.graph.types import AGAIN, Types
from cli.web.server import audience
from tests.cli.web.stage import serving

STRANGE = ForeignType("strange_msgs/msg/Thing", "RIHS01_" + "0" * 64)


class Server(Node):
    """Stands for the web server."""


@pytest.fixture
def asked(monkeypatch: pytest.MonkeyPatch) -> Callable[[Exception], list[str]]:
    """Let the nodes describe types so that reading it raises this; returns the types that they were asked for."""

    def failing(error: Exception) -> list[str]:
        names: list[str] = []

        async def fetched(node: Node, system: Any, get: Any, name: str, *more: Any) -> Any:
            names.append(name)
            raise error

        monkeypatch.setattr(types, "fetched", fetched)
        return names

    return failing


async def refused(own: Types) -> str:
    with pytest.raises(Refused) as caught:
        await own.message(STRANGE.__ros_type__, [("/evil", STRANGE)])
    return str(caught.value)


@pytest.mark.parametrize(
    "error",
    [RecursionError("too deep"), ValueError("not enough values"), InterfaceError("no definition"), KeyError("x")],
)
async def test_a_node_that_describes_its_type_wrongly_is_asked_once(
    rig: Rig, asked: Callable[[Exception], list[str]], error: Exception
) -> None:
    names = asked(error)
    await rig.start(Child(Server))
    own = Types(rig.node(Server), rig.system)
    for _ in range(3):
        assert "strange_msgs/msg/Thing cannot be read" in await refused(own)
        await rig.advance(10 * AGAIN)
    assert names == [STRANGE.__ros_type__]
    assert rig.state("server").state == "running"


async def test_a_node_that_does_not_describe_its_type_is_asked_again_later(
    rig: Rig, asked: Callable[[Exception], list[str]]
) -> None:
    names = asked(UnknownInterface("strange_msgs/msg/Thing is not known"))
    await rig.start(Child(Server))
    own = Types(rig.node(Server), rig.system)
    for _ in range(4):
        await refused(own)
        await rig.advance(AGAIN / 2)
    assert len(names) == 2


async def test_a_failure_over_the_graph_is_logged_and_the_page_goes_on(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(audience, "AGAIN", 0.0)
    async with serving() as stage, stage.foxglove() as viewer:
        catalog = stage.server._audience.hub.catalog  # pyright: ignore[reportPrivateUsage]
        update, failures = catalog.update, [RecursionError("a type that contains itself")]

        async def failing() -> Any:
            if failures:
                raise failures.pop()
            return await update()

        monkeypatch.setattr(catalog, "update", failing)
        strange = ParameterEvent(node="/evil", new_parameters=[Parameter(name="p", value=ParameterValue(type=77))])
        stage.talker.publisher(Topic(ParameterEvent, "/parameter_events"), qos=PARAMETER_EVENTS)(strange)
        stage.talker.publisher(Topic(ParameterEvent, "/one"))
        await viewer.channel("/one")
        assert not failures
