"""`interface list | show | package | packages | proto | generate`: the types of messages, services and actions that are known here."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from typing import Any, Literal

from cli.command import CommandFailed, Exit
from cli.output import print_json
from cli.parsing import Verb, Verbs, add_common, add_interfaces, add_json

__all__ = ["main", "verbs"]

_TITLES = {"msg": "Messages:", "srv": "Services:", "action": "Actions:"}


def main(argv: Sequence[str]) -> int | Exit:
    """Run one verb of the group."""
    return verbs().run(argv)


def verbs() -> Verbs:
    """The verbs of the group."""
    group = Verbs("interface", "The types of messages, services and actions.")
    listing = group.add("list", "List all interface types available", lambda: _list)
    packages = group.add("packages", "Output a list of packages that provide interfaces", lambda: _packages)
    package = group.add("package", "Output a list of available interface types within one package", lambda: _package)
    package.add_argument("package_name", help="for instance geometry_msgs")
    for parser in (listing, packages, package):
        parser.add_argument("-m", "--only-msgs", action="store_true", help="only messages")
        parser.add_argument("-s", "--only-srvs", action="store_true", help="only services")
        parser.add_argument("-a", "--only-actions", action="store_true", help="only actions")
    show = group.add("show", "Output the interface definition", lambda: _show)
    show.add_argument("type", help="for instance sensor_msgs/msg/Imu; - reads it from the standard input")
    comments = show.add_mutually_exclusive_group()
    comments.add_argument("--all-comments", action="store_true", help="also those of nested types")
    comments.add_argument("--no-comments", action="store_true", help="no comments and no empty lines")
    proto = group.add("proto", "Output an interface prototype", lambda: _proto)
    proto.add_argument("type", help="for instance sensor_msgs/msg/Imu")
    proto.add_argument("--no-quotes", action="store_true", help="without quotes around it")
    for parser in (listing, packages, package, show, proto):
        add_json(parser)
        add_interfaces(parser)
    add_common(_generate(group.add("generate", "Write typed Python modules, or definitions", _load_generate)))
    return group


def _generate(parser: argparse.ArgumentParser) -> argparse.ArgumentParser:
    parser.add_argument("source", nargs="+", help="a folder of definitions; with --definitions types or packages")
    parser.add_argument(
        "--definitions",
        action="store_true",
        help="write DIR/PACKAGE/msg/NAME.msg, and so on, of types that are known here or to the nodes of the graph",
    )
    parser.add_argument("--out", metavar="DIR", help="where (beside the folder; for definitions: share)")
    parser.add_argument("--home", help="the Python package that DIR is, '' for none (by where it lies)")
    parser.add_argument("--check", action="store_true", help="write nothing; 1 if a module is missing or old")
    return parser


def _load_generate() -> Verb:
    from cli.interface_generate import definitions, modules

    return lambda options: definitions(options) if options.definitions else modules(options)


def _kinds(options: argparse.Namespace) -> list[str]:
    wanted = {"msg": options.only_msgs, "srv": options.only_srvs, "action": options.only_actions}
    return [kind for kind, given in wanted.items() if given] or list(wanted)


def _names(options: argparse.Namespace) -> list[str]:
    """The full names of the types of the kinds that are wanted."""
    from actors.interfaces import known_names
    from cli.types import learn_folders

    learn_folders(options)
    kinds = _kinds(options)
    return [name for name in known_names() if name.split("/")[1] in kinds]


def _list(options: argparse.Namespace) -> Exit:
    names = _names(options)
    if options.json:
        print_json(names)
        return Exit.DONE
    for kind in _kinds(options):
        print(_TITLES[kind])
        for name in names:
            if name.split("/")[1] == kind:
                print(f"    {name}")
    return Exit.DONE


def _packages(options: argparse.Namespace) -> Exit:
    found = sorted({name.split("/")[0] for name in _names(options)})
    print_json(found) if options.json else print("\n".join(found))
    return Exit.DONE


def _package(options: argparse.Namespace) -> Exit:
    names = _names(options)
    found = [name for name in names if name.startswith(f"{options.package_name}/")]
    if not found:
        from actors.suggest import did_you_mean

        hint = did_you_mean(options.package_name, sorted({name.split("/")[0] for name in names}))
        raise CommandFailed(f"Unknown package '{options.package_name}'{hint}")
    print_json(found) if options.json else print("\n".join(found))
    return Exit.DONE


def _found(options: argparse.Namespace) -> Any:
    """The type that is asked for, whichever kind it is of."""
    from actors.interfaces import InterfaceError, known_names
    from actors.interfaces.naming import closest, full_name
    from actors.interfaces.registry import find
    from cli.types import learn_folders

    learn_folders(options)
    name = sys.stdin.readline().strip() if options.type == "-" else options.type
    try:
        found = next(
            (each for kind in ("msg", "srv", "action") if (each := find(full_name(name, kind))) is not None), None
        )
    except InterfaceError as error:
        raise CommandFailed(f"{name}: {error}") from None
    if found is None:
        names = known_names()
        package = name.split("/")[0]
        packages = {each.split("/")[0] for each in names}
        if package not in packages:
            raise CommandFailed(f"Unknown package '{package}'.{closest(package, packages)}")
        raise CommandFailed(f"Could not find the interface '{name}'.{closest(full_name(name), names)}")
    return found


def _show(options: argparse.Namespace) -> Exit:
    from actors.interfaces import show, type_description

    found = _found(options)
    if options.json:
        print_json(type_description(found))
    else:
        comments: Literal["top", "all", "none"] = (
            "all" if options.all_comments else "none" if options.no_comments else "top"
        )
        print(show(found, comments=comments), end="")
    return Exit.DONE


def _proto(options: argparse.Namespace) -> Exit:
    from cli.text import message_json, message_yaml

    found = _found(options)
    kind: Any = next((getattr(found, part) for part in ("Request", "Goal") if hasattr(found, part)), found)
    if options.json:
        print_json(message_json(kind()))
        return Exit.DONE
    text = message_yaml(kind(), None)
    print(text if options.no_quotes else f'"{text}"')
    return Exit.DONE
