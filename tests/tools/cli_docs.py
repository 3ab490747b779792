"""`python -m tests.tools.cli_docs`: writes the generated parts of the documents: the verbs, the exit codes, and what the doctor says.

It also writes tests/cli/transcript.md: what the commands of ROS 2's tutorials print here, in their order. The nodes run in processes of
their own. What differs from run to run (ids, times, measured figures) is masked when `tests/cli/test_docs.py` compares.
"""

from __future__ import annotations

import os
import re
import signal
import socket
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import NamedTuple

from cli.command import COMMANDS, Exit, added, found
from cli.parsing import actions_of
from cli.verb import Group
from tests.tools import no_arguments

ROOT = Path(__file__).parents[2]
PAGE = ROOT / "docs" / "reference" / "cli.md"
DOCTORS = ROOT / "docs" / "howto" / "nothing-arrives.md"
TRANSCRIPT = ROOT / "tests" / "cli" / "transcript.md"
WIDEST = 14
"""How many lines of an output are shown."""


class Command(NamedTuple):
    """One line that the reader types after `robactor`, and how much of its output is shown."""

    line: str
    interrupted: int = 0
    """Ctrl-C after so many lines; 0: it ends by itself."""


class Scene(NamedTuple):
    """The commands of one tutorial, while these executables run in other terminals."""

    title: str
    running: tuple[str, ...]
    nodes: tuple[str, ...]
    commands: tuple[Command, ...]


SCENES = (
    Scene(
        "battery, sensor data, move to position",
        ("my_first_robot battery_server", "my_first_robot sensor_data_publisher", "my_first_robot move_action_server"),
        ("/battery_service_server", "/sensor_data_publisher", "/move_action_server"),
        (
            Command("interface show my_robot_interfaces/msg/SensorData"),
            Command(
                "service call /get_battery_status my_robot_interfaces/srv/GetBatteryStatus \"{robot_id: 'robot_01'}\""
            ),
            Command("topic list -t"),
            Command("topic info /sensor_data --verbose"),
            Command('topic pub /cmd_vel geometry_msgs/msg/Twist "{linear: {x: 0.5}, angular: {z: 0.3}}"', 5),
            Command("service list -t"),
            Command("service type /get_battery_status"),
            Command("action list -t"),
            Command("action info /move_to_position"),
            Command(
                "action send_goal /move_to_position my_robot_interfaces/action/MoveToPosition "
                '"{target_x: 2.0, target_y: 3.0, target_theta: 0.0}" --feedback'
            ),
            Command("pkg create --build-type ament_cmake my_robot_interfaces --dependencies std_msgs geometry_msgs"),
        ),
    ),
    Scene(
        "temperatures",
        ("communication_demo sensor_simulator", "communication_demo processor"),
        ("/sensor_simulator", "/data_processor"),
        (
            Command(
                "pkg create --build-type ament_python communication_demo --dependencies rclpy std_msgs builtin_interfaces"
            ),
            Command("topic echo"),
        ),
    ),
    Scene(
        "the humanoid lab",
        ("humanoid_control sensor_simulator", "humanoid_control planner", "humanoid_control motor_controller"),
        ("/sensor_simulator", "/planner", "/motor_controller"),
        (
            Command("topic list"),
            Command("service list"),
            Command("topic echo /sensor/data", 9),
            Command("topic echo /motor/commands", 8),
            Command(
                "service call /plan_trajectory humanoid_control_interfaces/srv/PlanTrajectory "
                '"{start: {x: 0.0, y: 0.0, z: 0.0}, goal: {x: 1.0, y: 1.0, z: 0.0}}"'
            ),
            Command("topic hz /sensor/data", 4),
            Command(
                "pkg create --build-type ament_python humanoid_control --dependencies rclpy std_msgs geometry_msgs"
            ),
        ),
    ),
    Scene(
        "parameters",
        ("control motor_node", "my_package my_node --ros-args -r old_topic:=new_topic"),
        ("/motor_controller", "/minimal_node"),
        (
            Command("param set /motor_controller max_velocity 1.5"),
            Command('param set /motor_controller pid_gains "[1.5, 0.2, 0.02]"'),
            Command("param set /motor_controller max_velocity 99.0"),
        ),
    ),
    Scene(
        "services and the arm",
        ("my_robot_pkg service_server", "robot_arm_control position_service", "robot_arm_control move_arm_server"),
        ("/minimal_service", "/position_service", "/move_arm_server"),
        (
            Command("run my_robot_pkg service_client"),
            Command("run robot_arm_control arm_control_client"),
            Command("pkg create --build-type ament_python robot_arm_control"),
        ),
    ),
    Scene(
        "talker, IMU and robot controller",
        ("my_robot_controller imu_publisher", "my_robot_controller robot_controller"),
        ("/imu_publisher", "/robot_controller"),
        (
            Command("node list"),
            Command("node info /robot_controller"),
            Command("topic info /cmd_vel"),
            Command("topic echo /imu/data", 12),
            Command("topic hz /imu/data", 4),
            Command('service call /robot/enable std_srvs/srv/SetBool "{data: true}"'),
            Command("topic pub /voice_command std_msgs/msg/String \"{data: 'forward'}\"", 3),
            Command(
                "pkg create my_robot_controller --build-type ament_python --dependencies rclpy geometry_msgs sensor_msgs"
            ),
        ),
    ),
)


DOCTOR = Scene(
    "A topic that is silent, and a service that does not answer",
    ("my_first_robot battery_server", "my_first_robot sensor_data_publisher", "communication_demo processor"),
    ("/battery_service_server", "/sensor_data_publisher", "/data_processor"),
    (
        Command("doctor topic /temperature --report-failed"),
        Command("doctor service /get_battery_status std_srvs/srv/Trigger --report-failed"),
    ),
)


def main() -> None:
    """Write them."""
    generated = {PAGE: {"verbs": verbs(), "exit codes": codes()}, DOCTORS: {"doctor": transcript([DOCTOR])}}
    for path, parts in generated.items():
        path.write_text(written(path.read_text(encoding="utf-8"), parts), encoding="utf-8")
    TRANSCRIPT.write_text(transcript(), encoding="utf-8")
    print("written: " + ", ".join(path.relative_to(ROOT).as_posix() for path in (*generated, TRANSCRIPT)))


def written(page: str, parts: Mapping[str, str]) -> str:
    """The page with its generated parts."""
    for name, text in parts.items():
        begin, end = f"<!-- {name} -->\n", f"<!-- end of {name} -->"
        before, _, rest = page.partition(begin)
        page = f"{before}{begin}\n{text}\n{end}{rest.partition(end)[2]}"
    return page


def part(page: str, name: str) -> str:
    """One of the generated parts of the page."""
    return page.partition(f"<!-- {name} -->\n\n")[2].partition(f"\n<!-- end of {name} -->")[0]


def verbs() -> str:
    """The table of all verbs, from their parsers; those of a group, with their words, in one row."""
    lines = ["| command | what it does |", "|---|---|"]
    for name in (*(entry.name for entry in added()), *COMMANDS):
        command = found(name)
        assert command is not None
        if not isinstance(command, Group):
            lines.append(f"| `{name}` | {' '.join(command.help.split())} |")
            continue
        words = []
        for verb in command.verbs.values():
            places = [action.dest.upper() for action in actions_of(verb.parser()) if not action.option_strings]
            words.append(f"`{' '.join((verb.name, *places))}`")
        lines.append(f"| `{name}` ... | {', '.join(words)} |")
    return "\n".join(lines) + "\n"


_MEANINGS = {
    "DONE": "done; also `action info` and `topic list` of nothing, and a closed pipe",
    "FAILED": "not possible: no such node, topic or type, no answer in time, a value that does not fit",
    "REFUSED": "refused: `param set`, `delete`, `load`, `lifecycle set`; a goal that is rejected, canceled or aborted",
    "MISUSED": "options or words that are not understood",
    "INTERRUPTED": "Ctrl-C",
    "TERMINATED": "SIGTERM",
    "HUNG_UP": "SIGHUP: the terminal was closed",
}


def codes() -> str:
    """The table of exit codes."""
    lines = ["| how it ended | exit code | with `--ros2-exit-codes` |", "|---|---|---|"]
    lines += [f"| {_MEANINGS[each.name]} | {each.value[0]} | {each.value[1]} |" for each in Exit]
    return "\n".join(lines) + "\n"


# -- the terminal ------------------------------------------------------------------------------------------------------------


def transcript(scenes: Sequence[Scene] = SCENES) -> str:
    """What the commands print. Takes about a minute."""
    return "\n".join(_scene(scene) for scene in scenes)


def _scene(scene: Scene) -> str:
    lines = [f"### {scene.title}", "", "```text"]
    lines += [f"(another terminal) $ robactor run {words}" for words in scene.running]
    with tempfile.TemporaryDirectory() as folder, running(scene) as environment:
        for command in scene.commands:
            lines += ["", f"$ robactor {command.line}", *_output(command, environment, folder)]
    return "\n".join((*lines, "```", ""))


@contextmanager
def running(scene: Scene) -> Iterator[dict[str, str]]:
    """Its nodes run, and are found; the environment for the commands."""
    with socket.socket() as one:
        one.bind(("127.0.0.1", 0))
        port = str(one.getsockname()[1])
    own = {"ROBACTOR_GOSSIP_PORT": port, "ROS_DOMAIN_ID": "11", "RMW_IMPLEMENTATION": "", "PYTHONPATH": str(ROOT)}
    environment = {**os.environ, **own, "AMENT_PREFIX_PATH": "", "COLUMNS": "100"}
    with ExitStack() as stack:
        for words in scene.running:
            process = subprocess.Popen([*ROBACTOR, "run", *words.split()], env=environment, stdout=-3)
            stack.callback(process.wait)
            stack.callback(process.terminate)
        end = time.monotonic() + 60
        while not set(scene.nodes) <= set(_said("node list", environment).split()):
            if time.monotonic() > end:
                raise TimeoutError(f"the nodes of {scene.title} are not there")
        yield environment


ROBACTOR = (sys.executable, "-m", "robot")


def _said(line: str, environment: dict[str, str]) -> str:
    return subprocess.run([*ROBACTOR, *line.split()], env=environment, stdout=-1, check=True, text=True).stdout


def _output(command: Command, environment: dict[str, str], folder: str) -> list[str]:
    import shlex

    words = [*ROBACTOR, *shlex.split(command.line)]
    process = subprocess.Popen(words, env=environment, cwd=folder, stdout=-1, stderr=-2, text=True)
    assert process.stdout is not None
    if command.interrupted:
        lines = [process.stdout.readline() for _ in range(command.interrupted)]
        process.send_signal(signal.SIGINT)
        process.communicate(timeout=30)
        return [*(line.rstrip("\n") for line in lines), "^C"]
    out = process.communicate(timeout=120)[0].replace(folder, "~").rstrip("\n")
    lines = [_anonymous(line) for line in out.split("\n")]
    if len(lines) > WIDEST + 6:
        lines = [*lines[:WIDEST], "...", *lines[-6:]]
    return lines if process.returncode == 0 else [*lines, f"(exit code {process.returncode})"]


def _anonymous(line: str) -> str:
    """Without the name of whoever generates the page."""
    return "maintainer: ['you <you@todo.todo>']" if line.startswith("maintainer: ") else line[:160]


_VARYING = re.compile(r"\b[0-9a-f]{32}\b|([0-9a-f]{2}\.){15}[0-9a-f]{2}|-?\d+(\.\d+)?(e-?\d+)?")


def masked(terminal: str) -> list[str]:
    """The lines of a transcript without what differs from run to run: in streams, ids and logs, every number."""
    lines: list[str] = []
    streaming = False
    for line in terminal.splitlines():
        if line.startswith("$ "):
            streaming = any(word in line for word in (" echo ", " hz ", " send_goal ", " run ", " doctor "))
        varies = streaming or "stamp=" in line or line.startswith(("GID: ", "Goal accepted"))
        lines.append(_VARYING.sub("N", line) if varies and not line.startswith("$ ") else line)
    return [re.sub(r"\s+", " ", line) for line in lines]


if __name__ == "__main__":
    no_arguments(__doc__)
    main()
