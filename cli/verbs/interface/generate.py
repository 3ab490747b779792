"""`interface generate`: typed modules from a folder of definitions, or definitions from the types of this process or of the graph."""

from __future__ import annotations

import argparse
import os
from collections.abc import Coroutine, Iterable, Iterator
from functools import partial
from pathlib import Path
from typing import Any, Final, NamedTuple

from actors.interfaces import definition_text, get_action, get_message, get_service, known_names
from actors.interfaces.generate import main as write_modules
from actors.interfaces.lookup import find
from actors.interfaces.naming import KINDS, closest, full_name
from actors.interfaces.registry import find_definition
from actors.interfaces.text import PARTS
from cli.command import CommandFailed, Exit
from cli.graph.seen import Seen, seen
from cli.graph.types import learn_folders, resolved

SHIPPED = "actors.interfaces"
"""The module whose packages every process has. Their definitions are only written if they are asked for by name."""


_GETTERS: Final = {"action": get_action, "service": get_service, "message": get_message}


_MANIFEST: Final = """<?xml version="1.0"?>
<package format="3">
  <name>{own}</name>
  <version>0.0.0</version>
  <description>The interfaces of {own}</description>
  <maintainer email="nobody@example.com">nobody</maintainer>
  <license>TODO</license>
  <buildtool_depend>ament_cmake</buildtool_depend>
  <buildtool_depend>rosidl_default_generators</buildtool_depend>
{depends}  <exec_depend>rosidl_default_runtime</exec_depend>
  <member_of_group>rosidl_interface_packages</member_of_group>
  <export>
    <build_type>ament_cmake</build_type>
  </export>
</package>
"""
_CMAKE: Final = """cmake_minimum_required(VERSION 3.8)
project({own})
find_package(ament_cmake REQUIRED)
find_package(rosidl_default_generators REQUIRED)
{found}file(GLOB definitions RELATIVE ${{CMAKE_CURRENT_SOURCE_DIR}} msg/*.msg srv/*.srv action/*.action)
rosidl_generate_interfaces(${{PROJECT_NAME}} ${{definitions}}{dependencies})
ament_export_dependencies(rosidl_default_runtime)
ament_package()
"""


class Use(NamedTuple):
    """A node that uses a type."""

    word: str
    """What the type is of: message, service or action."""

    place: str
    """The topic, service or action."""

    node: str
    type: Any

    @property
    def name(self) -> str:
        """The full name of the type."""
        return str(self.type.__ros_type__)


def generate(options: argparse.Namespace) -> int | Coroutine[Any, Any, Exit]:
    """Write typed modules, or definitions."""
    return _definitions(options) if options.definitions else _modules(options)


def _modules(options: argparse.Namespace) -> int:
    """Write typed modules of the definitions in a folder."""
    if len(options.source) != 1:
        raise CommandFailed("modules are written for one folder of definitions: DIR/PACKAGE/msg/NAME.msg, and so on")
    words = [options.source[0], *(["--check"] if options.check else [])]
    for name in ("out", "home"):
        if (value := getattr(options, name)) is not None:
            words += [f"--{name}", value]
    return write_modules(words, command="robactor interface generate")


async def _definitions(options: argparse.Namespace) -> Exit:
    """Write the definitions of types, and of those in their fields, as files of DIR/PACKAGE/msg/NAME.msg, and so on."""
    if options.check or options.home is not None:
        raise CommandFailed("--check and --home are for modules, not for definitions")
    out = Path(options.out or "share")
    learn_folders(options)
    wanted = list(options.source)
    if any(not _known(source) for source in wanted):
        async with seen(options) as graph:
            for source in wanted:
                await _learn(graph, source, options)
    asked = {name for source in wanted for name in _known(source)}
    for source in wanted:
        if not _known(source):
            hint = closest(source, [*known_names(), *_packages(known_names())])
            raise CommandFailed(f"{source} is no type and no package that is known here, and no node uses it.{hint}")
    names = sorted(asked | {name for name in _within(asked) if not _ships(name)})
    written = [_write(out, name) for name in names]
    for package in sorted(_packages(name for name in names if not _ships(name))):
        _write_package(out / package, [name for name in names if name.startswith(f"{package}/")])
    print(f"{len(written)} definitions, {written.count(True)} written, in {out}")
    return Exit.DONE


def _known(source: str) -> list[str]:
    """The full names of the types that a word stands for: a type, or all of a package; none if it is neither."""
    if "/" not in source:
        return [name for name in known_names() if name.startswith(f"{source}/")]
    return [name for kind in KINDS if find(name := full_name(source, kind)) is not None][:1]


def _packages(names: Iterable[str]) -> set[str]:
    return {name.partition("/")[0] for name in names}


async def _learn(graph: Seen, source: str, options: argparse.Namespace) -> None:
    """Fetch the types of the graph that a word stands for and that are not known here."""
    if not _known(source):
        await graph.late(lambda: any(_is_of(use, source) for use in _used(graph)), options.spin_time)
    for use in list(_used(graph)):
        if _is_of(use, source) and find(use.name) is None:
            await resolved(graph, _GETTERS[use.word], use.word, use.name, partial(_ends, graph, use), use.place)


def _is_of(use: Use, source: str) -> bool:
    """Whether a word stands for the type that is used, or for its package."""
    package, _, leaf = use.name.split("/")
    return source in (package, f"{package}/{leaf}", use.name)


def _ends(graph: Seen, use: Use) -> list[tuple[str, Any]]:
    """The nodes that use a type at this place now. That of an action is known better once it is known here."""
    return [(each.node, each.type) for each in _used(graph) if (each.place, each.name) == (use.place, use.name)]


def _used(graph: Seen) -> Iterator[Use]:
    """What the nodes of other processes use."""
    entries = graph.system.graph
    for action in entries.actions.values():
        yield from (Use("action", action.name, one.host, one.type) for one in action.remotes)
    for service in entries.services.values():
        yield from (Use("service", service.name, one.host, one.type) for one in service.remotes)
    for topic in entries.topics.values():
        ends: list[Any] = [*topic.publishers, *topic.subscriptions]
        yield from (Use("message", topic.name, end.node.fqn, end.type) for end in ends if not end.here)


def _within(names: Iterable[str]) -> set[str]:
    """The types in the fields of these types, however deep."""
    found: set[str] = set()
    waiting = [find(name) for name in names]
    while waiting:
        for message in _nested(waiting.pop()):
            if message.__ros_type__ not in found:
                found.add(message.__ros_type__)
                waiting.append(message)
    return found


def _nested(kind: Any) -> Iterator[Any]:
    """The messages in the fields of a type."""
    parts = PARTS.get(kind.__ros_type__.split("/")[1], ()) if not hasattr(kind, "__ros_fields__") else ()
    for part in [getattr(kind, part) for part in parts] or [kind]:
        yield from (field.message for field in part.__ros_fields__ if field.message is not None)


def _ships(name: str) -> bool:
    found = find_definition(name)
    return found is not None and found[0].module == SHIPPED


def _write(out: Path, name: str) -> bool:
    """Write a definition. Returns whether it was missing; raises `CommandFailed` if another one is there."""
    package, kind, leaf = name.split("/")
    return _write_file(out / package / kind / f"{leaf}.{kind}", definition_text(name))


def _write_package(folder: Path, names: Iterable[str]) -> None:
    """Make a folder of definitions a package that colcon builds, unless it is one."""
    if (folder / "package.xml").exists() or (folder / "CMakeLists.txt").exists():
        return
    own = folder.name
    needs = _packages(message.__ros_type__ for name in names for message in _nested(find(name)))
    needs |= {"action_msgs" for name in names if "/action/" in name}
    needs.discard(own)
    depends = "".join(f"  <depend>{each}</depend>\n" for each in sorted(needs))
    _write_file(folder / "package.xml", _MANIFEST.format(own=own, depends=depends))
    found = "".join(f"find_package({each} REQUIRED)\n" for each in sorted(needs))
    dependencies = f" DEPENDENCIES {' '.join(sorted(needs))}" if needs else ""
    _write_file(folder / "CMakeLists.txt", _CMAKE.format(own=own, found=found, dependencies=dependencies))


def _write_file(path: Path, text: str) -> bool:
    """Write a file. Returns whether it was missing; raises `CommandFailed` if another one is there."""
    try:
        if path.exists():
            if path.read_text(encoding="utf-8") != text:
                raise CommandFailed(f"{path} is there and differs: move it away first")
            return False
        os.makedirs(path.parent, exist_ok=True)
        path.write_text(text, encoding="utf-8")
    except OSError as error:
        raise CommandFailed(f"{path} cannot be written: {error.strerror}") from None
    return True
