"""`pkg create`: the folder of a new package, for ROS 2's tools and for this framework.

A Python package gets a node by entry point (group ``robactor.nodes``), so that ``run`` and launch files find it after ``pip install -e``. A
package of interfaces needs no build here: a definition in its folder ``msg``, ``srv`` or ``action`` is found with ``--interfaces``.
"""

from __future__ import annotations

import argparse
import getpass
import os
import shutil
import subprocess
from pathlib import Path
from xml.sax.saxutils import escape

from actors.interfaces.naming import is_package_name
from cli.command import CommandFailed, Exit
from cli.output import print_json
from cli.parsing import complain

PYTHON_TESTS = ("python3-pytest",)
CMAKE_TESTS = ("ament_lint_auto", "ament_lint_common")


def create(options: argparse.Namespace) -> Exit:
    """Write the files of a new package, and say which."""
    name, folder = options.package_name, Path(options.destination_directory, options.package_name)
    if not is_package_name(name):
        raise CommandFailed(
            f"{name!r} is no name of a package: lower case, digits and single underscores, a letter first"
        )
    if options.build_type == "ament_cargo":
        raise CommandFailed("--build-type ament_cargo is not written here: use ament_python, ament_cmake or cmake")
    if options.build_type == "ament_python" and name == "test":
        raise CommandFailed(
            "Aborted since 'ament_python' packages can't be named 'test'. Please choose a different package name."
        )
    if folder.exists():
        raise CommandFailed(
            f"\nAborted!\nThe directory already exists: {folder}\nEither remove the directory or choose a different "
            "destination directory or package name"
        )
    files = _python(options) if options.build_type == "ament_python" else _cmake(options)
    files = {"package.xml": _manifest(options), **files}
    if not options.json:
        _introduce(options)
    try:
        for path, text in files.items():
            target = folder / path
            target.parent.mkdir(parents=True, exist_ok=True)
            target.write_text(text, encoding="utf-8")
            if not options.json:
                print(f"creating {target}")
    except OSError as error:
        raise CommandFailed(f"unable to create folder: {options.destination_directory}: {error.strerror}") from None
    if options.json:
        print_json({"folder": str(folder), "files": list(files)})
    if options.license.startswith("TODO"):
        complain("[WARNING]: no license was given: write one into package.xml, such as Apache-2.0")
    return Exit.DONE


def _introduce(options: argparse.Namespace) -> None:
    print("going to create a new package")
    print(f"package name: {options.package_name}")
    print(f"destination directory: {os.path.abspath(options.destination_directory)}")
    print(f"package format: {options.package_format}")
    print("version: 0.0.0")
    print(f"description: {options.description}")
    print(f"maintainer: {[' '.join((_maintainer(options)[0], f'<{_maintainer(options)[1]}>'))]}")
    print(f"licenses: {[options.license]}")
    print(f"build type: {options.build_type}")
    print(f"dependencies: {options.dependencies}")
    if options.node_name:
        print(f"node_name: {options.node_name}")
    if options.library_name:
        print(f"library_name: {options.library_name}")


def _maintainer(options: argparse.Namespace) -> tuple[str, str]:
    name = options.maintainer_name or _git("user.name") or getpass.getuser()
    email = options.maintainer_email or _git("user.email") or f"{name.replace(' ', '')}@todo.todo"
    return name, email


def _git(key: str) -> str:
    """A value of git's configuration; empty without one."""
    if shutil.which("git") is None:
        return ""
    return subprocess.run(["git", "config", key], stdout=subprocess.PIPE, text=True, check=False).stdout.strip()


def _manifest(options: argparse.Namespace) -> str:
    name, email = _maintainer(options)
    tool = {"ament_cmake": ["ament_cmake"]}.get(options.build_type, [])
    tests = {"ament_cmake": CMAKE_TESTS, "ament_python": PYTHON_TESTS}.get(options.build_type, ())
    depends = [f"  <buildtool_depend>{each}</buildtool_depend>" for each in tool]
    depends += [f"  <depend>{escape(each)}</depend>" for each in options.dependencies]
    depends += [f"  <test_depend>{each}</test_depend>" for each in tests]
    lines = "\n".join(depends)
    schema = f"http://download.ros.org/schema/package_format{options.package_format}.xsd"
    return f"""\
<?xml version="1.0"?>
<?xml-model href="{schema}" schematypens="http://www.w3.org/2001/XMLSchema"?>
<package format="{options.package_format}">
  <name>{options.package_name}</name>
  <version>0.0.0</version>
  <description>{escape(options.description)}</description>
  <maintainer email="{escape(email)}">{escape(name)}</maintainer>
  <license>{escape(options.license)}</license>

{lines}

  <export>
    <build_type>{options.build_type}</build_type>
  </export>
</package>
"""


def _python(options: argparse.Namespace) -> dict[str, str]:
    """The files of a Python package."""
    name, node = options.package_name, options.node_name
    maintainer, email = _maintainer(options)
    scripts = [f"{node} = {name}.{node}:main"] if node else []
    nodes = [f"{name} = {name}"] + ([f"{name}.{node} = {name}.{node}:{_class(node)}"] if node else [])
    files = {
        f"{name}/__init__.py": "",
        f"resource/{name}": "",
        "setup.cfg": f"[develop]\nscript_dir=$base/lib/{name}\n[install]\ninstall_scripts=$base/lib/{name}\n",
        "setup.py": f"""\
from setuptools import find_packages, setup

package_name = {name!r}

setup(
    name=package_name,
    version='0.0.0',
    packages=find_packages(exclude=['test']),
    data_files=[
        ('share/ament_index/resource_index/packages', ['resource/' + package_name]),
        ('share/' + package_name, ['package.xml']),
    ],
    install_requires=['setuptools'],
    zip_safe=True,
    maintainer={maintainer!r},
    maintainer_email={email!r},
    description={options.description!r},
    license={options.license!r},
    entry_points={{
        'console_scripts': {scripts!r},
        'robactor.nodes': {nodes!r},
    }},
)
""",
    }
    if node:
        files[f"{name}/{node}.py"] = _node_text(node)
    if options.library_name:
        files[f"{name}/{options.library_name}/__init__.py"] = ""
    return files


def _class(node: str) -> str:
    return "".join(part[:1].upper() + part[1:] for part in node.split("_"))


def _node_text(node: str) -> str:
    return f"""\
from actors import Node, spin


class {_class(node)}(Node):
    async def on_start(self) -> None:
        self.log.info("Hi from {node}.")


def main() -> None:
    spin({_class(node)})


if __name__ == "__main__":
    main()
"""


def _cmake(options: argparse.Namespace) -> dict[str, str]:
    """The files of a package that CMake builds, such as one of interfaces."""
    name, node, library = options.package_name, options.node_name, options.library_name
    found = "\n".join(f"find_package({each} REQUIRED)" for each in ("ament_cmake", *options.dependencies))
    lines = [found if options.build_type == "ament_cmake" else found.partition("\n")[2]]
    files: dict[str, str] = {f"include/{name}/.gitkeep": "", "src/.gitkeep": ""}
    if library:
        lines.append(f"add_library({library} src/{library}.cpp)\ninstall(TARGETS {library} DESTINATION lib)")
        files[f"src/{library}.cpp"] = f"// The library {library} of {name}.\n"
    if node:
        lines.append(
            f"add_executable({node} src/{node}.cpp)\ninstall(TARGETS {node} DESTINATION lib/${{PROJECT_NAME}})"
        )
        files[f"src/{node}.cpp"] = (
            f'#include <cstdio>\n\nint main()\n{{\n  printf("hello world {name} package\\n");\n  return 0;\n}}\n'
        )
    if options.build_type == "ament_cmake":
        lines.append("ament_package()")
    body = "\n\n".join(line for line in lines if line)
    files["CMakeLists.txt"] = f"cmake_minimum_required(VERSION 3.20)\nproject({name})\n\n{body}\n"
    return files
