"""Who watches a graph sees the leases of the machines to which a tree gives its parts."""

from __future__ import annotations

from actors import Child, Intensity, Node, Supervisor, every, run
from actors.checks import create
from actors.hosts.simulated import SimulatedHosts
from actors.transport.figures import FIGURES, LeaseFigures
from actors.transport.simulated.network import Network
from tests.actors.supervision.kit import virtual


class Worker(Node):
    @every(hz=10)
    def work(self) -> None: ...


@virtual
async def test_a_process_tells_what_is_left_of_the_lease_of_each_machine_and_how_many_parts_it_runs() -> None:
    network = Network(0)
    for name in ("robot", "base", "spare", "desk"):
        network.add_host(name)
    hosts = create(SimulatedHosts, network, "robot", ("base", "spare"))
    away = [Child(Worker, name=name, hosts=["spare", "base"]) for name in ("one", "two")]
    tree = Supervisor("top", intensity=Intensity(9, within=60.0), children=away)

    async def leases() -> tuple[LeaseFigures, ...]:
        while not (figures := await told.next(timeout=5.0)).leases:
            pass
        return tuple(figures.leases)

    desk = run(Child(Node, name="watcher"), sinks=(), transport=network.transport("desk"))
    async with run(tree, sinks=(), transport=network.transport("robot"), hosts=hosts), desk as system:
        async with system.node("watcher").subscribe(FIGURES) as told:
            base, spare = await leases()
            assert (base.host, base.parts, spare.host, spare.parts) == ("base", 0, "spare", 2)
            assert 2.5 < base.left <= 3.0
            assert 2.5 < spare.left <= 3.0

            hosts.cut("spare")
            while (base := (both := await leases())[0]).parts < 2:
                pass
            spare = both[1]
            assert (spare.parts, spare.left) == (0, 0.0)
            assert base.left > 2.0
