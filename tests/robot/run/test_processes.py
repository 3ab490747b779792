"""The robot in processes: what is declared, what is refused, and, on the real clock, that it walks, survives a hang, and leaves nothing behind."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from actors import Supervisor
from actors.testing import Rig
from cli.command import UsageError
from robot.hardware.sensors import Sensors
from robot.link import segment
from robot.link.remote import LinkedBody
from robot.link.segment import PREFIX
from robot.nodes import process_care
from robot.nodes.process_care import ProcessCare
from robot.run.crashes import with_hangs
from robot.run.options import parse
from robot.run.tasks import Hang
from robot.run.tree_nodes import nodes_of
from robot.scenes.worlds import get_world
from robot.sim.battery import Pack
from robot.tree import robot_tree
from tests.figures.load import family, processor_seconds
from tests.robot.run.test_run import ENVIRONMENT, ROOT, node, robot, run
from tests.robot.stage import whole


@pytest.fixture
def split() -> Iterator[Supervisor]:
    """The tree of a robot with an arm, real sensors and sight, in processes; its body is only a name."""
    scene = get_world("kitchen")
    memory = segment.create(len(scene.things))
    body = LinkedBody(memory.name, scene, seed=1, arm=True, sensors=Sensors.real())
    body.segment.scenery.write([0.0] * (segment.ARM + segment.THING * len(scene.things)))
    yield robot_tree(body, Pack(90.0), [("goal", scene.start)], processes=True, sight=True)
    memory.remove()
    memory.close()


# -- what is declared -----------------------------------------------------------------------------------------------------------


def test_each_concern_is_a_process_with_the_nodes_that_it_has_in_one(split: Supervisor) -> None:
    concerns = {child.name: child for child in split.children if isinstance(child, Supervisor)}
    assert list(concerns) == ["control", "safety", "perception", "navigation", "handling", "mission"]
    assert all(concern.process for concern in concerns.values())
    assert [child.name for child in nodes_of(split) if child.factory is not ProcessCare] == [
        child.name for child in nodes_of(whole())
    ]


def test_the_guard_shares_its_loop_with_nothing_else(split: Supervisor) -> None:
    control = split.children[0]
    assert isinstance(control, Supervisor)
    assert [child.name for child in control.children] == ["control_process", "motors", "proprioception", "gait"]
    assert control.hang == 0.1
    assert {child.hang for child in split.children[1:] if isinstance(child, Supervisor)} == {5.0}


def test_in_one_process_nothing_is_declared_of_processes() -> None:
    assert not any(child.process for child in whole().children if isinstance(child, Supervisor))


def test_a_hang_is_made_in_the_process_of_its_node_and_in_no_other(split: Supervisor) -> None:
    hanging = with_hangs(split, [Hang("gait", 3.0), Hang("/lidar", 5.0), Hang("camera", 7.0)])
    ordered = {child.name: child.args[2:] for child in nodes_of(hanging) if child.factory is ProcessCare}
    names = {name: [hang.node for hang in hangs] for name, hangs in ordered.items() if hangs}  # type: ignore[attr-defined]
    assert names == {"control_process": ["gait"], "perception_process": ["/lidar", "camera"]}


async def test_a_hang_whose_time_is_over_is_not_made_again_by_the_next_life(
    rig: Rig, monkeypatch: pytest.MonkeyPatch
) -> None:
    from actors import Child

    monkeypatch.setattr(process_care, "step_aside", lambda: "stays")  # this process is that of the tests
    over = process_care.Hang("nobody", time.monotonic() - 1.0)
    await rig.start(Child(ProcessCare, args=("somewhere", None, over)))
    await rig.advance(1.0)
    assert rig.incarnation("process_care") == 1


# -- what is refused ------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["--processes", "--clock", "virtual"], "--processes: processes live in real time; leave out --clock virtual"),
        (["--processes", "--backend", "kinematic"], "only the physics body has a process of its own; leave out --backend kinematic"),
        (["--hang", "gait@3"], "--hang: in one process everything would hang, so nothing could notice it; add --processes"),
        (["--processes", "--hang", "gait"], "--hang gait: write NODE@SECONDS, such as navigation@10"),
        (["--processes", "--hang", "gait@9", "--duration", "5"], "--hang gait@9: the run ends at 5 s, before that"),
    ],
)  # fmt: skip
def test_words_that_do_not_go_together_are_refused_with_the_remedy(words: list[str], said: str) -> None:
    with pytest.raises(UsageError) as refused:
        parse(words)
    assert said in str(refused.value)


def test_a_hang_of_a_node_that_is_not_there_is_refused_and_leaves_nothing() -> None:
    done = robot("run", "--processes", "--hang", "gate@3")
    assert done.returncode == 2
    assert done.stderr.splitlines() == [
        "robot run: --hang gate@3: there is no node 'gate'; did you mean gait or battery?"
    ]


# -- what is measured -----------------------------------------------------------------------------------------------------------


def test_the_family_of_a_process_has_what_it_started_and_what_that_started() -> None:
    code = "import subprocess, sys; subprocess.Popen([sys.executable, '-c', 'import time; time.sleep(100)']).wait()"
    with subprocess.Popen([sys.executable, "-c", code]) as child:
        assert until(lambda: len(family(child.pid)) == 2)
        found = family(child.pid)
        assert found <= family(os.getpid())
        for one in found:
            os.kill(one, signal.SIGKILL)


def test_processor_time_is_that_of_the_processes_given() -> None:
    with subprocess.Popen([sys.executable, "-c", "while True: pass"]) as busy:
        assert until(lambda: processor_seconds({busy.pid}) > 0.3)
        busy.kill()
    assert processor_seconds({busy.pid}) == 0.0


# -- on the real clock ----------------------------------------------------------------------------------------------------------


def until(true: Callable[[], bool], seconds: float = 20.0) -> bool:
    deadline = time.monotonic() + seconds
    while not true() and time.monotonic() < deadline:
        time.sleep(0.02)
    return true()


def segments() -> list[str]:
    return [path.name for path in Path("/dev/shm").glob(f"{PREFIX}*")]


@pytest.mark.realtime
def test_the_robot_in_processes_walks_to_its_goal_and_leaves_nothing(tmp_path: Path) -> None:
    before = segments()
    done, report = run(tmp_path, "--processes", "--goal", "1.5", "0", "--world", "empty", "--duration", "60")
    assert done.returncode == 0, done.stderr
    assert (report["falls"], report["last"]["fallen"]) == (0, False)
    assert [goal["outcome"] for goal in report["goals"]] == ["succeeded"]
    assert report["goals"][0]["true_error"] < 0.1
    assert report["last"]["body_height"] < 0.25
    assert {row["incarnation"] for row in report["nodes"]} == {1}
    assert segments() == before


@pytest.mark.realtime
def test_a_control_process_that_hangs_is_replaced_and_the_robot_sits_meanwhile(tmp_path: Path) -> None:
    done, report = run(tmp_path, "--processes", "--hang", "gait@12", "--duration", "18")
    assert done.returncode == 1, done.stderr  # the robot sits, so the goal was not reached
    why = done.stderr.splitlines()[-1].removeprefix("robot run: patrol_1 (8.8, 0.5): aborted: ")
    late = "safety stop: "  # if the machine was so busy that control was away for half a second
    assert why == "the robot has stopped walking: its gait is 'sit'" or why.startswith(late)
    assert report["falls"] == 0
    assert [node(report, f"/{name}")["incarnation"] for name in ("motors", "gait", "lidar", "patrol")] == [2, 2, 1, 1]
    assert "did not turn for 0.1 s" in done.stderr
    assert not report["last"]["fallen"]


@pytest.mark.realtime
def test_when_the_parent_is_killed_the_robot_sits_and_all_others_end_by_themselves() -> None:
    before = segments()
    with subprocess.Popen(
        [sys.executable, "-m", "robot", "run", "--processes"],
        cwd=ROOT,
        env=ENVIRONMENT,
        stderr=subprocess.PIPE,
        text=True,
    ) as parent:
        assert parent.stderr is not None
        assert any("Robot is now standing" in line for line in parent.stderr)
        others = family(parent.pid) - {parent.pid}
        assert len(others) >= 6
        parent.kill()
        assert until(lambda: not any(map(alive, others)))
    assert until(lambda: segments() == before)


def alive(process: int) -> bool:
    try:
        return Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except OSError:
        return False


@pytest.mark.realtime
def test_without_its_body_a_run_ends_with_one_line_and_exit_code_3() -> None:
    with subprocess.Popen(
        [sys.executable, "-m", "robot", "run", "--processes", "--log-level", "fatal"],
        cwd=ROOT, env=ENVIRONMENT, stderr=subprocess.PIPE, text=True,
    ) as parent:  # fmt: skip
        assert parent.stderr is not None
        assert until(lambda: len(family(parent.pid)) >= 8)
        (body,) = [one for one in family(parent.pid) if Path(f"/proc/{one}/comm").read_text() == "body\n"]
        os.kill(body, signal.SIGKILL)
        said = [line for line in parent.stderr if line.startswith("robot run:")]
    assert parent.returncode == 3
    assert said == ["robot run: the body's process has ended, with exit code -9: there is no robot any more\n"]
