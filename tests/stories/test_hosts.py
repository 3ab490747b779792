"""Several hosts, each a network namespace, on cables that are slow, lossy, or cut. The figures are printed: pytest -m realtime -s."""

from __future__ import annotations

import asyncio
import re

import pytest

from actors.transport.simulated.link import Conditions
from tests.stories.conftest import Program
from tests.stories.hosts import WIRE, Hosts, endpoint

pytestmark = pytest.mark.realtime

TWO = pytest.mark.parametrize("hosts", [2], indirect=True)
LOSSY = Conditions(delay=0.001, loss=0.1)


def number(line: str, after: str) -> float:
    """The number that follows a word."""
    found = re.search(rf"{after} (-?[0-9.]+)", line)
    assert found, line
    return float(found[1])


async def told(program: Program, part: str, since: int, lines: int = 1) -> list[str]:
    """The next lines with `part` that a program writes."""
    found: list[str] = []
    for _ in range(lines):
        line = await program.says(part, since)
        since = program.lines.index(line, since) + 1
        found.append(line)
    return found


async def begin(teller: Program) -> None:
    assert teller.process.stdin is not None
    teller.process.stdin.write(b"begin\n")
    await teller.process.stdin.drain()


# Loss ------------------------------------------------------------------------------------------------------------------


async def lossy(hosts: Hosts, by: str, conditions: Conditions) -> tuple[str, str]:
    """What the hearer says at the end of both topics, of 1000 messages over cables that lose some once all have met."""
    hearer = await hosts.far(2, "hearer,answerer", by=by)
    teller = await hosts.far(1, "teller,caller", meets=(2,), by=by)
    await teller.says("answered")
    hosts.cables.set(1, 2, conditions)
    await begin(teller)
    await teller.says("told all")
    hosts.cables.set(1, 2, WIRE)
    await told(hearer, "kept", len(hearer.lines), 3)  # what is still on its way arrives
    since = len(hearer.lines)
    (sure,), (unsure,) = await told(hearer, "sure ", since), await told(hearer, "unsure ", since)
    print(f"{by}, {conditions.loss:.0%} lost, {hosts.sent_again(1)} segments sent again: {sure}; {unsure}")
    return sure, unsure


@TWO
async def test_reliable_messages_all_arrive_in_order_over_a_link_that_loses_a_tenth(hosts: Hosts) -> None:
    sure, _ = await lossy(hosts, "tcp", LOSSY)

    assert sure.startswith("sure 1000 ordered")
    assert hosts.cable(1, 2).lost > 50
    assert hosts.sent_again(1) > 0


@TWO
async def test_over_a_udp_link_what_is_lost_is_not_sent_again_and_the_order_is_kept(hosts: Hosts) -> None:
    _, unsure = await lossy(hosts, "udp", LOSSY)

    assert "ordered" in unsure.split()
    assert 850 <= number(unsure, "unsure") <= 950
    assert hosts.sent_again(1) == 0


@TWO
async def test_reliable_messages_are_late_where_those_of_best_effort_are_lost(hosts: Hosts) -> None:
    conditions = Conditions(delay=0.005, jitter=0.002, loss=0.05)
    sure, _ = await lossy(hosts, "tcp", conditions)
    await hosts.end_programs()
    _, unsure = await lossy(hosts, "udp", conditions)

    assert number(sure, "p99") > 2 * number(unsure, "p99")
    assert number(unsure, "p99") < 100.0


@TWO
async def test_best_effort_is_not_faster_it_carries_what_is_not_lost_and_reliable_all(
    hosts: Hosts,
) -> None:
    rates: dict[tuple[str, float], float] = {}
    # What Zenoh sends in one piece has to fit a packet of the cable: a datagram is lost if any part of it is.
    small = {"ZENOH_CONFIG_OVERRIDE": "transport/link/tx/batch_size=1450"}
    for loss in (0.0, 0.05):
        for by, reliable in (("tcp", True), ("udp", False)):
            catcher = await hosts.far(2, "catcher", by=by, **small)
            await hosts.far(1, "stream", f"stream.reliable={reliable}", meets=(2,), by=by, **small)
            await catcher.says("packets 1")
            hosts.cables.set(1, 2, Conditions(delay=0.01, loss=loss))
            lines = (await told(catcher, "packets", len(catcher.lines), 7))[2:]
            rates[by, loss] = sum(number(line, "packets") for line in lines) / 5
            each = sorted(number(line, "each") for line in lines)[2]
            print(f"{by}, {loss:.0%} lost: {rates[by, loss]:.0f} packets/s, {each:.0f} us of the processor each")
            await hosts.end_programs()
            hosts.cables.set(1, 2, WIRE)

    assert 0.8 < rates["udp", 0.0] / rates["tcp", 0.0] < 1.25
    assert 0.88 < rates["udp", 0.05] / rates["udp", 0.0] < 0.98
    assert rates["tcp", 0.05] > 0.9 * rates["tcp", 0.0]


async def test_with_delay_and_loss_messages_arrive_and_calls_end_also_when_the_server_is_started_again(
    hosts: Hosts,
) -> None:
    hearer = await hosts.far(2, "hearer")
    answerer = await hosts.far(3, "answerer")
    teller = await hosts.far(1, "teller,caller", "teller.count=400", "teller.rate=50.0", meets=(2, 3))
    await teller.says("answered")
    for other in (2, 3):
        hosts.cables.set(1, other, Conditions(delay=0.05, loss=0.05))
    await begin(teller)
    await told(teller, "answered", len(teller.lines), 3)

    since = len(teller.lines)
    await answerer.kill()
    failed = await teller.says("NotRunning", since)
    again = await hosts.far(3, "answerer")
    await told(teller, "answered", teller.lines.index(failed), 3)
    await teller.says("told all")
    last = await hearer.says("sure 400")

    assert last.startswith("sure 400 ordered")
    assert "/answerer" in failed
    assert again.process.returncode is None


# Cuts ------------------------------------------------------------------------------------------------------------------


async def test_a_link_that_is_cut_for_10_seconds_and_healed_carries_topics_and_calls_again(hosts: Hosts) -> None:
    hearer = await hosts.far(1, "hearer")
    answerer = await hosts.far(2, "answerer", meets=(1,))
    teller = await hosts.far(3, "teller,caller", "teller.count=100000", "teller.rate=20.0", meets=(1, 2))
    await teller.says("answered")
    await begin(teller)
    await told(hearer, "sure ", len(hearer.lines), 2)

    for one, other in ((3, 1), (3, 2)):
        hosts.cables.cut(one, other)
    await asyncio.sleep(10.0)
    during = len(teller.lines)
    (failed,) = await told(teller, "call ", during)
    (heard,) = await told(hearer, "sure ", len(hearer.lines))
    for one, other in ((3, 1), (3, 2)):
        hosts.cables.heal(one, other)
    begun = asyncio.get_running_loop().time()
    await told(teller, "answered", during, 3)
    answered = asyncio.get_running_loop().time() - begun
    last = int(number(heard, "last"))
    while int(number((await told(hearer, "sure ", len(hearer.lines)))[0], "last")) <= last:
        assert asyncio.get_running_loop().time() - begun < 30.0
    kept = int(number((await told(hearer, "kept", len(hearer.lines)))[0], "kept"))

    assert "answered" not in failed
    assert kept > last
    assert answerer.process.returncode is None
    print(f"calls are answered {answered:.1f} s after the link was healed")


# The lab ---------------------------------------------------------------------------------------------------------------

LAB = ("robot.tutorials", "humanoid_lab", "--log-level", "debug", "--only")


async def test_the_checklist_of_the_lab_holds_for_three_hosts(hosts: Hosts) -> None:
    names = ("sensor_simulator", "planner", "motor_controller")
    programs = [
        await hosts.start(
            host, *LAB, name, "--listen", endpoint(host), *(word for other in range(1, host) for word in ("--connect", endpoint(other)))
        )
        for host, name in enumerate(names, 1)
    ]  # fmt: skip
    sensor, planner, motors = programs
    await motors.says("Published motor commands")
    before = [
        sum("Received sensor data" in line for line in planner.lines),
        sum("Published motor" in line for line in motors.lines),
    ]

    await asyncio.sleep(35.0)

    after = [
        sum("Received sensor data" in line for line in planner.lines),
        sum("Published motor" in line for line in motors.lines),
    ]
    readings, commands = (later - earlier for earlier, later in zip(before, after, strict=True))
    assert abs(readings - 350) <= 4
    assert abs(commands - 17) <= 1
    assert not [line for program in programs for line in program.lines if "[error" in line or "Traceback" in line]
    assert sensor.process.returncode is None

    await planner.kill()
    silent = len(motors.lines)
    again = await hosts.start(
        2, *LAB, "planner", "--listen", endpoint(2), "--connect", endpoint(1), "--connect", endpoint(3)
    )
    await again.says("Received sensor data")
    await told(motors, "Published motor commands", silent)
    assert all(program.process.returncode is None for program in (sensor, motors))


# Thin links ------------------------------------------------------------------------------------------------------------

THIN = Conditions(delay=0.001, bandwidth=1e6)


async def second_by_second(hosts: Hosts, noisy: bool, **environment: str) -> tuple[float, float, float]:
    """Images a second over 1 MB/s, and the median and the largest lateness of a command beside them, in milliseconds."""
    hosts.cables.set(1, 2, THIN)
    base = await hosts.far(2, "base,viewer", **environment)
    await hosts.far(1, "driver,camera", f"camera.noisy={noisy}", "camera.rate=15.0", meets=(2,), **environment)
    await told(base, "commands", 0, 4)  # the links are full
    since = len(base.lines)
    images = await told(base, "images", since, 8)
    commands = await told(base, "commands", since, 8)
    await hosts.end_programs()
    late = sorted(number(line, "most") for line in commands)
    result = (
        sum(number(line, "images") for line in images) / 8,
        sorted(number(line, "median") for line in commands)[4],
        late[-1],
    )
    print(
        f"{'noise' if noisy else 'a scene'} {environment}: {result[0]:.2f} images/s, a command is {result[1]:.0f} ms late, {late[-1]:.0f} at most"
    )
    return result


@TWO
async def test_a_thin_link_carries_more_images_when_it_compresses_and_commands_overtake_them(
    hosts: Hosts,
) -> None:
    uncompressed = {"ZENOH_CONFIG_OVERRIDE": "transport/unicast/compression/enabled=false"}

    plain = await second_by_second(hosts, False, ROBACTOR_THIN_LINKS="1", **uncompressed)
    scene = await second_by_second(hosts, False, ROBACTOR_THIN_LINKS="1")
    noise = await second_by_second(hosts, True, ROBACTOR_THIN_LINKS="1")
    usual = await second_by_second(hosts, True)

    assert 0.5 < plain[0] < 1.5  # 921,600 bytes each
    assert scene[0] >= 3 * plain[0]
    assert 0.5 < noise[0] < 1.5
    for _, median, most in (plain, scene, noise):
        assert median < 150.0
        assert most < 300.0
    assert usual[1] < 500.0  # an image alone takes 920 ms
