"""The robot on several machines: `--host`, which concerns it is for, and what stays with the body; real agents with `pytest -m realtime`."""

from __future__ import annotations

import asyncio
import json
import signal
import sys
from collections.abc import AsyncGenerator, Sequence
from contextlib import asynccontextmanager
from pathlib import Path

import pytest

from actors import Supervisor
from actors.hosts import HostLost
from actors.testing import Rig
from cli.command import UsageError
from robot import Robot
from robot.contracts import GOAL_REPORT
from robot.geometry.planar import Pose2
from robot.run.crashes import with_hangs
from robot.run.machines import Machines, parse_machines, tls_hosts
from robot.run.options import parse
from robot.run.tasks import Hang
from tests.actors.hosts.kit import AgentProgram, Fleet, fleet, free_port, until
from tests.robot.run.test_run import ENVIRONMENT, ROOT

LISTEN = ("--listen", "tls/0.0.0.0:7448")


# -- what is said ---------------------------------------------------------------------------------------------------------------


def test_a_concern_has_its_machines_in_order_and_each_machine_its_address_which_need_be_said_once() -> None:
    options = parse(
        ["--host", "navigation=base@192.168.1.6,spare@192.168.1.7:8000", "--host", "mission=spare,cellar", *LISTEN]
    )

    assert options.machines == Machines(
        {"navigation": ("base", "spare"), "mission": ("spare", "cellar")},
        {"base": "192.168.1.6", "spare": "192.168.1.7:8000", "cellar": "cellar"},
    )


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["control=base"], "--host control=base: control keeps the robot on its feet 200 times a second, and no network may"),
        (["safety=base"], "--host safety=base: safety stops the robot when the others are not heard, so it must not be cut off itself"),
        (["handling=base"], "--host handling=base: handling moves the arm, which is reached on the robot only"),
        (["body=base"], "--host body=base: what may run elsewhere is perception, navigation, mission"),
        (["navigation"], "--host navigation: write CONCERN=HOST[@ADDRESS[:PORT]][,SPARE...], such as navigation=base@192.168.1.6"),
        (["navigation=base,"], "write CONCERN="),
        (["navigation=base@"], "write CONCERN="),
        (["=base"], "write CONCERN="),
        (["mission=a", "mission=b"], "--host mission=b: mission has machines already; write them in one word, the first choice first"),
        (["mission=a@1.2.3.4", "navigation=a@1.2.3.5"], "--host navigation=a@1.2.3.5: a is at 1.2.3.4 already"),
    ],
)  # fmt: skip
def test_what_may_not_run_elsewhere_is_refused_with_the_reason(words: Sequence[str], said: str) -> None:
    with pytest.raises(UsageError) as refused:
        parse_machines(words)
    assert said in str(refused.value)


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ([], "--host: what runs there must reach this robot: add --listen tls/0.0.0.0:7448, or --connect with"),
        (
            [*LISTEN, "--processes"],
            "with --processes what runs there must reach each of them: start `robactor router` here, and add --connect",
        ),
        ([*LISTEN, "--clock", "virtual"], "other machines live in real time; leave out --clock virtual"),
        ([*LISTEN, "--replay", "patrol"], "--replay: journals are kept of nodes of this process; leave out --host"),
    ],
)
def test_words_that_do_not_go_together_are_refused_with_the_remedy(words: list[str], said: str) -> None:
    with pytest.raises(UsageError) as refused:
        parse(["--host", "navigation=base", *words])
    assert said in str(refused.value)


def test_without_a_security_file_nobody_is_given_anything(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    machines = parse_machines(["navigation=base@base:port"])
    assert machines is not None
    monkeypatch.delenv("ROBACTOR_SECURITY", raising=False)
    with pytest.raises(UsageError, match=r"add --security FILE, or ROBACTOR_SECURITY=FILE \(docs/howto/machines.md\)"):
        tls_hosts(machines, None)
    with pytest.raises(UsageError, match=r"--host: .*nothing.yaml"):
        tls_hosts(machines, str(tmp_path / "nothing.yaml"))
    with pytest.raises(UsageError, match="--host: 'base:port' is no address"):
        tls_hosts(machines, str(Fleet(tmp_path).files["robot"]))


# -- what is declared -------------------------------------------------------------------------------------------------------------


def concerns(robot: Robot) -> dict[str, Supervisor]:
    return {child.name: child for child in robot.tree.children if isinstance(child, Supervisor)}


def test_the_sensors_and_what_makes_less_of_their_images_stay_with_the_body() -> None:
    robot = Robot(body="kinematic", hosts={"perception": ["base", "spare"]})

    parts = concerns(robot)

    assert [child.name for child in parts["sensors"].children] == ["lidar", "camera", "image_compressor"]
    assert parts["sensors"].hosts == ()
    assert parts["perception"].hosts == ("base", "spare")
    together = {child.name for name in ("sensors", "perception") for child in parts[name].children}
    whole = concerns(Robot(body="kinematic"))
    assert together == {child.name for child in whole["perception"].children}
    assert "sensors" not in whole


def test_what_runs_elsewhere_starts_when_the_robot_can_stand() -> None:
    robot = Robot(body="kinematic", mission="patrol", hosts={"navigation": ["base"], "mission": ["base"]})

    assert list(concerns(robot)) == ["control", "safety", "perception", "navigation", "mission"]
    assert [name for name, part in concerns(robot).items() if part.hosts] == ["navigation", "mission"]
    assert "sensors" not in concerns(robot)


@pytest.mark.parametrize("concern", ["control", "safety", "handling", "body"])
def test_a_robot_keeps_what_moves_it(concern: str) -> None:
    with pytest.raises(ValueError, match=rf"hosts=\{{'{concern}': ...\}}: "):
        Robot(body="kinematic", hosts={concern: ["base"]})


def test_a_process_of_another_machine_is_not_made_to_hang() -> None:
    robot = Robot(body="kinematic", hosts={"navigation": ["base"]})
    with pytest.raises(UsageError, match="--hang /docking: its process is on another machine"):
        with_hangs(robot.tree, [Hang("/docking", 3.0)])


# -- what becomes of it ---------------------------------------------------------------------------------------------------------


async def test_a_robot_whose_plans_are_made_on_a_machine_that_is_lost_goes_on_with_those_of_the_spare(rig: Rig) -> None:
    away = ["base", "spare"]
    robot = Robot(
        "empty", body="kinematic", mission=[Pose2(4.0, 0.0)], seed=1, hosts={"navigation": away, "perception": away}
    )
    await rig.start(robot.tree)
    reports = rig.probe(GOAL_REPORT)
    await rig.until(lambda: robot.body.truth().position[0] > 1.0, within=30.0)

    with rig.expect_failure(HostLost):
        rig.hosts.cut("base")
        await rig.until(
            lambda: [one for one in reports if one.name.startswith("goal") and one.outcome == "succeeded"], within=60.0
        )

    assert rig.incarnation("navigation") == 2
    assert rig.incarnation("gait") == rig.incarnation("motors") == rig.incarnation("lidar") == 1
    assert abs(robot.body.truth().position[0] - 4.0) < 0.3


@asynccontextmanager
async def program(*words: str) -> AsyncGenerator[AgentProgram]:
    """A command of the robot, with its lines; it is killed at the end of the block, if it has not ended."""
    process = await asyncio.create_subprocess_exec(
        sys.executable, "-m", "robot", *words, cwd=ROOT, env={**ENVIRONMENT, "RMW_IMPLEMENTATION": "rmw_zenoh_cpp", "ROBACTOR_GOSSIP_PORT": str(free_port())},
        stdout=asyncio.subprocess.PIPE, stderr=asyncio.subprocess.STDOUT,
    )  # fmt: skip
    started = AgentProgram(process)
    try:
        yield started
    finally:
        if process.returncode is None:
            process.kill()
            await process.wait()


def run_words(machines: Fleet, report: Path, *words: str) -> list[str]:
    """`run` with navigation on the base, or else on the spare."""
    hosts = f"navigation=base@{machines.address('base')},spare@{machines.address('spare')}"
    given = ["run", "--no-web", "--world", "empty", "--goal", "3", "0", "--duration", "90", "--report", str(report)]
    return [*given, "--host", hosts, "--security", str(machines.files["robot"]), *words]


async def walks_on(machines: Fleet, robot: AgentProgram, base: AgentProgram, spare: AgentProgram) -> None:
    """The machine of the plans is killed when the robot stands; its run ends with the goal reached."""
    await until(base.launched, robot)
    await until(lambda: any("Robot is now standing" in line for line in robot.lines), robot)
    base.process.send_signal(signal.SIGKILL)
    await until(spare.launched, robot)
    async with asyncio.timeout(120.0):
        await robot.process.wait()
    assert robot.process.returncode == 0, "\n".join(robot.lines)
    assert machines.files["robot"].with_name("runs").read_text() == "1\n"


def judged(path: Path) -> tuple[int, str, list[int]]:
    """Falls, what came of the last goal, and which life of navigation, gait and lidar it is."""
    report = json.loads(path.read_text())
    rows = {row["name"]: row["incarnation"] for row in report["nodes"]}
    lives = [rows[name] for name in ("/navigation", "/gait", "/lidar")]
    return report["falls"], report["goals"][-1]["outcome"], lives


@pytest.mark.realtime
async def test_a_robot_walks_on_when_the_machine_of_its_plans_is_killed(tmp_path: Path) -> None:
    report = tmp_path / "report.json"
    async with fleet(tmp_path) as machines:
        base, spare = [await machines.start(name, "--import", "robot.tree") for name in ("base", "spare")]
        listen = f"tls/{machines.address('robot')}"
        async with program(*run_words(machines, report, "--backend", "kinematic", "--listen", listen)) as robot:
            await walks_on(machines, robot, base, spare)
    assert judged(report) == (0, "succeeded", [2, 1, 1])


@pytest.mark.realtime
async def test_a_robot_in_processes_walks_on_by_a_router(tmp_path: Path) -> None:
    report = tmp_path / "report.json"
    async with fleet(tmp_path) as machines:
        security, endpoint = str(machines.files["robot"]), f"tls/{machines.address('robot')}"
        async with program("router", "--listen", endpoint, "--security", security):
            base, spare = [await machines.start(name, "--import", "robot.tree") for name in ("base", "spare")]
            async with program(*run_words(machines, report, "--processes", "--connect", endpoint)) as robot:
                await walks_on(machines, robot, base, spare)
    assert judged(report) == (0, "succeeded", [2, 1, 1])
