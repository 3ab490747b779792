"""Packages, their executables and their files, found by entry points, in folders of sources, and below prefixes."""

from __future__ import annotations

import sys
from importlib.metadata import EntryPoint, entry_points
from pathlib import Path

import pytest

from actors import Node
from actors.launch.packages import GROUP, NodeTarget, Packages, Program, UnknownExecutable, UnknownPackage
from actors.launch.sources import folder_of_module
from actors.running.target import find
from actors.supervision.declarations import Supervisor


def program(path: Path) -> Path:
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text("#!/bin/sh\n")
    path.chmod(0o755)
    return path


def source_package(folder: Path, name: str) -> Path:
    folder.mkdir(parents=True)
    (folder / "package.xml").write_text(f"<package><name> {name} </name></package>")
    return folder


def installed(prefix: Path, package: str) -> Path:
    index = prefix / "share" / "ament_index" / "resource_index" / "packages"
    index.mkdir(parents=True, exist_ok=True)
    (index / package).touch()
    (prefix / "share" / package / "launch").mkdir(parents=True)
    return program(prefix / "lib" / package / "talker")


def test_a_node_of_the_tutorials_is_found_by_its_entry_point() -> None:
    found = Packages(environment={}).find("humanoid_control", "planner")

    assert found == NodeTarget("humanoid_control", "planner", "robot.tutorials.humanoid_lab:Planner")


def test_both_names_of_the_battery_server_start_it() -> None:
    packages = Packages(environment={})

    one, other = (packages.find("my_first_robot", name) for name in ("battery_server", "battery_service_server"))

    assert isinstance(one, NodeTarget) and isinstance(other, NodeTarget) and one.target == other.target


@pytest.mark.parametrize(
    "entry", [one for one in entry_points(group=GROUP) if ":" in one.value], ids=lambda one: one.name
)
def test_every_entry_point_leads_to_a_node_or_a_tree(entry: EntryPoint) -> None:
    made = find(entry.value)()

    assert isinstance(made, Supervisor) or (isinstance(made, type) and issubclass(made, Node))


def test_a_console_script_is_an_executable_of_its_distribution() -> None:
    found = Packages(environment={}).find("robactor", "robactor")

    assert found == Program("robactor", "robactor", Path(sys.executable).parent / "robactor")
    assert Packages(environment={}).share("pytest") == folder_of_module("pytest")


def test_a_distribution_whose_script_was_removed_has_no_executable(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(sys, "executable", str(tmp_path / "python"))

    with pytest.raises(UnknownPackage):
        Packages(environment={}).find("robactor", "robactor")


def test_the_prefixes_of_ament_are_searched_in_their_order(tmp_path: Path) -> None:
    first, second = tmp_path / "overlay", tmp_path / "underlay"
    over, _ = installed(first, "demo"), installed(second, "demo")
    (first / "lib" / "demo" / "readme").write_text("no program")
    packages = Packages(environment={"AMENT_PREFIX_PATH": f"{first}:{second}:"})

    assert packages.executables("demo") == {"talker": Program("demo", "talker", over)}
    assert packages.share("demo") == first / "share" / "demo"
    assert packages.prefix("demo") == first
    assert "demo" in packages.names()


def test_an_entry_point_comes_before_a_program_of_a_prefix_and_both_are_listed(tmp_path: Path) -> None:
    installed(tmp_path, "actors")
    program(tmp_path / "lib" / "actors" / "clock_publisher")

    found = Packages(environment={"AMENT_PREFIX_PATH": str(tmp_path)}).executables("actors")

    assert isinstance(found["clock_publisher"], NodeTarget)
    assert isinstance(found["talker"], Program)


def test_packages_are_found_by_their_package_xml_at_any_depth_and_else_by_their_folder(tmp_path: Path) -> None:
    inner = source_package(tmp_path / "repo" / "nested" / "folder", "driver")
    broken = tmp_path / "repo" / "broken"
    broken.mkdir()
    (broken / "package.xml").write_text("<package>")
    source_package(tmp_path / "repo" / "skipped" / "one", "ignored")
    (tmp_path / "repo" / "skipped" / "COLCON_IGNORE").touch()
    (tmp_path / "stand_in").mkdir()
    (tmp_path / ".git").mkdir()
    source_package(tmp_path / "too" / "deep" / "for" / "a" / "package" / "here", "deep")

    packages = Packages([tmp_path], {})

    assert packages.share("driver") == inner
    assert packages.prefix("driver") == inner
    assert packages.share("broken") == broken
    assert packages.share("stand_in") == tmp_path / "stand_in"
    assert packages.executables("stand_in") == {}
    assert {"ignored", "deep", ".git"}.isdisjoint(packages.names())


def test_programs_in_the_sources_of_a_package_are_executables(tmp_path: Path) -> None:
    folder = source_package(tmp_path / "driver", "driver")
    script, built = program(folder / "scripts" / "lidar"), program(folder / "lib" / "driver" / "imu")
    (folder / "scripts" / "notes.txt").write_text("")

    assert Packages([tmp_path], {}).executables("driver") == {
        "imu": Program("driver", "imu", built),
        "lidar": Program("driver", "lidar", script),
    }


def test_the_package_around_a_launch_file_is_found_but_does_not_replace_a_known_one(tmp_path: Path) -> None:
    folder = source_package(tmp_path / "ws" / "bringup", "bringup")
    packages = Packages(environment={})

    packages.add_package_of(folder / "launch" / "robot.launch.py")
    packages.add_package_of(source_package(tmp_path / "other", "bringup") / "robot.launch.py")
    packages.add_package_of(Path("/robot.launch.py"))

    assert packages.share("bringup") == folder


def test_an_unknown_package_is_answered_with_the_nearest_and_with_all() -> None:
    with pytest.raises(
        UnknownPackage,
        match=r"'humanoid_contrl' not found; did you mean 'humanoid_control'\? \(there are: actors, camera_dr",
    ) as e:
        Packages(environment={}).find("humanoid_contrl", "planner")
    assert "more" not in str(e.value)


def test_a_long_list_of_packages_is_cut(tmp_path: Path) -> None:
    for number in range(50):
        (tmp_path / f"package_{number}").mkdir()

    with pytest.raises(UnknownPackage, match=r"package_1, .* and \d+ more\)$"):
        Packages([tmp_path], {}).share("zzz")


def test_an_unknown_executable_is_answered_with_the_nearest_and_with_all_of_its_package(tmp_path: Path) -> None:
    (tmp_path / "empty").mkdir()
    packages = Packages([tmp_path], {})

    with pytest.raises(UnknownExecutable) as caught:
        packages.find("humanoid_control", "plannr")
    with pytest.raises(UnknownExecutable, match=r"'empty' has no executable 'any' .there is none."):
        packages.find("empty", "any")

    assert str(caught.value) == (
        "package 'humanoid_control' has no executable 'plannr'; did you mean 'planner'? "
        "(there are: motor_controller, planner, sensor_simulator)"
    )


def test_a_file_is_found_anywhere_in_its_package(tmp_path: Path) -> None:
    folder = source_package(tmp_path / "bringup", "bringup")
    (folder / "launch" / "more").mkdir(parents=True)
    wanted = folder / "launch" / "more" / "robot.launch.py"
    wanted.touch()
    packages = Packages([tmp_path], {})

    assert packages.file("bringup", "robot.launch.py") == wanted
    with pytest.raises(UnknownExecutable, match=r"did you mean 'robot.launch.py'\? .there are: robot.launch.py"):
        packages.file("bringup", "robt.launch.py", (".launch.py",))
    with pytest.raises(UnknownExecutable, match="there is none"):
        packages.file("bringup", "x", (".none",))
    (folder / "robot.launch.py").touch()
    with pytest.raises(LookupError, match=r"has several files 'robot\.launch\.py'"):
        packages.file("bringup", "robot.launch.py")


def test_modules_without_a_folder_have_none() -> None:
    assert folder_of_module("no_such_module") is None
    assert folder_of_module("no_such_package.module") is None
    assert folder_of_module("sys") is None
    assert folder_of_module("robot.tutorials.ring") == folder_of_module("robot.tutorials")


def test_a_package_of_the_user_in_a_prefix_goes_before_a_tutorial_of_its_name_but_not_before_our_nodes_of_ros_2(
    tmp_path: Path,
) -> None:
    talker = installed(tmp_path, "my_package")
    installed(tmp_path, "tf2_ros")
    mine = program(tmp_path / "lib" / "my_package" / "my_node")
    program(tmp_path / "lib" / "tf2_ros" / "static_transform_publisher")
    packages = Packages(environment={"AMENT_PREFIX_PATH": str(tmp_path)})

    assert packages.find("my_package", "talker") == Program("my_package", "talker", talker)
    assert packages.find("my_package", "my_node") == Program("my_package", "my_node", mine)
    assert packages.share("my_package") == tmp_path / "share" / "my_package"
    assert isinstance(packages.find("tf2_ros", "static_transform_publisher"), NodeTarget)
