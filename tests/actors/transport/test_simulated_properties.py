"""Whatever happens on a simulated network, the guarantees of the Protocol hold; and when all is well again, everybody knows everything."""

from __future__ import annotations

import asyncio
from collections import defaultdict
from dataclasses import dataclass, field
from typing import Literal, TypeAlias

from hypothesis import given, settings
from hypothesis import strategies as st

from actors.time.virtual_loop import VirtualLoop
from actors.transport.keyed.protocol import Answer, Delivery, Outlet, Replied
from actors.transport.simulated.link import Conditions
from tests.actors.transport.contract.parties import token
from tests.actors.transport.lab import Lab, Timed, numbered

HOSTS = ("a", "b", "c")
LEASE = 1.0
KINDS = {
    "kept": Delivery(keep_all=True, history=10_000),
    "reliable": Delivery(keep_all=True),
    "newest": Delivery(depth=3),
    "best_effort": Delivery(reliable=False, depth=3, priority=2),
}
"""One topic of each kind; all hosts put and listen on each of them."""

# Steps ---------------------------------------------------------------------------------------------------------------------

hosts = st.sampled_from(HOSTS)
pairs = st.sampled_from([("a", "b"), ("b", "c"), ("c", "a"), ("a", "hub"), ("b", "hub"), ("c", "hub")])
conditions = st.builds(
    Conditions,
    delay=st.sampled_from([0.0005, 0.02, 0.3]),
    jitter=st.sampled_from([0.0, 0.001, 0.1]),
    bandwidth=st.sampled_from([1e9, 20_000.0]),
    loss=st.sampled_from([0.0, 0.3]),
    duplication=st.sampled_from([0.0, 0.3]),
    reordering=st.sampled_from([0.0, 0.3]),
    resend=st.sampled_from([0.01, 0.2]),
)
steps = st.one_of(
    st.tuples(st.just("put"), hosts, st.sampled_from(sorted(KINDS)), st.integers(1, 5)),
    st.tuples(st.just("wait"), st.sampled_from([0.0003, 0.01, 0.3, 0.9, 2.5])),
    st.tuples(st.just("cut"), pairs, st.booleans()),
    st.tuples(st.just("heal"), pairs),
    st.tuples(st.just("impair"), pairs, conditions),
    st.tuples(st.just("router"), st.booleans()),
    st.tuples(st.just("hub"), st.booleans()),
    st.tuples(st.just("ask"), hosts, hosts),
    st.tuples(st.just("token"), hosts, st.sampled_from(["x", "y"])),
)
Mode: TypeAlias = Literal["peer", "client"]
Step: TypeAlias = "tuple[object, ...]"


@dataclass
class World:
    """Three parties with one outlet and one subscription of each kind, and what has been done."""

    lab: Lab
    parties: dict[str, Timed] = field(default_factory=dict[str, Timed])
    outlets: dict[tuple[str, str], Outlet] = field(default_factory=dict[tuple[str, str], Outlet])
    puts: defaultdict[tuple[str, str], int] = field(default_factory=lambda: defaultdict[tuple[str, str], int](int))
    heard: dict[tuple[str, str, str], list[tuple[float, int]]] = field(
        default_factory=dict[tuple[str, str, str], list[tuple[float, int]]]
    )
    """By the host that puts, the kind, and the host that listens."""
    asked: list[list[Answer]] = field(default_factory=list[list[Answer]])
    tokens: dict[str, object] = field(default_factory=dict[str, object])

    async def set_up(self, modes: tuple[Mode, ...]) -> None:
        network = self.lab.network
        network.add_host("hub", router=True)
        for host, mode in zip(HOSTS, modes, strict=True):
            network.add_host(host, mode)
            self.parties[host] = await self.lab.party(host)
        await self.lab.linked(*self.parties.values())
        for listener, party in self.parties.items():
            party.serve(f"7/{listener}/add", lambda query: query.reply(query.payload, b""))
            for host in HOSTS:
                for kind, delivery in KINDS.items():
                    if host != listener:
                        self.heard[host, kind, listener], _ = self.lab.hear(party, f"7/{host}/{kind}", delivery)
        for party in self.parties.values():
            await party.told_to(*(other for other in self.parties.values() if other is not party))
        for host, party in self.parties.items():
            for kind, delivery in KINDS.items():
                self.outlets[host, kind] = party.transport.outlet(f"7/{host}/{kind}", delivery)

    def put(self, host: str, kind: str) -> None:
        self.outlets[host, kind].put(numbered(self.puts[host, kind], size=50), b"")
        self.puts[host, kind] += 1

    async def step(self, step: Step) -> None:
        network = self.lab.network
        match step:
            case "put", str(host), str(kind), int(count):
                for _ in range(count):
                    self.put(host, kind)
            case "wait", float(seconds):
                await asyncio.sleep(seconds)
            case "cut", (str(one), str(other)), bool(one_way):
                network.cut(one, other, one_way=one_way)
            case "heal", (str(one), str(other)):
                network.heal(one, other)
            case "impair", (str(one), str(other)), Conditions() as bad:
                network.impair(one, other, bad)
            case "router", bool(on):
                (network.start_router if on else network.stop_router)()
            case "hub", bool(on):
                (network.reboot if on else network.crash)("hub")
            case "ask", str(host), str(other):
                self.asked.append(self.parties[host].ask(f"7/{other}/add", b"?", timeout=3.0)[0])
            case "token", str(host), str(name):
                text = token(f"{self.parties[host].session}/{name}")
                if text in self.tokens:
                    self.tokens.pop(text).close()  # type: ignore[attr-defined]
                else:
                    self.tokens[text] = self.parties[host].transport.announce(text)
            case _:
                raise AssertionError(step)

    async def restore(self) -> None:
        """End all faults, and wait until what was late and lost has come and been found again."""
        network = self.lab.network
        network.reboot("hub")
        network.start_router()
        for one, other in (("a", "b"), ("b", "c"), ("c", "a"), *((host, "hub") for host in HOSTS)):
            network.repair(one, other)
            network.heal(one, other)
        await asyncio.sleep(60.0)


async def run(seed: int, modes: tuple[Mode, ...], story: list[Step]) -> World:
    world = World(Lab(seed=seed, lease=LEASE))
    await world.set_up(modes)
    for step in story:
        await world.step(step)
    await world.restore()
    return world


# What holds ----------------------------------------------------------------------------------------------------------------


def check_order(world: World) -> None:
    """Samples come in order and once, and none that was not put."""
    for (host, kind, _), heard in world.heard.items():
        numbers = [number for _, number in heard]
        assert numbers == sorted(set(numbers))
        assert set(numbers) <= set(range(world.puts[host, kind]))


def check_delivery(world: World) -> None:
    """Everything that is kept arrives in the end; what is only reliable, unless the two lost each other."""
    for (host, kind, listener), heard in world.heard.items():
        numbers = [number for _, number in heard]
        one, other = world.parties[host], world.parties[listener]
        never_lost = not (one.has("down", other.session) or other.has("down", one.session))
        if kind == "kept" or (kind == "reliable" and never_lost):
            assert numbers == list(range(world.puts[host, kind]))


def check_log(party: Timed) -> None:
    """Links and tokens come and go in turn, and a process is lost with all that it has announced, its link first."""
    links: set[object] = set()
    tokens: set[object] = set()
    owners = {session: f"@ros2_lv/7/{session}/" for session in (one.of for one in party.told("up"))}
    losing: str | None = None
    for kind, of in party.log:
        match kind:
            case "up":
                assert of not in links
                assert not any(str(one).startswith(owners[of]) for one in tokens)
                links.add(of)
                losing = None if losing == owners[of] else losing
            case "down":
                links.remove(of)
                losing = owners[of]
            case "appeared":
                assert of not in tokens
                tokens.add(of)
            case "vanished":
                tokens.remove(of)
            case _:
                assert losing is None or not any(str(one).startswith(losing) for one in tokens)


def check_knowledge(world: World) -> None:
    """In the end everybody knows the others, and each token that is announced, and no other; and is heard by them."""
    for host, party in world.parties.items():
        others = {other.session for name, other in world.parties.items() if name != host}
        assert {link.session for link in party.transport.report()} == others
        last = {one.of: one.kind for one in party.told("appeared", "vanished")}
        known = {text for text, kind in last.items() if kind == "appeared" and "so_far" not in str(text)}
        assert known == {text for text in world.tokens if text.split("/")[2] != party.session}
        assert all(world.outlets[host, kind].wanted for kind in KINDS)


@given(
    seed=st.integers(0, 1000),
    modes=st.tuples(*[st.sampled_from(["peer", "client"])] * 3),
    story=st.lists(steps, max_size=30),
)
def test_whatever_happens_the_guarantees_hold_and_all_is_known_in_the_end(
    seed: int, modes: tuple[Mode, ...], story: list[Step]
) -> None:
    async def main() -> None:
        world = await run(seed, modes, story)
        check_order(world)
        check_delivery(world)
        check_knowledge(world)
        for party in world.parties.values():
            check_log(party)
        for answers in world.asked:
            assert len(answers) == 1
            assert not isinstance(answers[0], Replied) or answers[0].payload == b"?"
        for host, kind in world.outlets:
            before = world.puts[host, kind]
            world.put(host, kind)
            await asyncio.sleep(1.0)
            listeners = [name for name in HOSTS if name != host]
            assert [world.heard[host, kind, name][-1][1] for name in listeners] == [before, before]

    with asyncio.Runner(loop_factory=VirtualLoop) as runner:
        runner.run(main())


@given(
    seed=st.integers(0, 1000),
    modes=st.tuples(*[st.sampled_from(["peer", "client"])] * 3),
    story=st.lists(steps, min_size=5, max_size=30),
)
@settings(max_examples=40, deadline=None)
def test_the_same_story_with_the_same_seed_has_the_same_course(
    seed: int, modes: tuple[Mode, ...], story: list[Step]
) -> None:
    def course() -> tuple[object, ...]:
        with asyncio.Runner(loop_factory=VirtualLoop) as runner:
            world = runner.run(run(seed, modes, story))
        told = [
            [(at, kind, str(of)) for at, kind, of in one.times if kind in ("up", "down", "appeared", "vanished")]
            for one in world.parties.values()
        ]
        return told, world.heard, [str(one) for one in world.asked]

    assert course() == course()
