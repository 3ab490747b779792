"""Launch files: problems, packages, programs that launch, launch tests."""

from io import StringIO
from pathlib import Path
from tempfile import mkdtemp

from actors.launch import (
    Executable, Launch, LaunchError, Line, NodeTarget, NotDone, Packages, Program, UnknownExecutable, UnknownPackage, run_script,
    starts_itself,
)
from actors.launch.testing import LaunchTest, Outcome, launch_tests
from actors.testing import Rig

# -- the tree

path = Path(mkdtemp()) / "two.launch.xml"
path.write_text("""
<launch>
  <arg name="speed" default="1.5" description="The most that the motor may do, m/s."/>
  <group>
    <push_ros_namespace namespace="left"/>
    <node pkg="control" exec="motor_node" name="motor" respawn="true" respawn_delay="2.0">
      <param name="max_velocity" value="$(var speed)"/>
      <remap from="motor_velocity" to="speed"/>
    </node>
  </group>
  <node pkg="humanoid_control" exec="planner" on_exit="shutdown"/>
  <timer period="5.0"><log message="five seconds later"/></timer>
</launch>
""")

launch = Launch(path, {"speed": "2.5"})
print(launch.show())

assert launch.show() == """\
two.launch.xml (supervisor, one_for_one)
├─ group (supervisor, one_for_one)
│  └─ motor_node-1: control/motor_node as /left/motor (robot.tutorials.motor_controller:MotorController) [permanent: restarted after 2 s]
│     ├─ max_velocity: 2.5
│     └─ motor_velocity -> speed
├─ planner-2: humanoid_control/planner (robot.tutorials.humanoid_lab:Planner) [significant: its end ends the launch]
└─ after 5 s
   └─ log info: five seconds later"""

path.write_text("""<launch>
  <log message="$(var text)" if="$(command 'rm -rf /data')"/>
</launch>""")
looked_at = Launch(path, lenient=True)
assert [type(problem) for problem in looked_at.problems] == [NotDone]
print(looked_at.problems[0])

async def test_the_motor_gets_its_limit(rig: Rig) -> None:
    await rig.start(launch.tree())
    await rig.advance(6.0)
    assert any(record.event == "Max velocity: 2.5" for record in rig.logs)
    assert any(record.event == "five seconds later" for record in rig.logs)

# -- mistakes

path.write_text("""<launch>
  <node pkg="humanoid_control" exec="plannr"/>
</launch>""")
try:
    Launch(path)
except LaunchError as error:
    text, line = str(error), error.line

assert text == (
    f"{path}:2: package 'humanoid_control' has no executable 'plannr'; did you mean 'planner'? "
    "(there are: motor_controller, planner, sensor_simulator)"
)

assert line == Line(str(path), 2)
packages = Packages()
found: Executable = packages.find("humanoid_control", "planner")
match found:
    case NodeTarget():
        assert found.target == "robot.tutorials.humanoid_lab:Planner"
    case Program():
        print(found.path)
for package, executable, kind in (("humanoid_contrl", "planner", UnknownPackage), ("humanoid_control", "plannr", UnknownExecutable)):
    try:
        packages.find(package, executable)
    except kind as unknown:
        print(unknown)
    else:
        raise AssertionError(kind)

# -- programs that launch

program = path.with_name("start.py")
program.write_text("""
import sys
from launch import LaunchDescription, LaunchService
from launch.actions import DeclareLaunchArgument, ExecuteProcess
from launch.substitutions import LaunchConfiguration

service = LaunchService(argv=sys.argv[1:])
service.include_launch_description(LaunchDescription([
    DeclareLaunchArgument("world", default_value="kitchen"),
    ExecuteProcess(cmd=["echo", LaunchConfiguration("world")], output="screen"),
]))
sys.exit(service.run())
""")

assert starts_itself(program) and not starts_itself(path)
assert run_script(program, ["world:=garden"]) == 0

# -- tests of launches

test = path.with_name("echo_launch_test.py")
test.write_text("""
import unittest
import launch_testing
import launch_testing.markers
import pytest
from launch import LaunchDescription
from launch.actions import ExecuteProcess
from launch_testing.actions import ReadyToTest
from launch_testing.asserts import assertExitCodes

@pytest.mark.launch_test
@launch_testing.markers.keep_alive
def generate_test_description():
    echo = ExecuteProcess(cmd=["echo", "hello"])
    return LaunchDescription([echo, ReadyToTest()]), {"echo": echo}

class TestBeside(unittest.TestCase):
    def test_output(self, proc_output, proc_info, echo):
        proc_output.assertWaitFor("hello", process=echo, stream="stdout")
        proc_info.assertWaitForShutdown(echo)

@launch_testing.post_shutdown_test()
class TestAfterwards(unittest.TestCase):
    def test_codes(self, proc_info):
        assertExitCodes(proc_info)
""")

(run_of_it,) = launch_tests(test)
assert isinstance(run_of_it, LaunchTest)
outcome: Outcome = run_of_it.run(report=StringIO())  # else on stderr, as unittest does
assert (outcome.tests, outcome.failures) == (2, ())
