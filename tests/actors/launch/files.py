"""Launch files for tests: they are written here and evaluated."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from textwrap import dedent
from typing import Any

from actors.launch import Launch, Packages
from actors.launch.context import LaunchContext

IMPORTS = """
from launch import *
from launch.actions import *
from launch.conditions import *
from launch.event_handlers import *
from launch.events import matches_action
from launch.events.process import ShutdownProcess, SignalProcess
from launch.launch_description_sources import *
from launch.substitutions import *
from launch_ros.actions import *
from launch_ros.descriptions import *
from launch_ros.substitutions import FindPackageShare, FindPackagePrefix, ExecutableInPackage
"""
"""What a launch file in Python begins with."""


def written(folder: Path, name: str, text: str) -> Path:
    path = folder / name
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(dedent(text), encoding="utf-8")
    return path


def python(folder: Path, actions: str, *, before: str = "", name: str = "system.launch.py") -> Path:
    """A launch file in Python with these actions, a list without its brackets; `before` stands before the function."""
    text = f"{IMPORTS}\n{dedent(before)}\ndef generate_launch_description():\n    return LaunchDescription([{dedent(actions)}])\n"
    return written(folder, name, text)


def xml(folder: Path, inside: str, name: str = "system.launch.xml") -> Path:
    return written(folder, name, f"<launch>\n{dedent(inside)}\n</launch>\n")


def launch(path: Path, arguments: Mapping[str, str] | None = None, **options: Any) -> Launch:
    options.setdefault("packages", Packages(environment={}))
    return Launch(path, arguments, **options)


def tree(path: Path, arguments: Mapping[str, str] | None = None, **options: Any) -> list[str]:
    """The lines of the tree below its root, without what draws the branches."""
    return [line.lstrip("│├└─ ") for line in launch(path, arguments, **options).show().splitlines()[1:]]


def context(**options: Any) -> LaunchContext:
    options.setdefault("environment", {"HOME": "/home/ros"})
    return LaunchContext(Packages(environment={}), **options)
