"""XML and YAML: the same words in both, and errors that name file, line and the nearest word."""

from __future__ import annotations

from pathlib import Path

import pytest

from actors.launch import LaunchError
from tests.actors.launch.files import launch, tree, written, xml

YAML = """
launch:
- arg: {name: ns, default: left}
- let: {name: rate, value: "5"}
- group:
    scoped: true
    if: "true"
    children:
    - push_ros_namespace: {namespace: $(var ns)}
    - node:
        pkg: camera_driver
        exec: camera_node
        name: camera
        param:
        - {name: rate, value: $(var rate)}
        - {name: gain, value: 1.5}
        - {name: names, value: [a, $(var ns)]}
        - name: deep
          param:
          - {name: er, value: true}
        remap:
        - {from: /camera/image, to: image}
        env: {name: A, value: b}
- group:
  - log: {message: in a list}
- executable:
    cmd: sh -c 'exit 0'
    shell: true
- reset:
"""

XML = """
<arg name="ns" default="left"/>
<let name="rate" value="5"/>
<group scoped="true" if="true">
  <push_ros_namespace namespace="$(var ns)"/>
  <node pkg="camera_driver" exec="camera_node" name="camera">
    <param name="rate" value="$(var rate)"/>
    <param name="gain" value="1.5"/>
    <param name="names" value="[a, $(var ns)]"/>
    <param name="deep"><param name="er" value="true"/></param>
    <remap from="/camera/image" to="image"/>
    <env name="A" value="b"/>
  </node>
</group>
<group><log message="in a list"/></group>
<executable cmd="sh -c 'exit 0'" shell="true"/>
<reset/>
"""

TREE = [
    "group (supervisor, one_for_one)",
    "camera_node-1: camera_driver/camera_node as /left/camera (robot.tutorials.camera_detector:Camera)",
    "rate: 5",
    "gain: 1.5",
    "names: ('a', 'left')",
    "deep.er: True",
    "/camera/image -> image",
    "group_2 (supervisor, one_for_one)",
    "log info: in a list",
    "sh-2: sh -c 'exit 0'",
]


def refused(path: Path) -> str:
    with pytest.raises(LaunchError) as caught:
        launch(path)
    return str(caught.value)


def test_a_file_in_yaml_and_one_in_xml_come_to_the_same_tree(tmp_path: Path) -> None:
    assert tree(xml(tmp_path, XML)) == TREE
    assert tree(written(tmp_path, "system.launch.yaml", YAML)) == TREE


@pytest.mark.parametrize(
    ("inside", "line", "words"),
    [
        ("<noed/>", 3, "there is no tag <noed>; did you mean 'node'?"),
        ("<zzzzz/>", 3, "there is no tag <zzzzz>; there are: append_env, arg"),
        ('<arg nam="x"/>', 3, "<arg> needs the attribute 'name'; did you mean 'nam'?"),
        ("<arg/>", 3, "<arg> needs the attribute 'name'"),
        ('<arg name="x" defalt="1"/>', 3, "<arg> has no attribute 'defalt'; did you mean 'default'?"),
        (
            '<arg name="x" zzz="1"/>',
            3,
            "<arg> has no attribute 'zzz'; there are: default, description, if, name, unless",
        ),
        ('<arg name="x"><choise value="1"/></arg>', 3, "<arg> takes no <choise>; did you mean 'choice'?"),
        ('<arg name="x"><zzz/></arg>', 3, "<arg> takes no <zzz>; it takes: choice"),
        ('<let name="x" value="1"><zzz/></let>', 3, "<let> takes no <zzz>; it takes no children"),
        ('<log message="x" if="true" unless="true"/>', 3, "has both 'if' and 'unless'"),
        ('<log message="$(vr x)"/>', 3, "there is no substitution 'vr'; did you mean 'var'?"),
        (
            '<node pkg="control" exec="motor_node">\n<param name="x" value="1" type="flot"/></node>',
            4,
            "there is no type 'flot'; did you mean 'float'?",
        ),
        (
            '<node pkg="control" exec="motor_node"><param name="x" value="1" type="zz"/></node>',
            3,
            "there is no type 'zz'; there are: bool",
        ),
        ('<node pkg="control" exec="motor_node"><param name="x"/></node>', 3, "<param> needs the attribute 'value'"),
        ('<node pkg="control" exec="motor_node">\n<remap from="x"/></node>', 4, "<remap> needs the attribute 'to'"),
        (
            '<node pkg="control" exec="motor_node">\n<remap from="x" too="y" to="z"/></node>',
            4,
            "<remap> has no attribute 'too'",
        ),
        (
            '<node pkg="control" exec="motor_node" on_exit="restart"/>',
            3,
            "on_exit is 'shutdown' or nothing, not 'restart'",
        ),
        ('<node pkg="contrl" exec="motor_node"/>', 3, "package 'contrl' not found; did you mean 'control'?"),
        ('<node pkg="control" exec="moter_node"/>', 3, "has no executable 'moter_node'; did you mean 'motor_node'?"),
    ],
)
def test_a_slip_in_xml_is_named_with_its_line_and_the_nearest_word(
    tmp_path: Path, inside: str, line: int, words: str
) -> None:
    path = xml(tmp_path, f"\n{inside}")

    text = refused(path)

    assert text.startswith(f"{path}:{line}: ")
    assert words in text


@pytest.mark.parametrize(
    ("text", "line", "words"),
    [
        ("<launch>\n<node\n</launch>", 3, "no XML: not well-formed"),
        ("\n<lanch/>", 2, "a launch file begins with <launch>, not with <lanch>"),
        ('<!DOCTYPE x [\n<!ENTITY a "b">]>\n<launch/>', 2, "the entity 'a' is defined in the file"),
    ],
)
def test_what_is_no_launch_file_in_xml_is_refused(tmp_path: Path, text: str, line: int, words: str) -> None:
    path = written(tmp_path, "a.launch.xml", text)

    assert refused(path).startswith(f"{path}:{line}: {words}")


@pytest.mark.parametrize(
    ("text", "line", "words"),
    [
        ("", 1, "the file is empty"),
        ("launch: [", 1, "no YAML: expected the node content"),
        ("lanch: []", 1, "a launch file has one key, 'launch', not lanch"),
        ("{}", 1, "a launch file has one key, 'launch', not none"),
        ("- launch", 1, "the file is a mapping, 'name: value', here"),
        ("launch:\n- nodee: {pkg: a}", 2, "there is no tag <nodee>; did you mean 'node'?"),
        (
            "launch:\n- node: {pkg: a}\n  name: x",
            2,
            "an action has one key, its kind, not node, name; what follows is indented deeper",
        ),
        ("launch:\n- node", 2, "an action is a mapping, 'name: value', here"),
        ("launch:\n- node: x", 2, "'node' takes attributes, node: {name: value}, not 'x'"),
        ("launch:\n- group:\n    children: 3", 3, "a list of actions begins each of them with '-'"),
        ("launch: 3", 1, "'launch' takes attributes"),
        ("launch: [\x1b]", 1, "no YAML: the character U+001B is not allowed"),
        (
            f"launch:\n- arg: {{name: x, default: '{'$(var ' * 1000 + ')' * 1000}'}}",
            2,
            "substitutions are nested more than 100 levels deep",
        ),
    ],
)
def test_a_slip_in_yaml_is_named_with_its_line(tmp_path: Path, text: str, line: int, words: str) -> None:
    path = written(tmp_path, "a.launch.yaml", text)

    assert refused(path).startswith(f"{path}:{line}: {words}")


def test_a_file_of_another_kind_is_refused_but_xml_by_the_old_name_is_read(tmp_path: Path) -> None:
    assert "a launch file ends in .py, .xml, .yaml, .yml" in refused(written(tmp_path, "a.launch.toml", ""))
    assert "a launch file ends in" in refused(written(tmp_path, "b.launch", "launch:"))
    assert tree(written(tmp_path, "a.launch", "<launch><log message='x'/></launch>")) == ["log info: x"]
    assert tree(written(tmp_path, "a.launch.yml", "launch: [{log: {message: x}}]")) == ["log info: x"]


def test_every_option_of_a_node_can_be_written(tmp_path: Path) -> None:
    file = written(tmp_path, "p.yaml", "/**: {ros__parameters: {max_velocity: $(var v)}}")
    path = xml(
        tmp_path,
        f"""
        <let name="v" value="2.5"/>
        <node pkg="control" exec="motor_node" exec_name="motor" namespace="/arm" args="--fast '$(var v)'" ros_args="--log-level debug"
              output="screen" respawn="true" respawn_delay="2.0" respawn_max_retries="3" cwd="/" sigterm_timeout="1" sigkill_timeout="2"
              launch-prefix="nice" emulate_tty="true">
          <param from="{file}" allow_substs="true"/>
          <param name="list" value="1,2" value-sep=","/>
          <param name="texts" value="1,2" value-sep="," type="list_of_str"/>
          <param name="text" value="1" type="str"/>
        </node>
        <lifecycle_node pkg="control" exec="motor_node" name="" namespace="" autostart="true"/>
        <lifecycle-node pkg="control" exec="motor_node" name="other" namespace="" on_exit="shutdown"/>
        """,
    )

    assert tree(path) == [
        "motor-1: control/motor_node in /arm (robot.tutorials.motor_controller:MotorController) [permanent: restarted after 2 s at most 3 times]",
        f"parameters of {file}",
        "list: (1, 2)",
        "texts: ('1', '2')",
        "text: '1'",
        "arguments --fast 2.5",
        "motor_node-2: control/motor_node (robot.tutorials.motor_controller:MotorController)",
        "motor_node-3: control/motor_node as /other (robot.tutorials.motor_controller:MotorController) "
        "[significant: its end ends the launch]",
    ]


def test_a_list_of_yaml_and_a_typed_value_keep_their_types(tmp_path: Path) -> None:
    path = written(
        tmp_path,
        "a.launch.yaml",
        """
        launch:
        - node:
            pkg: control
            exec: motor_node
            param:
            - {name: a, value: [1, 2.5]}
            - {name: b, value: 3, type: str}
            - {name: c, value: true}
            - {name: d, value: !!float 4}
            - {name: e, value: !!bool yes, type: str}
        """,
    )

    assert tree(path)[1:] == ["a: (1.0, 2.5)", "b: '3'", "c: True", "d: 4.0", "e: 'true'"]


def test_timers_global_settings_and_shutdown_can_be_written(tmp_path: Path) -> None:
    path = xml(
        tmp_path,
        """
        <set_parameter name="rate" value="5"/>
        <set_use_sim_time value="true"/>
        <set_parameters_from_file filename="/none.yaml"/>
        <set_remap from="a" to="b"/>
        <timer period="$(eval '1 + 1')" cancel_on_shutdown="true"><log message="later"/></timer>
        <ros_timer period="3"><shutdown reason="done"/></ros_timer>
        <timer period="4"><shutdown/></timer>
        <node pkg="control" exec="motor_node"/>
        """,
    )

    assert tree(path) == [
        "after 2 s",
        "log info: later",
        "after 3 s",
        "emit Shutdown (done)",
        "after 4 s",
        "emit Shutdown (reason not given)",
        "motor_node-1: control/motor_node (robot.tutorials.motor_controller:MotorController)",
        "rate: 5",
        "use_sim_time: True",
        "parameters of /none.yaml (not here)",
        "a -> b",
    ]
    assert "the period 'soon' is no number of seconds" in refused(xml(tmp_path, '<timer period="soon"/>'))


def test_containers_and_components_can_be_written(tmp_path: Path) -> None:
    path = xml(
        tmp_path,
        """
        <node_container pkg="rclcpp_components" exec="component_container" name="box" namespace="/ns">
          <composable_node pkg="p" plugin="p::Talker" name="talker" namespace="inner" autostart="true">
            <param name="rate" value="5"/><remap from="a" to="b"/><extra_arg name="use_intra_process_comms" value="true"/>
          </composable_node>
          <composable_node pkg="p" plugin="p::Never" name="never" if="false"/>
          <composable_node pkg="p" plugin="p::Always" name="always" unless="false"/>
        </node_container>
        <load_composable_node target="box"><composable_node pkg="p" plugin="p::Other"/></load_composable_node>
        <group>
          <push_ros_namespace namespace="deep"/>
          <load_composable_node target="box"/>
        </group>
        """,
    )

    assert tree(path) == [
        "component_container-1: rclcpp_components/component_container as /ns/box (container)",
        "load into /ns/box",
        "p p::Talker as /inner/talker",
        "rate: 5",
        "a -> b",
        "p p::Always as /always",
        "load into /box",
        "p p::Other",
        "group (supervisor, one_for_one)",
        "load into /box",  # relative to the node of the launch, not to the group
    ]


@pytest.mark.parametrize(
    ("written_", "value"),
    [
        ('"42"', "'42'"),
        ("'true'", "'true'"),
        ('"[1, 2]"', "'[1, 2]'"),
        ('["1", "2"]', "('1', '2')"),
        ("!!str 3", "'3'"),
        ("5e-1", "0.5"),
        ("[1.0, 1e-1]", "(1.0, 0.1)"),
        ("12:30", "'12:30'"),
        ("$(var n)", "7"),
        ("|\n          a\n          b\n", "'a\\nb\\n'"),
    ],
)
def test_a_value_in_yaml_has_the_type_that_yaml_gives_it(tmp_path: Path, written_: str, value: str) -> None:
    text = f"""launch:
- let: {{name: n, value: "7"}}
- node:
    pkg: camera_driver
    exec: camera_node
    param:
    - name: p
      value: {written_}
"""
    assert tree(written(tmp_path, "system.launch.yaml", text))[-1] == f"p: {value}"


@pytest.mark.parametrize(
    ("text", "shown"),
    [
        (r"\\d+", r"\d+"),
        (r"C:\\dev", r"C:\dev"),
        (r"\'a\'", "'a'"),
        (r"\a", "a"),
        (r"\$(x)", "$(x)"),
        ("end\\", "end\\"),
        (r"$(eval ' \&quot;x\&quot; == \&quot;x\&quot; ')", "True"),
        (r"$(var no '\'a\'')", "'a'"),
        (r"a\\$(var x)", r"a\$(var x)"),
    ],
)
def test_a_backslash_is_removed_and_keeps_what_follows_it(tmp_path: Path, text: str, shown: str) -> None:
    assert tree(xml(tmp_path, f'<log message="{text}"/>')) == [f"log info: {shown}"]


def test_the_container_that_nodes_are_loaded_into_is_named_from_the_root(tmp_path: Path) -> None:
    path = xml(
        tmp_path,
        """
        <group>
          <push_ros_namespace namespace="robot1"/>
          <node_container pkg="rclcpp_components" exec="component_container" name="box" namespace=""/>
          <load_composable_node target="robot1/box"><composable_node pkg="p" plugin="p::Other"/></load_composable_node>
        </group>
        """,
    )
    shown = tree(path)
    assert any("as /robot1/box" in line for line in shown)
    assert "load into /robot1/box" in shown
