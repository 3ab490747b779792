"""A launch that runs, on the virtual clock: its nodes, its timers, its handlers, and how it ends."""

from __future__ import annotations

from itertools import permutations
from pathlib import Path
from typing import Any

import pytest

from actors import Node, Stop, Supervisor, Topic, every, qos
from actors.interfaces.sensor_msgs.msg import Image
from actors.launch import Packages
from actors.launch.packages import NodeTarget
from actors.testing import Rig
from tests.actors.launch.files import launch, python, written, xml

LEFT = "tests.actors.launch.test_service"


class Steady(Node):
    """Runs until it is stopped."""


class Brief(Node):
    """Ends in order after a second."""

    @every(period=1.0)
    def end(self) -> None:
        self.stop("its work is done")


class Failing(Node):
    """Fails after a second."""

    @every(period=1.0)
    def fail(self) -> None:
        raise ValueError("broken")


class Stillborn(Node):
    """Does not start."""

    async def on_start(self) -> None:
        raise ValueError("no device")


class Declining(Node):
    """Declines to start."""

    async def on_start(self) -> None:
        from actors import Skip

        raise Skip("not needed")


class Ending(Node):
    """Asks to stop in its start phase."""

    async def on_start(self) -> None:
        raise Stop("at once")


def fleet() -> Supervisor:
    """An executable with supervisors of its own."""
    from actors import Child, DynamicSupervisor

    drones = DynamicSupervisor("drones", Child(Node, name="drone"))
    return Supervisor("fleet", children=[Supervisor("wing", children=[Child(Steady), Child(Brief)]), drones])


def pair() -> Supervisor:
    """An executable of two nodes."""
    from actors import Child

    return Supervisor("pair", children=[Child(Steady), Child(Brief)])


class Here(Packages):
    """One package more, ``here``, whose executables are the nodes of this module."""

    def executables(self, package: str) -> Any:
        if package != "here":
            return super().executables(package)
        names = ("Steady", "Brief", "Failing", "Stillborn", "Declining", "Ending", "pair", "fleet", "nothing")
        return {name.lower(): NodeTarget("here", name.lower(), f"{LEFT}:{name}") for name in names}


async def started(rig: Rig, path: Path, arguments: dict[str, str] | None = None, **options: Any) -> list[str]:
    """Run a launch file in the rig. Returns the list into which the output of processes goes."""
    lines: list[str] = []
    found = launch(path, arguments, packages=Here(environment={}), **options)
    await rig.start(found.tree(lines.append))
    await rig.quiet()
    return lines


def said(rig: Rig, node: str = "/launch") -> list[str]:
    return [record.event for record in rig.logs if record.node == node]


def names(rig: Rig) -> list[str]:
    return sorted(
        record.identity.fqn
        for record in rig.system.nodes.values()
        if record.running is not None and record.identity.fqn != "/rig"
    )


@pytest.mark.parametrize("order", [*permutations(("motor_controller", "planner", "sensor_simulator"))])
async def test_the_lab_of_the_tutorial_is_launched_in_any_order(
    rig: Rig, tmp_path: Path, order: tuple[str, ...]
) -> None:
    path = xml(
        tmp_path,
        "".join(f'<node pkg="humanoid_control" exec="{one}"/>' for one in order),
    )

    await started(rig, path)
    await rig.advance(5.0)

    assert names(rig) == ["/launch", "/motor_controller", "/planner", "/sensor_simulator"]
    assert "Received trajectory with 10 waypoints" in said(rig, "/motor_controller")


async def test_the_camera_of_the_tutorials_launch_file_publishes_where_it_was_remapped_to(rig: Rig) -> None:
    await started(rig, Packages(environment={}).file("camera_driver", "camera.launch.xml"))
    moved, original = (
        rig.probe(Topic(Image, name, qos.SENSOR_DATA)) for name in ("/perception/camera/rgb", "/camera/image")
    )

    await rig.advance(1.0)

    assert names(rig) == ["/camera", "/launch"]
    assert len(moved) > 0
    assert len(original) == 0


async def test_names_namespaces_parameters_and_remappings_reach_the_nodes(rig: Rig, tmp_path: Path) -> None:
    file = written(
        tmp_path,
        "p.yaml",
        "/**: {ros__parameters: {max_velocity: 2.5}}\n/right/*: {ros__parameters: {max_velocity: 3.5}}",
    )
    path = xml(
        tmp_path,
        f"""
        <group>
          <push_ros_namespace namespace="left"/>
          <set_remap from="motor_velocity" to="speed"/>
          <node pkg="control" exec="motor_node" name="motor"><param from="{file}"/></node>
        </group>
        <node pkg="control" exec="motor_node" namespace="right" ros_args="-r motor_velocity:=fast"><param from="{file}"/></node>
        """,
    )

    await started(rig, path)

    assert names(rig) == ["/launch", "/left/motor", "/right/motor_controller"]
    assert "Max velocity: 2.5" in said(rig, "/left/motor")
    assert "Max velocity: 3.5" in said(rig, "/right/motor_controller")
    assert {"/left/speed", "/right/fast"} <= set(rig.system.graph.topics)


async def test_parameters_that_a_node_does_not_have_are_left_out_with_a_warning(rig: Rig, tmp_path: Path) -> None:
    path = xml(
        tmp_path,
        """
        <node pkg="control" exec="motor_node"><param name="max_velocty" value="1.0"/><param name="use_sim_time" value="false"/></node>
        <node pkg="here" exec="steady"><param name="zzz" value="1"/></node>
        """,
    )

    await started(rig, path)

    assert "/motor_controller has no parameter 'max_velocty'; did you mean 'max_velocity'?" in said(rig)
    assert "/steady has no parameter 'zzz'; it is left out" in said(rig)


async def test_the_launch_ends_when_nothing_is_left(rig: Rig, tmp_path: Path) -> None:
    path = xml(
        tmp_path,
        '<node pkg="here" exec="brief"/><timer period="3"><log message="last"/></timer><group><log message="first"/></group>',
    )

    await started(rig, path)
    await rig.advance(2.0)
    assert rig.system.running
    await rig.advance(1.0)

    assert not rig.system.running
    assert said(rig) == ["first", "[brief-1] process started", "[brief-1] process has finished cleanly", "last"]


async def test_a_file_that_is_called_launch_runs_like_any_other(rig: Rig, tmp_path: Path) -> None:
    await started(rig, xml(tmp_path, '<node pkg="here" exec="steady"/>', "launch.xml"))

    assert names(rig) == ["/launch", "/steady"]


async def test_an_empty_launch_ends_at_once(rig: Rig, tmp_path: Path) -> None:
    await started(rig, xml(tmp_path, ""))

    assert not rig.system.running


async def test_a_node_that_fails_is_told_and_the_others_go_on(rig: Rig, tmp_path: Path) -> None:
    rig.expect_failure()
    path = python(
        tmp_path,
        """
        Node(package='here', executable='failing', on_exit=[LogInfo(msg=['gone with ', LocalSubstitution('event.returncode')])]),
        Node(package='here', executable='steady'),
        """,
    )

    await started(rig, path)
    await rig.advance(2.0)

    assert names(rig) == ["/launch", "/steady"]
    assert "[failing-1] process has died: ValueError: broken" in said(rig)
    assert "gone with 1" in said(rig)


async def test_a_node_that_does_not_start_counts_as_one_that_died(rig: Rig, tmp_path: Path) -> None:
    rig.expect_failure()
    path = python(
        tmp_path,
        "Node(package='here', executable='stillborn', on_exit=lambda event, context: LogInfo(msg=f'{event.process_name} {event.returncode}')), "
        "Node(package='here', executable='nothing'), Node(package='here', executable='declining'), Node(package='here', executable='steady')",
    )

    await started(rig, path)

    assert names(rig) == ["/launch", "/steady"]
    assert "[stillborn-1] process has died: ValueError: no device" in said(rig)
    assert "stillborn-1 1" in said(rig)
    assert any("has nothing of the name 'nothing'" in line for line in said(rig))


async def test_a_node_that_is_respawned_comes_back_after_its_delay_however_it_ended(rig: Rig, tmp_path: Path) -> None:
    path = python(
        tmp_path,
        """
        RegisterEventHandler(OnProcessStart(on_start=lambda event, context: LogInfo(msg='start'))),
        RegisterEventHandler(OnProcessExit(on_exit=lambda event, context: LogInfo(msg=f'exit {event.returncode}'))),
        Node(package='here', executable='brief', respawn=True, respawn_delay=2.0),
        """,
    )

    await started(rig, path)
    await rig.advance(2.5)
    assert names(rig) == ["/launch"]
    await rig.advance(1.0)

    assert names(rig) == ["/brief", "/launch"]
    assert [line for line in said(rig) if line.startswith(("start", "exit"))] == ["start", "exit 0", "start"]


async def test_a_node_is_respawned_at_most_as_often_as_it_is_told(rig: Rig, tmp_path: Path) -> None:
    rig.expect_failure()
    path = python(
        tmp_path,
        "Node(package='here', executable='failing', respawn=True, respawn_max_retries=2), Node(package='here', executable='steady')",
    )

    await started(rig, path)
    await rig.advance(10.0)

    assert said(rig).count("[failing-1] process has died: ValueError: broken") == 3
    assert names(rig) == ["/launch", "/steady"]


async def test_a_node_that_does_not_start_is_tried_again_as_often_as_it_is_respawned(rig: Rig, tmp_path: Path) -> None:
    rig.expect_failure()
    path = python(
        tmp_path,
        "Node(package='here', executable='stillborn', respawn=True, respawn_delay=1.0, respawn_max_retries=2), "
        "Node(package='here', executable='steady')",
    )

    await started(rig, path)
    await rig.advance(10.0)

    assert said(rig).count("[stillborn-1] process has died: ValueError: no device") == 3


async def test_the_end_of_a_required_node_ends_the_launch_in_order(rig: Rig, tmp_path: Path) -> None:
    path = python(
        tmp_path,
        """
        GroupAction([Node(package='here', executable='brief', on_exit=Shutdown(reason='required'))]),
        Node(package='here', executable='steady'),
        RegisterEventHandler(OnShutdown(on_shutdown=[LogInfo(msg='bye'), Node(package='here', executable='steady')])),
        """,
    )

    await started(rig, path)
    await rig.advance(2.0)

    assert not rig.system.running
    assert "bye" in said(rig)
    assert "the launch is ending: nothing is started any more" in said(rig)


async def test_actions_beside_a_shutdown_are_done_before_it(rig: Rig, tmp_path: Path) -> None:
    path = python(
        tmp_path,
        """
        Node(package='here', executable='brief', on_exit=[LogInfo(msg='over'), Shutdown(reason='done')]),
        Node(package='here', executable='steady'),
        RegisterEventHandler(OnShutdown(on_shutdown=lambda event, context: [LogInfo(msg='because ' + event.reason)])),
        """,
    )

    await started(rig, path)
    await rig.advance(2.0)

    assert not rig.system.running
    assert said(rig)[-3:] == ["over", "because done", "[steady-2] process has finished cleanly"]


async def test_an_executable_of_several_nodes_lives_and_dies_as_one(rig: Rig, tmp_path: Path) -> None:
    path = xml(tmp_path, '<node pkg="here" exec="pair" name="both" namespace="a"/><node pkg="here" exec="steady"/>')

    await started(rig, path)
    assert names(rig) == ["/a/brief", "/a/steady", "/launch", "/steady"]
    assert "pair-1: its 2 nodes keep their names; only a single one can be called 'both'" in said(rig)
    await rig.advance(1.5)

    assert names(rig) == ["/launch", "/steady"]


async def test_handlers_answer_the_events_of_their_target_the_newest_first(rig: Rig, tmp_path: Path) -> None:
    path = python(
        tmp_path,
        """
        RegisterEventHandler(OnProcessStart(target_action=one, on_start=[LogInfo(msg='first')])),
        RegisterEventHandler(OnProcessStart(target_action=one, on_start=[LogInfo(msg='second'), late])),
        RegisterEventHandler(OnProcessStart(target_action=lambda action: action is other, on_start=LogInfo(msg='other'))),
        RegisterEventHandler(gone), UnregisterEventHandler(gone),
        RegisterEventHandler(OnExecutionComplete(target_action=timer, on_completion=[LogInfo(msg='timer done')])),
        RegisterEventHandler(OnProcessExit(on_exit=broken)),
        RegisterEventHandler(OnProcessExit(on_exit=LogInfo(msg='once'), handle_once=True)),
        one, other, timer,
        """,
        before="""
        one = Node(package='here', executable='brief', name='one')
        other = Node(package='here', executable='brief', name='other')
        late = GroupAction([Node(package='here', executable='steady', name='late')])
        gone = OnProcessStart(on_start=[LogInfo(msg='never')])
        timer = TimerAction(period=0.5, actions=[LogInfo(msg='tick')])
        def broken(event, context):
            raise RuntimeError('bad handler')
        """,
    )

    await started(rig, path)
    await rig.advance(2.0)

    lines = [line for line in said(rig) if not line.startswith("[")]
    assert lines[:5] == ["second", "first", "other", "tick", "timer done"]
    assert "/late" in names(rig)
    assert lines.count("once") == 1
    assert sum("RuntimeError: bad handler" in line for line in lines) == 2


async def test_events_end_executables_and_include_descriptions(rig: Rig, tmp_path: Path) -> None:
    path = python(
        tmp_path,
        """
        one, other, third, Node(package='here', executable='steady', name='last'),
        TimerAction(period=1.0, actions=[EmitEvent(event=ShutdownProcess(process_matcher=matches_action(one)))]),
        TimerAction(period=2.0, actions=[EmitEvent(event=SignalProcess(signal_number=2, process_matcher=matches_name('box')))]),
        TimerAction(period=2.0, actions=[EmitEvent(event=ShutdownProcess(process_matcher=matches_executable('nothing')))]),
        TimerAction(period=2.0, actions=[EmitEvent(event=ShutdownProcess(process_matcher=matches_pid(1)))]),
        TimerAction(period=3.0, actions=[EmitEvent(event=IncludeLaunchDescription(LaunchDescription([LogInfo(msg='included')])))]),
        RegisterEventHandler(OnIncludeLaunchDescription(entities=[LogInfo(msg='seen')])),
        RegisterEventHandler(EventHandler(matcher=event_named('my.Event'), entities=[LogInfo(msg='mine')])),
        EmitEvent(event=Mine()),
        """,
        before="""
        from launch.events import IncludeLaunchDescription
        from launch.events.process import *
        one = Node(package='here', executable='steady', name='one')
        other = Node(package='here', executable='steady', exec_name='box', name='other')
        third = Node(package='here', executable='steady', name='third')
        class Mine(Event):
            name = 'my.Event'
        """,
    )

    await started(rig, path)
    await rig.advance(1.5)
    assert names(rig) == ["/last", "/launch", "/other", "/third"]
    await rig.advance(2.0)

    assert names(rig) == ["/last", "/launch", "/third"]
    assert "mine" in said(rig) and "included" in said(rig) and "seen" in said(rig)


async def test_what_a_handler_emits_comes_after_its_event_has_been_shown_to_all_handlers(
    rig: Rig, tmp_path: Path
) -> None:
    path = python(
        tmp_path,
        """
        RegisterEventHandler(EventHandler(matcher=event_named('second'), entities=[LogInfo(msg='second, asked last')])),
        RegisterEventHandler(EventHandler(matcher=event_named('first'), entities=[LogInfo(msg='first, asked last')])),
        RegisterEventHandler(EventHandler(matcher=event_named('first'), entities=[EmitEvent(event=Second())])),
        EmitEvent(event=First()),
        """,
        before="""
        class First(Event):
            name = 'first'
        class Second(Event):
            name = 'second'
        """,
    )

    await started(rig, path)

    assert [line for line in said(rig) if "asked last" in line] == ["first, asked last", "second, asked last"]


async def test_what_is_wrong_in_a_late_action_is_logged_and_the_launch_goes_on(rig: Rig, tmp_path: Path) -> None:
    path = python(
        tmp_path,
        "TimerAction(period=1.0, actions=[LogInfo(msg=LaunchConfiguration('none'))]), Node(package='here', executable='steady')",
    )

    await started(rig, path)
    await rig.advance(2.0)

    assert any("launch configuration 'none' does not exist" in line for line in said(rig))
    assert names(rig) == ["/launch", "/steady"]


async def test_a_timer_keeps_what_was_set_where_it_stands(rig: Rig, tmp_path: Path) -> None:
    path = xml(
        tmp_path,
        """
        <group><push_ros_namespace namespace="left"/><timer period="1"><node pkg="here" exec="steady"/></timer></group>
        <node pkg="here" exec="steady"/>
        """,
    )

    await started(rig, path)
    await rig.advance(1.5)

    assert names(rig) == ["/launch", "/left/steady", "/steady"]


async def test_a_node_that_is_not_here_is_stood_in_for(rig: Rig, tmp_path: Path) -> None:
    path = xml(
        tmp_path,
        '<node pkg="nav9" exec="planner" name="p"><param name="any" value="1"/></node><node pkg="nav9" exec="a-b"/><node exec="/no/such/program"/>',
    )

    await started(rig, path, stand_ins=True)

    assert names(rig) == ["/a_b_2", "/launch", "/p", "/program_3"]


async def test_a_program_is_refused_on_the_virtual_clock(rig: Rig, tmp_path: Path) -> None:
    rig.expect_failure()

    await started(rig, xml(tmp_path, '<executable cmd="ls"/><node pkg="here" exec="steady"/>'))

    assert "[ls-1] process has died: RuntimeError: ls is a program of its own, which lives in real time only" in said(
        rig
    )


async def test_ready_to_test_is_told(rig: Rig, tmp_path: Path) -> None:
    ready: list[bool] = []
    path = python(
        tmp_path,
        "ReadyToTest(), Node(package='here', executable='steady')",
        before="from launch_testing.actions import ReadyToTest",
    )

    await rig.start(launch(path, packages=Here(environment={})).tree(on_ready=lambda: ready.append(True)))
    await rig.quiet()

    assert ready == [True]


async def test_wrong_arguments_for_ros_are_an_error_of_that_node(rig: Rig, tmp_path: Path) -> None:
    path = xml(
        tmp_path,
        '<node pkg="here" exec="steady" ros_args="--bogus"/><node pkg="here" exec="steady" name="other" args="x"/>',
    )

    await started(rig, path)

    assert any("unknown ROS arguments: '--bogus'" in line for line in said(rig))
    assert names(rig) == ["/launch", "/other"]


async def test_a_stop_in_the_start_phase_is_an_end_like_any_other(rig: Rig, tmp_path: Path) -> None:
    rig.expect_failure()

    await started(rig, xml(tmp_path, '<node pkg="here" exec="ending"/><node pkg="here" exec="steady"/>'))

    assert names(rig) == ["/launch", "/steady"]


@pytest.mark.parametrize("level", ["debug", "info", "warning", "error"])
async def test_log_actions_write_at_their_level(rig: Rig, tmp_path: Path, level: str) -> None:
    await started(rig, xml(tmp_path, f'<log level="{level}" message="hello"/>'))

    assert "hello" in said(rig)


async def test_an_executable_with_supervisors_of_its_own_keeps_their_policies(rig: Rig, tmp_path: Path) -> None:
    await started(rig, xml(tmp_path, '<node pkg="here" exec="fleet" namespace="a"/>'))
    await rig.advance(1.5)

    assert names(rig) == ["/a/brief", "/a/steady", "/launch"]
    assert rig.incarnation("/a/brief") == 2


async def test_an_executable_whose_nodes_decline_to_start_has_ended(rig: Rig, tmp_path: Path) -> None:
    await started(rig, xml(tmp_path, '<node pkg="here" exec="declining"/>'))

    assert not rig.system.running
    assert said(rig) == ["[declining-1] process has finished cleanly"]


async def test_what_was_left_out_of_a_lenient_launch_is_told_when_it_runs(rig: Rig, tmp_path: Path) -> None:
    await started(rig, xml(tmp_path, '<include file="/nowhere"/>'), lenient=True)

    assert said(rig) == ["IncludeLaunchDescription: there is no launch file /nowhere"]


async def test_nothing_is_started_below_a_group_that_has_ended(rig: Rig, tmp_path: Path) -> None:
    rig.expect_failure()
    path = python(
        tmp_path,
        """
        GroupAction([
            Node(package='here', executable='brief', on_exit=Shutdown()),
            Node(package='here', executable='stillborn', respawn=True, respawn_delay=1.0),
        ]),
        """,
    )

    await started(rig, path)
    await rig.advance(3.0)

    assert not rig.system.running


async def test_an_executable_can_be_ended_twice(rig: Rig, tmp_path: Path) -> None:
    path = python(
        tmp_path,
        """
        one, Node(package='here', executable='steady', name='last'),
        TimerAction(period=1.0, actions=[EmitEvent(event=ShutdownProcess(process_matcher=matches_action(one)))] * 2),
        """,
        before="one = Node(package='here', executable='steady', name='one')",
    )

    await started(rig, path)
    await rig.advance(2.0)

    assert names(rig) == ["/last", "/launch"]


async def test_events_are_included_by_the_handler_that_is_made_for_them(rig: Rig, tmp_path: Path) -> None:
    path = python(
        tmp_path,
        """
        RegisterEventHandler(OnIncludeLaunchDescription()),
        EmitEvent(event=IncludeLaunchDescription(LaunchDescription([LogInfo(msg='x')]))),
        """,
        before="from launch.events import IncludeLaunchDescription",
    )

    await started(rig, path)

    assert said(rig).count("x") == 2


async def test_the_nodes_of_an_executable_that_is_respawned_come_back_together(rig: Rig, tmp_path: Path) -> None:
    await started(rig, xml(tmp_path, '<node pkg="here" exec="pair" respawn="true"/>'))
    await rig.advance(1.5)

    assert (rig.incarnation("/steady"), rig.incarnation("/brief")) == (2, 2)


async def test_a_required_node_that_does_not_start_ends_the_launch(rig: Rig, tmp_path: Path) -> None:
    rig.expect_failure()
    path = xml(tmp_path, '<node pkg="here" exec="stillborn" on_exit="shutdown"/><node pkg="here" exec="steady"/>')

    await started(rig, path)

    assert not rig.system.running


async def test_a_timer_does_not_see_what_is_set_after_it(rig: Rig, tmp_path: Path) -> None:
    path = xml(
        tmp_path,
        """
        <timer period="1"><node pkg="here" exec="steady"/></timer>
        <push_ros_namespace namespace="late"/>
        <node pkg="here" exec="steady"/>
        """,
    )

    await started(rig, path)
    await rig.advance(1.5)

    assert names(rig) == ["/late/steady", "/launch", "/steady"]


async def test_of_two_remappings_of_one_name_that_of_the_group_counts(rig: Rig, tmp_path: Path) -> None:
    path = xml(
        tmp_path,
        """
        <set_remap from="motor_velocity" to="first"/>
        <node pkg="control" exec="motor_node"><remap from="motor_velocity" to="second"/></node>
        """,
    )

    await started(rig, path)

    assert "/first" in rig.system.graph.topics
    assert "/second" not in rig.system.graph.topics


async def test_an_absolute_namespace_ignores_that_of_the_group(rig: Rig, tmp_path: Path) -> None:
    path = xml(tmp_path, '<push_ros_namespace namespace="group"/><node pkg="here" exec="steady" namespace="/own/"/>')

    await started(rig, path)

    assert names(rig) == ["/launch", "/own/steady"]
