"""What `interface list | packages | package | show | proto` print."""

from __future__ import annotations

import argparse
import sys
from typing import Any, Literal

from cli.command import CommandFailed, Exit
from cli.output import print_json

_TITLES = {"msg": "Messages:", "srv": "Services:", "action": "Actions:"}


def _kinds(options: argparse.Namespace) -> list[str]:
    wanted = {"msg": options.only_msgs, "srv": options.only_srvs, "action": options.only_actions}
    return [kind for kind, given in wanted.items() if given] or list(wanted)


def _names(options: argparse.Namespace) -> list[str]:
    """The full names of the types of the kinds that are wanted."""
    from actors.interfaces import known_names
    from cli.graph.types import learn_folders

    learn_folders(options)
    kinds = _kinds(options)
    return [name for name in known_names() if name.split("/")[1] in kinds]


def list_types(options: argparse.Namespace) -> Exit:
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


def packages(options: argparse.Namespace) -> Exit:
    found = sorted({name.split("/")[0] for name in _names(options)})
    print_json(found) if options.json else print("\n".join(found))
    return Exit.DONE


def package(options: argparse.Namespace) -> Exit:
    names = _names(options)
    found = [name for name in names if name.startswith(f"{options.package_name}/")]
    if not found:
        from actors.suggest import did_you_mean

        hint = did_you_mean(options.package_name, sorted({name.split("/")[0] for name in names}))
        raise CommandFailed(f"Unknown package '{options.package_name}'{hint}")
    print_json(found) if options.json else print("\n".join(found))
    return Exit.DONE


def _only_one(last: str) -> str:
    """The full name of the only type with this name, whatever its package. Raises CommandFailed if there are none or several."""
    from actors.interfaces import known_names
    from actors.suggest import did_you_mean

    names = known_names()
    found = [name for name in names if name.rpartition("/")[2] == last]
    if len(found) == 1:
        return found[0]
    if found:
        raise CommandFailed(f"{last} is the name of {len(found)} types; write one of {', '.join(found)}")
    hint = did_you_mean(last, sorted({name.rpartition("/")[2] for name in names}))
    raise CommandFailed(f"there is no type {last}{hint or '; write package/msg/Name, as in std_msgs/msg/String'}")


def _found(options: argparse.Namespace) -> Any:
    """The type that is asked for, whichever kind it is of."""
    from actors.interfaces import InterfaceError, known_names
    from actors.interfaces.lookup import find
    from actors.interfaces.naming import closest, full_name
    from cli.graph.types import learn_folders

    learn_folders(options)
    name = sys.stdin.readline().strip() if options.type == "-" else options.type
    if name.isidentifier():
        name = _only_one(name)
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


def show(options: argparse.Namespace) -> Exit:
    from actors.interfaces import show as definition
    from actors.interfaces import type_description

    found = _found(options)
    if options.json:
        print_json(type_description(found))
    else:
        comments: Literal["top", "all", "none"] = (
            "all" if options.all_comments else "none" if options.no_comments else "top"
        )
        print(definition(found, comments=comments), end="")
    return Exit.DONE


def proto(options: argparse.Namespace) -> Exit:
    from cli.text import message_json, message_yaml

    found = _found(options)
    kind: Any = next((getattr(found, part) for part in ("Request", "Goal") if hasattr(found, part)), found)
    if options.json:
        print_json(message_json(kind()))
        return Exit.DONE
    text = message_yaml(kind(), None)
    print(text if options.no_quotes else f'"{text}"')
    return Exit.DONE
