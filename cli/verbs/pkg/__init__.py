"""`pkg list | executables | prefix | create`: packages with nodes, and the beginning of a new one."""

from __future__ import annotations

import argparse

from cli.command import CommandFailed, Exit
from cli.output import print_json
from cli.parsing import Parser, add_json
from cli.verb import Group, Verb


def _list_arguments(parser: Parser) -> None:
    parser.add_argument(
        "--package-path", action="append", default=[], metavar="DIR", help="a further folder of packages"
    )
    add_json(parser)


def _executables_arguments(parser: Parser) -> None:
    parser.add_argument("package_name", nargs="?", help="only of this one")
    parser.add_argument("--full-path", action="store_true", help="as path, or as MODULE:NODE")
    _list_arguments(parser)


def _prefix_arguments(parser: Parser) -> None:
    parser.add_argument("package_name", help="for instance my_robot_controller")
    parser.add_argument("--share", action="store_true", help="the folder of its files")
    _list_arguments(parser)


def _create_arguments(parser: Parser) -> None:
    parser.add_argument("package_name", help="lower case, digits and single underscores")
    parser.add_argument("--package-format", "--package_format", type=int, default=3, choices=(2, 3))
    parser.add_argument("--description", default="TODO: Package description")
    parser.add_argument("--license", default="TODO: License declaration")
    parser.add_argument("--destination-directory", default=".", metavar="DIR", help="where its folder is created (.)")
    parser.add_argument(
        "--build-type",
        default="ament_cmake",
        choices=("cmake", "ament_cmake", "ament_cargo", "ament_python"),
        metavar="TOOL",
        help="cmake, ament_cmake (the default) or ament_python",
    )
    parser.add_argument("--dependencies", nargs="+", default=[], metavar="PACKAGE")
    parser.add_argument("--maintainer-email")
    parser.add_argument("--maintainer-name")
    parser.add_argument("--node-name", help="a node to begin with")
    parser.add_argument("--library-name", help="a module, or a library, to begin with")
    add_json(parser)


def _list(options: argparse.Namespace) -> Exit:
    from actors.launch.packages import Packages

    names = Packages(options.package_path).names()
    print_json(names) if options.json else print("\n".join(names))
    return Exit.DONE


def _executables(options: argparse.Namespace) -> Exit:
    from actors.launch.packages import NodeTarget, Packages, UnknownPackage

    packages = Packages(options.package_path)
    names = packages.names() if options.package_name is None else [options.package_name]
    try:
        found = [each for name in names for each in packages.executables(name).values()]
    except UnknownPackage as error:
        raise CommandFailed(f"Package {str(error).removeprefix('package ')}") from None
    paths = [each.target if isinstance(each, NodeTarget) else str(each.path) for each in found]
    if options.json:
        print_json(
            [
                {"package": each.package, "name": each.name, "path": path}
                for each, path in zip(found, paths, strict=True)
            ]
        )
    else:
        for each, path in zip(found, paths, strict=True):
            print(path if options.full_path else f"{each.package} {each.name}")
    return Exit.DONE


def _prefix(options: argparse.Namespace) -> Exit:
    from actors.launch.packages import Packages, UnknownPackage

    packages = Packages(options.package_path)
    try:
        found = str((packages.share if options.share else packages.prefix)(options.package_name))
    except UnknownPackage as error:
        raise CommandFailed(f"Package {str(error).removeprefix('package ')}") from None
    print_json(found) if options.json else print(found)
    return Exit.DONE


COMMAND = Group(
    "pkg",
    "Packages with nodes.",
    Verb("list", "Output a list of available packages", _list_arguments, _list),
    Verb("executables", "Output a list of package specific executables", _executables_arguments, _executables),
    Verb("prefix", "Output the prefix path of a package", _prefix_arguments, _prefix),
    Verb("create", "Create a new ROS 2 package", _create_arguments, "cli.verbs.pkg.create:create"),
)
