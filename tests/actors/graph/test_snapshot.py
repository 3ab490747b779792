"""What a snapshot shows of services and actions: served, asked for, and gone."""

from __future__ import annotations

import msgspec
import pytest

from actors import Action, Done, Node, Service, ServiceUnavailable, Steps, Topic, open_node
from actors.interfaces.example_interfaces.action import Fibonacci
from actors.interfaces.std_msgs.msg import String
from actors.interfaces.std_srvs.srv import Trigger
from actors.testing import Rig

COUNT = Action(Fibonacci, "count")
ELSEWHERE = Action(Fibonacci, "elsewhere")
RESET = Service(Trigger, "reset")


class Counter(Node):
    """Counts for ever."""

    @COUNT.serve(arrivals="queue")
    async def count(self, goal: Fibonacci.Goal) -> Steps[Fibonacci.Feedback, Fibonacci.Result]:
        while True:
            await self.clock.sleep(1.0)
            yield Fibonacci.Feedback()
            if goal.order < 0:
                yield Done(Fibonacci.Result())


async def test_an_action_is_shown_with_its_server_its_clients_and_its_goals(rig: Rig) -> None:
    system = await rig.start(Counter)
    for _ in range(2):
        await rig.send_goal(COUNT, Fibonacci.Goal(order=3))
    (view,) = system.snapshot().services
    assert (view.name, view.type, view.kind, view.server, view.clients, view.calls) == (
        "/count", "example_interfaces/action/Fibonacci", "action", "/counter", ("/rig",), 2,
    )  # fmt: skip
    assert '"node /rig" -> "service /count" [style=dashed]' in system.snapshot().to_dot()


async def test_what_is_asked_for_and_served_by_nobody_is_shown_as_that(rig: Rig) -> None:
    system = await rig.start(Counter)
    before = system.snapshot()
    with pytest.raises(ServiceUnavailable):
        await rig.call(RESET, Trigger.Request(), timeout=0.1)
    rig.me.send_goal(ELSEWHERE, Fibonacci.Goal())  # never sent, but who makes it means to
    view = system.snapshot()
    assert [(one.name, one.kind, one.server, one.clients) for one in view.services] == [
        ("/count", "action", "/counter", ()),
        ("/elsewhere", "action", "", ("/rig",)),
        ("/reset", "service", "", ("/rig",)),
    ]
    assert before.diff(view) == ("+ action /elsewhere", "+ service /reset")


async def test_what_somebody_only_waits_for_is_not_there_yet(rig: Rig) -> None:
    system = await rig.start(Counter)
    waits = [rig.me.create_task(rig.me.wait_for(contract)) for contract in (RESET, ELSEWHERE)]
    await rig.quiet()
    assert [view.name for view in system.snapshot().services] == ["/count"]
    for task in waits:
        task.cancel()


async def test_what_nobody_serves_has_a_line_from_its_client_and_none_to_a_server(rig: Rig) -> None:
    system = await rig.start(Counter)
    with pytest.raises(ServiceUnavailable):
        await rig.call(RESET, Trigger.Request(), timeout=0.1)
    drawn = system.snapshot().to_dot()
    assert '"node /rig" -> "service /reset" [style=dashed]' in drawn
    assert '"service /reset" ->' not in drawn


async def test_a_client_that_has_left_is_no_longer_drawn(rig: Rig) -> None:
    system = await rig.start(Counter)
    async with open_node("visitor") as node, node.send_goal(COUNT, Fibonacci.Goal(order=1)):
        assert '"node /visitor" -> "service /count"' in system.snapshot().to_dot()
    view = system.snapshot()
    assert "visitor" not in view.to_dot() + view.to_mermaid()


async def test_of_a_choice_of_nodes_only_what_concerns_them_is_drawn(rig: Rig) -> None:
    system = await rig.start(Counter)
    await rig.send_goal(COUNT, Fibonacci.Goal(order=3))
    rig.me.publisher(Topic(String, "words"))
    rig.me.subscribe(Topic(String, "words"))
    whole = system.snapshot()
    part = msgspec.structs.replace(whole, nodes=tuple(node for node in whole.nodes if node.name == "/counter"))
    drawn = part.to_dot()
    assert '"service /count" -> "node /counter"' in drawn
    assert "/rig" in whole.to_dot() and "/rig" not in drawn
    assert "/rig" in whole.to_mermaid() and "/rig" not in part.to_mermaid()
