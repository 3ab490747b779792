"""Containers of components and lifecycle nodes in a launch, on the virtual clock."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from actors import Child, LifecycleNode, Node, Service, Supervisor
from actors.interfaces.composition_interfaces.srv import ListNodes, UnloadNode
from actors.launch import Packages
from actors.launch.containers import component_of
from actors.launch.packages import NodeTarget
from actors.launch.parameters import effective
from actors.launch.plan import Load
from actors.testing import Rig
from tests.actors.launch.files import launch, python, xml
from tests.actors.launch.test_service import names, said

HERE = "tests.actors.launch.test_composition"


class Managed(LifecycleNode):
    """A lifecycle node."""

    allow_undeclared_parameters = True


class Stubborn(LifecycleNode):
    """Does not get configured."""

    async def on_configure(self, previous: object) -> Any:
        from actors.lifecycle import HookResult

        return HookResult.FAILURE


def single() -> Supervisor:
    return Supervisor("outer", children=[Supervisor("inner", children=[Child(Node, name="alone")])])


def several() -> Supervisor:
    return Supervisor("outer", children=[Child(Node, name="a"), Child(Node, name="b")])


class Here(Packages):
    def executables(self, package: str) -> Any:
        if package != "here":
            return super().executables(package)
        found = {one: NodeTarget("here", one, f"{HERE}:{one}") for one in ("Managed", "Stubborn", "single", "several")}
        return {**found, "managed": found["Managed"], "stubborn": found["Stubborn"]}


async def started(rig: Rig, path: Path, **options: Any) -> None:
    await rig.start(launch(path, packages=Here(environment={}), **options).tree())
    await rig.advance(0.1)


BOX = """
<node_container pkg="rclcpp_components" exec="component_container" name="box" namespace="/ns">
  <composable_node pkg="my_robot_controller" plugin="demo::Talker" name="say" namespace="inner">
    <remap from="/chatter" to="/words"/>
  </composable_node>
  <composable_node pkg="control" plugin="motor_node" name="motor"><param name="max_velocity" value="2.5"/></composable_node>
  <composable_node pkg="here" plugin="here.single"/>
</node_container>
"""


async def test_nodes_are_loaded_into_a_container_with_their_names_parameters_and_remappings(
    rig: Rig, tmp_path: Path
) -> None:
    await started(rig, xml(tmp_path, BOX))

    assert names(rig) == ["/alone", "/inner/say", "/launch", "/motor", "/ns/box"]
    assert "/words" in rig.system.graph.topics
    assert "Max velocity: 2.5" in said(rig, "/motor")
    assert "loaded my_robot_controller demo::Talker as /inner/say" in said(rig, "/ns/box")


async def test_a_container_lists_and_unloads_its_nodes(rig: Rig, tmp_path: Path) -> None:
    await started(rig, xml(tmp_path, BOX))

    listed = await rig.call(Service(ListNodes, "/ns/box/_container/list_nodes"), ListNodes.Request())
    assert list(zip(listed.unique_ids.tolist(), listed.full_node_names, strict=True)) == [
        (1, "/inner/say"),
        (2, "/motor"),
        (3, "/alone"),
    ]
    unload = Service(UnloadNode, "/ns/box/_container/unload_node")
    assert (await rig.call(unload, UnloadNode.Request(unique_id=2))).success
    again = await rig.call(unload, UnloadNode.Request(unique_id=2))

    assert (again.success, again.error_message) == (False, "no node with the id 2 is loaded")
    assert "/motor" not in names(rig)


async def test_what_a_container_cannot_load_is_logged_and_the_rest_is_loaded(rig: Rig, tmp_path: Path) -> None:
    path = xml(
        tmp_path,
        """
        <node_container pkg="rclcpp_components" exec="component_container" name="box" namespace="">
          <composable_node pkg="control" plugin="control::Motr" name="a"/>
          <composable_node pkg="nowhere" plugin="nowhere::X" name="b"/>
          <composable_node pkg="here" plugin="here::several"/>
          <composable_node pkg="control" plugin="MotorController" name="c"/>
          <composable_node pkg="control" plugin="MotorController" name="c"/>
        </node_container>
        """,
    )

    await started(rig, path)

    errors = [line for line in said(rig) if line.startswith("/box did not load")]
    assert "it has: MotorController" in errors[0] and "package 'nowhere' not found" in errors[1]
    assert "outer is several nodes, and a component is one" in errors[2]
    assert errors[3].endswith("ValueError: /c has been loaded already")
    assert names(rig) == ["/box", "/c", "/launch"]


async def test_a_component_that_is_not_here_is_stood_in_for(rig: Rig, tmp_path: Path) -> None:
    path = python(
        tmp_path,
        """
        box, LoadComposableNodes(target_container=box, composable_node_descriptions=[
            ComposableNode(package='image_proc', plugin='image_proc::Rectify', parameters=[{'any': [1, 2]}]),
            ComposableNode(package='x', plugin='x::Y', name='y', extra_arguments=[{'use_intra_process_comms': True}]),
        ]),
        """,
        before="box = ComposableNodeContainer(name='box', namespace='')",
    )

    await started(rig, path, stand_ins=True)

    assert names(rig) == ["/Rectify", "/box", "/launch", "/y"]


async def test_a_container_that_does_not_come_is_an_error_and_the_launch_ends(rig: Rig, tmp_path: Path) -> None:
    await started(
        rig,
        xml(
            tmp_path,
            '<load_composable_node target="/nobody"><composable_node pkg="a" plugin="b" name="c"/></load_composable_node>',
        ),
    )
    await rig.advance(61.0)

    assert any(line.startswith("load into /nobody: ServiceUnavailable") for line in said(rig))
    assert not rig.system.running


def test_a_container_has_a_name(tmp_path: Path) -> None:
    from actors.launch import LaunchError

    with pytest.raises(LaunchError, match="the container into which nodes are loaded has no name"):
        launch(xml(tmp_path, '<load_composable_node target=""/>'))


async def test_the_components_of_a_package_are_found_by_class_or_executable() -> None:
    packages = Here(environment={})

    assert (await component_of(packages, "control", "a::b::MotorController")).name == "motor_controller"
    assert (await component_of(packages, "control", "motor_node")).name == "motor_controller"
    with pytest.raises(LookupError, match="has no component 'x'; it has: none"):
        await component_of(packages, "robactor", "x")


async def test_the_nodes_of_a_container_end_with_it(rig: Rig, tmp_path: Path) -> None:
    await started(rig, xml(tmp_path, f'{BOX}<node pkg="here" exec="managed" name="other"/>'))

    rig.crash("/ns/box")
    await rig.advance(0.1)

    assert names(rig) == ["/launch", "/other"]


# -- lifecycle ------------------------------------------------------------------------------------------------------------------


def state(rig: Rig, name: str) -> str:
    node = rig.node(name)
    assert isinstance(node, LifecycleNode)
    return node.state.label


async def test_transitions_are_asked_for_and_answered_as_in_the_examples_of_ros_2(rig: Rig, tmp_path: Path) -> None:
    path = python(
        tmp_path,
        """
        RegisterEventHandler(OnStateTransition(target_lifecycle_node=talker, goal_state='inactive', entities=[
            LogInfo(msg='inactive'),
            EmitEvent(event=ChangeState(lifecycle_node_matcher=matches_action(talker), transition_id=Transition.TRANSITION_ACTIVATE)),
        ])),
        RegisterEventHandler(OnStateTransition(target_lifecycle_node=talker, start_state='activating', goal_state='active',
                                               entities=[LogInfo(msg='active')])),
        RegisterEventHandler(OnProcessStart(target_action=talker, on_start=[
            EmitEvent(event=ChangeState(lifecycle_node_matcher=matches_node_name('/ns/talker'), transition_id=Transition.TRANSITION_CONFIGURE)),
        ])),
        talker, Node(package='here', executable='managed', name='plain'),
        """,
        before="""
        from launch_ros.events.lifecycle import ChangeState, matches_node_name
        from launch_ros.event_handlers import OnStateTransition
        from lifecycle_msgs.msg import Transition
        talker = LifecycleNode(package='here', executable='managed', name='talker', namespace='ns')
        """,
    )

    await started(rig, path)

    assert state(rig, "/ns/talker") == "active"
    assert state(rig, "/plain") == "unconfigured"
    assert [line for line in said(rig) if line in ("inactive", "active")] == ["inactive", "active"]


async def test_a_lifecycle_node_with_autostart_becomes_active(rig: Rig, tmp_path: Path) -> None:
    path = python(
        tmp_path,
        """
        LifecycleNode(package='here', executable='managed', name='a', namespace='', autostart=True),
        LifecycleNode(package='here', executable='managed', name='a', namespace='left', autostart=True),
        LifecycleNode(package='here', executable='managed', name='b', namespace='', autostart='false'),
        ComposableNodeContainer(name='box', namespace='', composable_node_descriptions=[
            ComposableLifecycleNode(package='here', plugin='here::Managed', name='c', autostart=True)]),
        """,
    )

    await started(rig, path)

    assert [state(rig, name) for name in ("/a", "/left/a", "/b", "/c")] == [
        "active",
        "active",
        "unconfigured",
        "active",
    ]


async def test_nodes_are_taken_through_transitions_up_to_the_first_that_fails(rig: Rig, tmp_path: Path) -> None:
    path = python(
        tmp_path,
        """
        LifecycleNode(package='here', executable='managed', name='a', namespace=''),
        LifecycleNode(package='here', executable='stubborn', name='b', namespace=''),
        LifecycleTransition(lifecycle_node_names=['a', '/b'], transition_ids=[1, TextSubstitution(text='3')]),
        """,
    )

    await started(rig, path)

    assert (state(rig, "/a"), state(rig, "/b")) == ("active", "unconfigured")
    assert [line for line in said(rig) if "transition" in line] == ["/b did not make the transition 1"]


def test_transitions_and_late_parts_are_shown_in_the_tree(tmp_path: Path) -> None:
    path = python(
        tmp_path,
        """
        LifecycleTransition(lifecycle_node_names=['a', 'b'], transition_ids=[1, 3]),
        RegisterEventHandler(OnStateTransition(target_lifecycle_node=node, transition='configure', entities=found)),
        RegisterEventHandler(OnShutdown(on_shutdown=[LogInfo(msg='bye')])),
        RegisterEventHandler(OnProcessIO(on_stdout=found)),
        RegisterEventHandler(handler), UnregisterEventHandler(handler),
        Node(package='here', executable='managed', on_exit=found),
        ExecuteProcess(cmd=['a' * 100], on_exit=[LogInfo(msg='x')]),
        node,
        """,
        before="""
        from launch_ros.event_handlers import OnStateTransition
        node = LifecycleNode(package='here', executable='managed', name='n', namespace='')
        handler = EventHandler(matcher=lambda event: True)
        def found(event, context=None):
            return None
        """,
    )

    shown = launch(path, packages=Here(environment={})).show().splitlines()[1:]

    assert [line.lstrip("│├└─ ") for line in shown] == [
        "transitions 1, 3 of a, b",
        "on a transition of /n (* -> * configure)",
        "what found() returns",
        "on shutdown",
        "log info: bye",
        "on output of anything",
        "what _written() returns",
        "EventHandler",
        "no longer EventHandler",
        f"managed-1: here/managed ({HERE}:Managed)",
        "when it has ended: what found() returns",
        f"{'a' * 100}-2: {'a' * 60}...",
        "when it has ended",
        "log info: x",
        f"managed-3: here/managed as /n ({HERE}:Managed)",
    ]


def test_global_parameters_are_no_extra_arguments_of_a_component(tmp_path: Path) -> None:
    path = python(
        tmp_path,
        """
        SetParameter('use_sim_time', True),
        LoadComposableNodes(target_container='/c', composable_node_descriptions=[
            ComposableNode(package='p', plugin='p::C', name='n', extra_arguments=[{'use_intra_process_comms': True}])])
        """,
        before="from launch_ros.descriptions import ComposableNode",
    )
    (item,) = launch(path)._plan.items

    assert isinstance(item, Load)
    (component,) = item.components
    assert component.extra == {"use_intra_process_comms": True}
    assert effective("/n", component.layers) == {"use_sim_time": True}
