"""Launch tests: files with tests that run beside a launch and after its end, by `launch_tests` and in pytest."""

from __future__ import annotations

import re
import unittest
from pathlib import Path
from textwrap import dedent
from typing import Any

import pytest

from actors.launch import LaunchError
from actors.launch.events import ProcessExited, ProcessStarted, ProcessStderr, ProcessStdout
from actors.launch.testing import Outcome, launch_tests
from actors.launch.testing.asserts import (
    SequentialTextChecker,
    assert_default_stream,
    assert_exit_codes,
    assert_in_stderr,
    assert_in_stdout,
    assert_in_stream,
)
from actors.launch.testing.marks import ReadyAggregator, retry_on_failure
from actors.launch.testing.matching import (
    NO_CMD_ARGS,
    NoMatchingProcessException,
    build_text_match,
    resolve_processes,
)
from actors.launch.testing.records import IoHandler, ProcInfoHandler
from actors.launch.testing.tools import basic_output_filter, expect_output
from tests.actors.launch.files import written

pytest_plugins = ["pytester"]

BEGIN = """
import sys
import unittest
import launch_testing
import launch_testing.markers
import pytest
from launch import LaunchDescription
from launch.actions import *
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node
from launch_testing.actions import ReadyToTest
from launch_testing.asserts import *
from launch_testing.event_handlers import StdoutReadyListener
from launch_testing.tools import expect_output, launch_process
from launch_testing.util import KeepAliveProc

def program(text, **options):
    return ExecuteProcess(cmd=[sys.executable, '-u', '-c', text], **options)

SERVER = '''
import signal, sys
signal.signal(signal.SIGINT, lambda *_: (print("bye"), sys.exit(0)))
print("up", *sys.argv[1:]); print("warned", file=sys.stderr); signal.pause()
'''
"""
WHOLE = """
@pytest.mark.launch_test
def generate_test_description():
    server = program(SERVER, name='server')
    brief = program('print(1); raise SystemExit(3)', name='brief')
    return LaunchDescription([server, brief, ReadyToTest()]), {'server': server, 'number': 4}

class TestActive(unittest.TestCase):
    @classmethod
    def setUpClass(cls, number):
        cls.given = number

    def setUp(self, proc_output):
        proc_output.assertWaitFor('up', process='server', stream='stdout')

    def test_output(self, proc_output, proc_info, server):
        proc_info.assertWaitForStartup(server)
        proc_output.assertWaitFor('warned', process=server)
        self.assertEqual(self.given, 4)

    def test_end(self, proc_info):
        proc_info.assertWaitForShutdown('brief')

    def test_more(self, launch_service, proc_info, proc_output):
        with launch_process(launch_service, program(SERVER, name='third'), proc_info, proc_output) as third:
            self.assertTrue(third.wait_for_output(lambda text: 'warned' in text and 'up' in text, timeout=30))
            self.assertTrue(third.running)
            self.assertEqual((third.stdout, third.stderr), ('up\\n', 'warned\\n'))
        self.assertTrue(third.wait_for_shutdown(timeout=30))
        self.assertEqual((third.exit_code, third.running), (0, False))
        with launch_process(launch_service, program('print(2)'), proc_info, proc_output, output_filter=str.split) as fourth:
            self.assertTrue(fourth.wait_for_output(timeout=30))
            self.assertTrue(fourth.wait_for_shutdown(timeout=30))
        self.assertEqual(fourth.output, ['2'])

@launch_testing.post_shutdown_test()
class TestAfterwards(unittest.TestCase):
    def test_codes(self, proc_info, server):
        assertExitCodes(proc_info, process=server)
        assertExitCodes(proc_info, [3], process='brief')
        assertExitCodes(proc_info, [0, 3])
        self.assertEqual(sorted(proc_info.process_names()), ['brief-2', 'python-4', 'server-1', 'third-3'])

    def test_sequence(self, proc_output, server):
        with assertSequentialStdout(proc_output, server) as text:
            text.assertInStdout('up')
            text.assertInStdout('bye')
"""


def outcome(folder: Path, text: str, arguments: dict[str, str] | None = None) -> Outcome:
    (test,) = launch_tests(written(folder, "some_launch_test.py", BEGIN + dedent(text)))
    return test.run(arguments)


def test_tests_run_beside_the_launch_and_after_its_end_and_are_given_what_they_ask_for(tmp_path: Path) -> None:
    assert outcome(tmp_path, WHOLE) == Outcome(5)


def test_what_fails_is_named_with_what_it_raised(tmp_path: Path) -> None:
    found = outcome(
        tmp_path,
        """
        def generate_test_description():
            return LaunchDescription([program(SERVER, name='server'), ReadyToTest()])

        class TestActive(unittest.TestCase):
            def test_output(self):
                self.proc_output.assertWaitFor('down', timeout=0.2, stream='stdout')

            def test_startup(self, proc_info):
                proc_info.assertWaitForStartup('client', timeout=0.2)

            def test_shutdown(self, proc_info):
                proc_info.assertWaitForShutdown('server', timeout=0.2)

            @unittest.expectedFailure
            def test_surprise(self):
                pass

        @launch_testing.post_shutdown_test()
        class TestAfterwards(unittest.TestCase):
            def test_codes(self, proc_info):
                assertExitCodes(proc_info, [5])
        """,
    )

    texts = {name.rpartition(".")[2]: text.strip().splitlines() for name, text in found.failures}
    assert found.tests == 5
    assert texts["test_output"][-3:] == [
        "AssertionError: 'down' was not written in time; what was:",
        *sorted(["[server-1] stdout: up", "[server-1] stderr: warned"], key=texts["test_output"].index),
    ]
    assert texts["test_startup"][-1].endswith("the process 'client' did not start; started: server-1")
    assert texts["test_shutdown"][-1].endswith("the process 'server' did not end; started: server-1")
    assert texts["test_codes"][-1] == "AssertionError: server-1 ended with exit code 0, not 5"
    assert texts["test_surprise"] == ["unexpected success"]


def test_what_nodes_of_this_framework_log_counts_as_their_stderr(tmp_path: Path) -> None:
    found = outcome(
        tmp_path,
        """
        def generate_test_description():
            return LaunchDescription([
                Node(package='humanoid_control', executable='planner'), Node(package='humanoid_control', executable='motor_controller'),
                Node(package='humanoid_control', executable='sensor_simulator'), ReadyToTest(),
            ])

        class TestLog(unittest.TestCase):
            def test_log(self, proc_output):
                proc_output.assertWaitFor('[INFO]', process='motor_controller')
                proc_output.assertWaitFor('Received trajectory with 10 waypoints', process='motor_controller', timeout=30)

        @launch_testing.post_shutdown_test()
        class TestCodes(unittest.TestCase):
            def test_codes(self, proc_info):
                assertExitCodes(proc_info)
        """,
    )

    assert found == Outcome(2)


def test_each_row_of_the_parameters_is_a_launch_of_its_own(tmp_path: Path) -> None:
    tests = launch_tests(
        written(
            tmp_path,
            "rows_launch_test.py",
            BEGIN
            + dedent(
                """
                @launch_testing.parametrize('word, number', [('a', 1), ('b', 2)])
                def generate_test_description(word, number):
                    return LaunchDescription([
                        DeclareLaunchArgument('more', default_value='none', description='what else'),
                        ExecuteProcess(cmd=[sys.executable, '-c', SERVER, word, LaunchConfiguration('more')]), ReadyToTest(),
                    ])

                class TestActive(unittest.TestCase):
                    def test_output(self, proc_output, word, number, test_args):
                        proc_output.assertWaitFor(f"up {word} {test_args['more']}", stream='stdout')
                        self.assertEqual(number, {'a': 1, 'b': 2}[word])
                """
            ),
        )
    )

    assert [test.name for test in tests] == ["rows_launch_test.py[a, 1]", "rows_launch_test.py[b, 2]"]
    assert [test.run({"more": "c"}) for test in tests] == [Outcome(1), Outcome(1)]
    assert tests[0].show_arguments().splitlines()[2:] == [
        "    'more':",
        "        what else",
        "        (default: 'none')",
    ]


def test_a_launch_that_ends_before_its_tests_is_a_failure(tmp_path: Path) -> None:
    found = outcome(
        tmp_path,
        """
        def generate_test_description():
            return LaunchDescription([program('print("short")'), ReadyToTest()])

        class TestActive(unittest.TestCase):
            def test_long(self, proc_info):
                proc_info.assertWaitForStartup('nothing', timeout=5)
        """,
    )

    ((name, text),) = found.failures
    assert name == "launch"
    assert text.startswith("The launch ended before its tests were done.")
    assert "short" in text


def test_a_launch_that_is_kept_alive_or_has_a_process_for_that_waits_for_its_tests(tmp_path: Path) -> None:
    body = """
        def generate_test_description():
            return LaunchDescription([program('print("short")'), ReadyToTest()MORE])

        class TestActive(unittest.TestCase):
            def test_end(self, proc_info, proc_output):
                proc_info.assertWaitForShutdown('python-1', timeout=30)
        """
    kept = "\n@launch_testing.markers.keep_alive" + dedent(body).replace("MORE", "")
    beside = dedent(body).replace("MORE", ", KeepAliveProc()")

    assert [outcome(tmp_path, text) for text in (kept, beside)] == [Outcome(1), Outcome(1)]


def test_a_launch_that_is_not_ready_in_time_is_a_failure(tmp_path: Path) -> None:
    found = outcome(
        tmp_path,
        """
        @launch_testing.ready_to_test_action_timeout(0.2)
        def generate_test_description():
            return LaunchDescription([program(SERVER)])
        """,
    )

    assert "it was not ready within 0.2 s" in found.failures[0][1]


def test_a_launch_that_cannot_be_evaluated_is_a_failure(tmp_path: Path) -> None:
    found = outcome(
        tmp_path,
        "def generate_test_description():\n    return LaunchDescription([LogInfo(msg=LaunchConfiguration('none'))])",
    )

    assert found.failures[0][1].startswith("The launch ended before its tests were done. exit code 1")


def test_a_line_on_stdout_can_be_the_sign_that_a_process_is_ready(tmp_path: Path) -> None:
    found = outcome(
        tmp_path,
        """
        def generate_test_description():
            server = program(SERVER)
            listener = StdoutReadyListener(target_action=server, ready_txt='up', actions=[ReadyToTest()])
            return LaunchDescription([RegisterEventHandler(listener), server])

        class TestActive(unittest.TestCase):
            def test_ready(self, proc_output):
                self.assertEqual([line.text for line in proc_output if line.from_stdout], [b'up\\n'])
        """,
    )

    assert found == Outcome(1)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("x = 1", "has no function generate_test_description()"),
        ("def generate_test_description(ready):\n    pass", "takes ready, but parametrize gives nothing"),
        ("def generate_test_description(:", "invalid syntax"),
    ],
)
def test_a_file_that_is_no_launch_test_is_refused(tmp_path: Path, text: str, words: str) -> None:
    with pytest.raises(LaunchError, match=re.escape(words)):
        launch_tests(written(tmp_path, "some_launch_test.py", text))


def test_a_function_that_gives_no_description_is_refused(tmp_path: Path) -> None:
    (test,) = launch_tests(written(tmp_path, "a_test.py", "def generate_test_description():\n    return 4"))

    with pytest.raises(LaunchError, match=r"generate_test_description\(\) returned int 4, no LaunchDescription"):
        test.run()


# -- in pytest ---------------------------------------------------------------------------------------------------------------


def test_pytest_runs_a_marked_file_as_one_test_for_each_launch(pytester: pytest.Pytester) -> None:
    pytester.makepyfile(test_whole=BEGIN + WHOLE)
    pytester.makepyfile(
        test_other=BEGIN
        + dedent(
            """
            @pytest.mark.launch_test
            @launch_testing.parametrize('code', [0, 1])
            def generate_test_description(code):
                if code:
                    raise unittest.SkipTest('not today')
                return LaunchDescription([program(SERVER), ReadyToTest()])

            class TestActive(unittest.TestCase):
                def test_wrong(self):
                    self.fail('as was to be expected')
            """
        )
    )
    pytester.makepyfile(test_plain="def test_plain():\n    '''mark.launch_test'''")
    pytester.makepyfile(test_broken="pytest.mark.launch_test :")

    result = pytester.runpytest_inprocess("-p", "no:cacheprovider", "-rs", "-v", "--continue-on-collection-errors")

    result.assert_outcomes(passed=2, failed=1, skipped=1, errors=1)
    result.stdout.fnmatch_lines(["*AssertionError: as was to be expected*", "SKIPPED*not today*"])


# -- what is asserted --------------------------------------------------------------------------------------------------------


class Started:
    """An action whose process has started."""

    def __init__(self, name: str, *arguments: str) -> None:
        self.process_details = {"name": name, "cmd": [name, *arguments]}


def about(action: Any) -> dict[str, Any]:
    return {"action": action, "name": action.process_details["name"], "cmd": action.process_details["cmd"]}


def written_by(*lines: tuple[Any, str, str]) -> IoHandler:
    found = IoHandler()
    for action, stream, text in lines:
        kind = ProcessStdout if stream == "stdout" else ProcessStderr
        found.append(kind(text=text.encode(), **about(action)))
    return found


def test_a_process_is_meant_by_its_name_and_its_arguments() -> None:
    fast, slow, bare = Started("talker-1", "--fast"), Started("talker-2", "--slow", "-v"), Started("talker-3")
    known = ProcInfoHandler()
    assert_raises(NoMatchingProcessException, "nothing is known", resolve_processes, known)
    for action in (fast, slow, bare):
        known.append(ProcessStarted(**about(action)))

    assert resolve_processes(known) == [fast, slow, bare]
    assert resolve_processes(known, process="talker", cmd_args="--fast") == [fast]
    assert resolve_processes(known, process="talker", cmd_args=["-v", "--slow"]) == [slow]
    assert resolve_processes(known, process="talker", cmd_args=NO_CMD_ARGS) == [bare]
    assert resolve_processes(known, process="talker", strict_proc_matching=False) == [fast, slow, bare]
    assert known["talker-2"].action is known[slow].action is slow
    assert_raises(KeyError, "nobody", known.__getitem__, "nobody")
    assert_raises(LookupError, "several processes have the name 'talker'", resolve_processes, known, process="talker")
    assert_raises(
        NoMatchingProcessException, "there are: talker-1 --fast", resolve_processes, known, process="listener"
    )
    assert_raises(TypeError, "not 3", resolve_processes, known, process=3)


def test_a_process_that_was_never_started_is_named_as_such() -> None:
    from actors.launch.actions.processes import ExecuteProcess

    known = written_by((Started("talker-1"), "stdout", "x"))

    assert_raises(
        NoMatchingProcessException,
        "a process that was not started",
        resolve_processes,
        known,
        process=ExecuteProcess(cmd=["ls"]),
    )


def test_exit_codes_are_those_of_processes_that_have_ended() -> None:
    known, one = ProcInfoHandler(), Started("one-1")
    known.append(ProcessStarted(**about(one)))

    assert_raises(AssertionError, "one-1 has not ended", assert_exit_codes, known)
    known.append(ProcessExited(returncode=2, **about(one)))
    assert_exit_codes(known, [2])
    assert_raises(AssertionError, "one-1 ended with exit code 2, not 0 or 1", assert_exit_codes, known, [0, 1])
    assert_raises(AssertionError, "'2' is no integer", assert_exit_codes, known, ["2"])
    assert [event.returncode for event in known] == [2]


def test_a_text_is_looked_for_in_one_stream_without_its_colours() -> None:
    one = Started("one-1")
    known = written_by((one, "stdout", "a\r\n"), (one, "stdout", "\x1b[31mred\x1b[0m b\n"), (one, "stderr", "c\n"))
    known.track("two-2")

    assert_in_stdout(known, "red b", "one")
    assert_in_stdout(known, ["a\n", re.compile("r.d"), "b"], "one")
    assert_in_stderr(known, "c", None)
    assert_in_stdout(known, "RED", "one", output_filter=str.upper)
    assert_in_stdout(known, "\x1b[31mred", "one", strip_ansi_escape_sequences=False)
    assert_raises(AssertionError, "'c' is not in the stdout of one-1", assert_in_stdout, known, "c", "one")
    assert_raises(AssertionError, "is not in the stdout", assert_in_stdout, known, ["b", "a"], "one")
    assert_raises(ValueError, "not 'both'", assert_in_stream, known, "a", "one", stream="both")
    assert_raises(ValueError, "not 3", build_text_match, [3])
    assert assert_default_stream() == "stderr"
    assert known.process_names() == ["one-1", "two-2"]
    assert known["two-2"] == [] and known.processes() == [one]
    assert IoHandler().tail() == "(nothing)"


def test_texts_in_a_sequence_are_found_behind_each_other() -> None:
    checker = SequentialTextChecker(["one\ntwo\n", "three\nfour\nfive\nsix\nseven\n"])

    checker.assertInText("one")
    checker.assertInStdout("three")
    assert_raises(AssertionError, "'two' not found in sequence after previous match", checker.assertInStdout, "two")
    assert checker.get_nearby_lines() == "one\ntwo\nthree\nfour\nfive\nsix"


def test_the_last_of_several_makes_ready() -> None:
    calls: list[int] = []
    ready = ReadyAggregator(lambda: calls.append(1), 3)

    for _ in range(2):
        ready.ready_fn()
    assert calls == []
    ready.ready_fn()
    ready.ready_fn()

    assert calls == [1]


@pytest.mark.parametrize(("times", "passes"), [(3, True), (2, False)])
def test_a_test_is_tried_again_after_a_failed_assertion(times: int, passes: bool) -> None:
    tries: list[int] = []

    class Case(unittest.TestCase):
        @retry_on_failure(times=times)
        def test_third(self) -> None:
            tries.append(1)
            assert len(tries) == 3

    result = unittest.TestResult()
    Case("test_third").run(result)

    assert (result.wasSuccessful(), len(tries)) == (passes, times)
    assert_raises(ValueError, "at least 1", retry_on_failure, times=0)


def test_output_is_compared_by_text_or_by_lines_anywhere_or_as_a_whole() -> None:
    text = "pid 4\none\ntwo\nthree"

    assert expect_output(text, expected_text="two")
    assert expect_output(lines=["one", "two"], expected_text="one\ntwo", strict=True)
    assert not expect_output(text, expected_text="two", strict=True)
    assert expect_output(text, expected_lines=["one", re.compile("t.o")])
    assert not expect_output(text, expected_lines=["one", "three"])
    assert expect_output("one\n\x1b[1mtwo\x1b[0m", expected_lines=["one", "two"], strict=True)
    assert not expect_output("one\n\x1b[1mtwo\x1b[0m", expected_text="one\ntwo", strip_ansi_escape_sequences=False)
    assert not expect_output(text, expected_lines=["one"], strict=True)
    assert basic_output_filter()(text) == "one\ntwo\nthree"
    assert basic_output_filter(["one"], ["t.*"])(text) == "pid 4\n"
    assert_raises(ValueError, "a text or lines", expect_output, "a", lines=["a"], expected_text="a")


def assert_raises(kind: type[Exception], words: str, function: Any, *arguments: Any, **options: Any) -> None:
    with pytest.raises(kind, match=re.escape(words)):
        function(*arguments, **options)
