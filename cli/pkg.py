"""`pkg list | executables | prefix | create`: packages with nodes, and the beginning of a new one."""

from __future__ import annotations

import argparse
from collections.abc import Sequence

from cli.command import CommandFailed, Exit
from cli.output import print_json
from cli.parsing import Verb, Verbs, add_json

__all__ = ["main", "verbs"]


def main(argv: Sequence[str]) -> int | Exit:
    """Run one verb of the group."""
    return verbs().run(argv)


def verbs() -> Verbs:
    """The verbs of the group."""
    group = Verbs("pkg", "Packages with nodes.")
    listing = group.add("list", "Output a list of available packages", lambda: _list)
    executables = group.add("executables", "Output a list of package specific executables", lambda: _executables)
    executables.add_argument("package_name", nargs="?", help="only of this one")
    executables.add_argument("--full-path", action="store_true", help="as path, or as MODULE:NODE")
    prefix = group.add("prefix", "Output the prefix path of a package", lambda: _prefix)
    prefix.add_argument("package_name", help="for instance my_robot_controller")
    prefix.add_argument("--share", action="store_true", help="the folder of its files")
    for parser in (listing, executables, prefix):
        parser.add_argument(
            "--package-path", action="append", default=[], metavar="DIR", help="a further folder of packages"
        )
    create = group.add("create", "Create a new ROS 2 package", _load_create)
    create.add_argument("package_name", help="lower case, digits and single underscores")
    create.add_argument("--package-format", "--package_format", type=int, default=3, choices=(2, 3))
    create.add_argument("--description", default="TODO: Package description")
    create.add_argument("--license", default="TODO: License declaration")
    create.add_argument("--destination-directory", default=".", metavar="DIR", help="where its folder is created (.)")
    create.add_argument(
        "--build-type",
        default="ament_cmake",
        choices=("cmake", "ament_cmake", "ament_cargo", "ament_python"),
        metavar="TOOL",
        help="cmake, ament_cmake (the default) or ament_python",
    )
    create.add_argument("--dependencies", nargs="+", default=[], metavar="PACKAGE")
    create.add_argument("--maintainer-email")
    create.add_argument("--maintainer-name")
    create.add_argument("--node-name", help="a node to begin with")
    create.add_argument("--library-name", help="a module, or a library, to begin with")
    for parser in (listing, executables, prefix, create):
        add_json(parser)
    return group


def _load_create() -> Verb:
    from cli.pkg_create import create

    return create


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
