"""`launch.LaunchService`: programs that launch by themselves. Processes and nodes really run; no figure of the clock is looked at."""

from __future__ import annotations

import sys
import threading
from pathlib import Path

import pytest

from actors.launch import run_script, starts_itself
from tests.actors.launch.files import written

BEGIN = """
import sys
from launch import LaunchDescription, LaunchService
from launch.actions import *
from launch.event_handlers import *
from launch.events import Shutdown as ShutdownEvent
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node
"""
STEADY = (
    "ExecuteProcess(cmd=[sys.executable, '-c', 'import time; print(1, flush=True); time.sleep(60)'], output='screen')"
)


def ran(tmp_path: Path, text: str, *words: str) -> int:
    return run_script(written(tmp_path, "program.py", BEGIN + text), words)


def test_a_program_runs_its_description_with_its_arguments_and_gets_the_exit_code(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    code = ran(
        tmp_path,
        """
        description = LaunchDescription([
            DeclareLaunchArgument('word', default_value='nothing'),
            ExecuteProcess(cmd=['echo', LaunchConfiguration('word')], output='screen'),
        ])
        service = LaunchService(argv=sys.argv[1:])
        service.include_launch_description(description)
        sys.exit(service.run() + 40)
        """.replace("        ", "", 1).replace("\n        ", "\n"),
        "word:=hello",
        "--other",
    )

    assert code == 40
    assert "[echo-1] hello" in capfd.readouterr().out.splitlines()


def test_a_description_that_cannot_be_evaluated_is_told_and_counts_as_failed(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    code = ran(
        tmp_path,
        "service = LaunchService()\n"
        "service.include_launch_description(LaunchDescription([LogInfo(msg=LaunchConfiguration('none'))]))\n"
        "sys.exit(service.run())",
    )

    assert code == 1
    assert "launch configuration 'none' does not exist" in capfd.readouterr().err


def test_the_service_stays_until_it_is_shut_down_and_takes_more_from_other_threads(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    code = ran(
        tmp_path,
        """
import threading
done = threading.Event()
service = LaunchService()
service.include_launch_description(LaunchDescription([
    RegisterEventHandler(OnProcessExit(on_exit=lambda event, context: done.set())),
    RegisterEventHandler(OnShutdown(on_shutdown=lambda event, context: LogInfo(msg='because ' + event.reason))),
]))

def more():
    service.include_launch_description(LaunchDescription([ExecuteProcess(cmd=['echo', 'late'], output='screen')]))
    done.wait(30)
    service.emit_event(ShutdownEvent(reason='all is done'))

threading.Thread(target=more).start()
sys.exit(service.run(shutdown_when_idle=False))
""",
    )

    out = capfd.readouterr().out
    assert code == 0
    assert "[echo-1] late" in out.splitlines()
    assert "because all is done" in out


def test_what_is_asked_before_the_launch_runs_waits_for_it_and_afterwards_does_nothing(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    code = ran(
        tmp_path,
        f"""
service = LaunchService()
service.include_launch_description(LaunchDescription([{STEADY}]))
service.shutdown()
code = service.run()
service.shutdown()
service.include_launch_description(LaunchDescription([]))
try:
    service.run()
except RuntimeError as error:
    print('again:', error)
sys.exit(code)
""",
    )

    out = capfd.readouterr().out
    assert code == 0
    assert "again: this LaunchService has run: make another one" in out
    assert "LaunchService.shutdown() called" in out


def test_a_service_runs_in_an_event_loop_that_is_there(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    code = ran(
        tmp_path,
        """
import asyncio
async def main():
    service = LaunchService(debug=True)
    service.include_launch_description(LaunchDescription([LogDebug(msg='deep inside')]))
    return await service.run_async()
sys.exit(asyncio.run(main()))
""",
    )

    assert code == 0
    assert "deep inside" in capfd.readouterr().out


def test_every_process_that_a_shutdown_ends_is_told_to_the_handlers_with_its_exit_code(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    code = ran(
        tmp_path,
        """
program = 'import signal, sys; signal.signal(signal.SIGINT, lambda *_: sys.exit(CODE)); print("up", flush=True); signal.pause()'
first, second = (ExecuteProcess(cmd=[sys.executable, '-c', program.replace('CODE', code)], name=name) for name, code in (('one', '0'), ('two', '7')))
up = []
service = LaunchService()
service.include_launch_description(LaunchDescription([
    RegisterEventHandler(OnProcessExit(on_exit=lambda event, context: print('ended', event.process_name, event.returncode))),
    RegisterEventHandler(OnProcessIO(on_stdout=lambda event: up.append(1) or (len(up) == 2 and [Shutdown(reason='both')]) or None)),
    first, second,
]))
service.run()
print(first.process_details['name'], second.process_details['cmd'][0] == sys.executable, second.process_details['pid'] > 0)
""",
    )

    lines = capfd.readouterr().out.splitlines()
    assert code == 0
    assert [line for line in lines if line.startswith("ended")] == ["ended two-2 7", "ended one-1 0"]
    assert any("[two-2] process has finished" in line and "exit code 7" in line for line in lines)
    assert lines[-1] == "one-1 True True"


@pytest.mark.parametrize(
    ("end", "code", "words"),
    [("sys.exit()", 0, ""), ("sys.exit('no way')", 1, "no way"), ("pass", 0, ""), ("sys.exit(3)", 3, "")],
)
def test_a_program_ends_as_it_would_by_itself(
    tmp_path: Path, capfd: pytest.CaptureFixture[str], end: str, code: int, words: str
) -> None:
    before = list(sys.argv)

    assert ran(tmp_path, end) == code
    assert words in capfd.readouterr().err
    assert sys.argv == before
    assert "launch" not in sys.modules


@pytest.mark.parametrize(
    ("name", "text", "itself"),
    [
        ("a.py", "from launch import LaunchService\nLaunchService().run()", True),
        ("b.py", "from launch import LaunchService\ndef generate_launch_description(): ...", False),
        ("c.py", "print(1)", False),
        ("d.xml", "LaunchService", False),
    ],
)
def test_a_program_is_known_by_its_service_and_the_lack_of_a_description(
    tmp_path: Path, name: str, text: str, itself: bool
) -> None:
    assert starts_itself(written(tmp_path, name, text)) is itself


def test_a_service_can_run_beside_the_main_thread(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    path = written(tmp_path, "program.py", BEGIN + "service = LaunchService()\nsys.exit(service.run())")
    codes: list[int] = []

    thread = threading.Thread(target=lambda: codes.append(run_script(path)))
    thread.start()
    thread.join(30)

    assert codes == [0]


TESTS = """
from launch_testing.legacy import LaunchTestService
description, tests = LaunchDescription(), LaunchTestService()
process = lambda code, seconds=0: ExecuteProcess(cmd=['sh', '-c', f'sleep {seconds}; exit {code}'])
for kind, allowed, *action in ACTIONS:
    if kind == 'fixture':
        tests.add_fixture_action(description, process(*action), allowed)
    else:
        tests.add_test_action(description, process(*action) if action else LogInfo(msg='x'))
service = LaunchService()
service.include_launch_description(description)
sys.exit(tests.run(service))
"""


@pytest.mark.parametrize(
    ("actions", "code"),
    [
        ([("test", 0, 0), ("test", 0, 0, 0.1), ("fixture", [0], 0, 60)], 0),
        ([("test", 0, 3), ("test", 0, 0, 60)], 3),
        ([("test", 0, 0, 60), ("fixture", [0], 0), ("fixture", [0], 4)], 4),
        ([("test", 0, 0, 60), ("fixture", False, 0)], 1),
        ([("test", 0, 0), ("fixture", True, 5)], 0),
    ],
)
def test_the_legacy_test_service_gives_the_code_of_the_first_that_fails(
    tmp_path: Path, actions: list[tuple[object, ...]], code: int
) -> None:
    assert ran(tmp_path, TESTS.replace("ACTIONS", repr(actions))) == code


def test_a_test_action_without_a_process_passes_when_it_is_complete(tmp_path: Path) -> None:
    text = TESTS.replace("ACTIONS", "[('fixture', [0], 0, 60)]").replace(
        "service = Launch",
        "tests.add_fixture_action(description, LogInfo(msg='x'))\n"
        "tests.add_test_action(description, TimerAction(period=0.1, actions=[]))\nservice = Launch",
    )

    assert ran(tmp_path, text) == 0
