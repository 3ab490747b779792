"""Substitutions for files: paths, packages, programs, what is in a file, and what a command prints."""

from __future__ import annotations

import os
import shlex
import shutil
import subprocess
from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING

from actors.launch.errors import LaunchError, SubstitutionFailure
from actors.launch.packages import Program
from actors.launch.packages_api import context_here
from actors.launch.substitution import Substitution, Text, normalized, perform, shown

if TYPE_CHECKING:
    from actors.launch.context import LaunchContext

COMMAND = "$(command "
"""How the text begins that stands for what a command would print."""

COMMAND_SECONDS = 60.0
"""How long a command may take that is started to make a text."""


class PathSubstitution(Substitution):
    """A path. ``path / "launch" / name`` is the path of a file below it."""

    def __init__(self, path: Text) -> None:
        self.path = normalized(path)

    def perform(self, context: LaunchContext) -> str:
        return perform(context, self.path)

    def __truediv__(self, other: Text) -> PathJoinSubstitution:
        return PathJoinSubstitution([[self], other])

    def describe(self) -> str:
        return f"Path({shown(self.path)})"


class PathJoinSubstitution(PathSubstitution):
    """The parts of a path, joined as `os.path.join` does."""

    def __init__(self, substitutions: Iterable[Text]) -> None:
        self.parts = [normalized(part) for part in substitutions]
        super().__init__([one for part in self.parts for one in part])

    def perform(self, context: LaunchContext) -> str:
        return os.path.join(*(perform(context, part) for part in self.parts))

    def __truediv__(self, other: Text) -> PathJoinSubstitution:
        return PathJoinSubstitution([*self.parts, other])

    def describe(self) -> str:
        return f"PathJoin({', '.join(map(shown, self.parts))})"


class FindPackage(PathSubstitution):
    """A folder of a package: where its files are."""

    word = "find-pkg-share"

    def __init__(self, package: Text) -> None:
        super().__init__(package)
        self.package = self.path

    def perform(self, context: LaunchContext) -> str:
        name = perform(context, self.package)
        return context.look_up(lambda: str(self.folder(context, name)), f"$({self.word} {name})")

    def find(self, package_name: str) -> str:
        """The folder of another package, at once. Raises `LaunchError`."""
        context = context_here()
        return context.look_up(lambda: str(self.folder(context, package_name)), f"$({self.word} {package_name})")

    def folder(self, context: LaunchContext, package: str) -> Path:
        """The folder. Raises `LookupError`."""
        return context.packages.share(package)

    def describe(self) -> str:
        return f"{type(self).__name__}({shown(self.package)})"


class FindPackageShare(FindPackage):
    """The share folder of a package."""


class FindPackagePrefix(FindPackage):
    """The prefix below which a package is installed."""

    word = "find-pkg-prefix"

    def folder(self, context: LaunchContext, package: str) -> Path:
        """The prefix. Raises `LookupError`."""
        return context.packages.prefix(package)


class ExecutableInPackage(Substitution):
    """The path of a program of a package."""

    def __init__(self, executable: Text, package: Text) -> None:
        self.executable, self.package = normalized(executable), normalized(package)

    def perform(self, context: LaunchContext) -> str:
        executable, package = perform(context, self.executable), perform(context, self.package)

        def find() -> str:
            found = context.packages.find(package, executable)
            if isinstance(found, Program):
                return str(found.path)
            raise LookupError(f"{executable!r} of {package!r} is a node of this framework, no program with a path")

        return context.look_up(find, f"$(exec-in-pkg {executable} {package})")

    def describe(self) -> str:
        return f"ExecInPackage({shown(self.executable)}, {shown(self.package)})"


class FindExecutable(Substitution):
    """The path of a program on the PATH."""

    def __init__(self, *, name: Text) -> None:
        self.name = normalized(name)

    def perform(self, context: LaunchContext) -> str:
        name = perform(context, self.name)
        found = shutil.which(name, path=context.environment.get("PATH"))
        return found or context.stand_in(_no_program([name]), name)

    def describe(self) -> str:
        return f"FindExec({shown(self.name)})"


class ThisLaunchFile(PathSubstitution):
    """The path of the launch file in which it stands."""

    def __init__(self) -> None:
        super().__init__("")

    def perform(self, context: LaunchContext) -> str:
        if context.file is None:
            raise SubstitutionFailure("there is no launch file here")
        return str(context.file)

    def describe(self) -> str:
        return f"{type(self).__name__}()"


class ThisLaunchFileDir(ThisLaunchFile):
    """The folder of the launch file in which it stands."""

    def perform(self, context: LaunchContext) -> str:
        return str(Path(super().perform(context)).parent)


class FileContent(Substitution):
    """What is in a file."""

    def __init__(self, path: Text) -> None:
        self.path = normalized(path)

    def perform(self, context: LaunchContext) -> str:
        path = perform(context, self.path)
        try:
            return Path(path).read_text(encoding="utf-8")
        except (OSError, UnicodeDecodeError) as error:
            return context.stand_in(SubstitutionFailure(f"{path} cannot be read: {error}"), f"$(file-content {path})")

    def describe(self) -> str:
        return f"FileContent({shown(self.path)})"


class Command(Substitution):
    """What a command prints. `on_stderr` says what happens if it writes to stderr: ``fail``, ``warn``, ``ignore`` or ``capture``."""

    def __init__(self, command: Text, *, on_stderr: Text = "fail") -> None:
        self.command, self.on_stderr = normalized(command), normalized(on_stderr)

    def perform(self, context: LaunchContext) -> str:
        command, on_stderr = perform(context, self.command), perform(context, self.on_stderr)
        if on_stderr not in ("fail", "warn", "ignore", "capture"):
            raise SubstitutionFailure(f"on_stderr is fail, warn, ignore or capture, not {on_stderr!r}")
        try:
            words = shlex.split(command)
            if context.lenient:  # which only looks: it does not run what could act
                program = shutil.which(words[0], path=context.environment.get("PATH")) if words else None
                return _sign(command) if program else context.stand_in(_no_program(words), _sign(command))
            ran = subprocess.run(
                words,
                stdout=subprocess.PIPE,
                stderr=subprocess.STDOUT if on_stderr == "capture" else subprocess.PIPE,
                text=True,
                env=context.environment,
                timeout=COMMAND_SECONDS,
                check=False,
            )
        except (OSError, ValueError, subprocess.TimeoutExpired) as error:
            return context.stand_in(SubstitutionFailure(f"the command {command!r} failed: {error}"), _sign(command))
        if ran.returncode or (ran.stderr and on_stderr == "fail"):
            told = (ran.stderr or "").strip() or f"exit code {ran.returncode}"
            return context.stand_in(SubstitutionFailure(f"the command {command!r} failed: {told}"), _sign(command))
        if ran.stderr and on_stderr == "warn":
            context.note(LaunchError(f"the command {command!r} says: {ran.stderr.strip()}"))
        return ran.stdout

    def describe(self) -> str:
        return f"Command({shown(self.command)})"


def _no_program(words: list[str]) -> SubstitutionFailure:
    return SubstitutionFailure(f"no program {(words or [''])[0]!r} on the PATH")


def _sign(command: str) -> str:
    return f"{COMMAND}'{command}')"
