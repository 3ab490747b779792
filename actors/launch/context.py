"""`LaunchContext`: what is set while a launch description is evaluated."""

from __future__ import annotations

import os
from collections.abc import Callable, Generator, Iterable, Mapping, MutableMapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from itertools import count
from pathlib import Path
from types import SimpleNamespace
from typing import NamedTuple

from actors.launch.errors import LaunchError, Line
from actors.launch.packages import Packages
from actors.launch.substitution import Text, perform


@dataclass
class Scoped:
    """What a group brings back to what it was when it ends."""

    configurations: dict[str, str]
    environment: MutableMapping[str, str]
    remaps: list[tuple[str, str]] = field(default_factory=list[tuple[str, str]])
    parameters: list[object] = field(default_factory=list[object])
    """Global parameters in the order in which they were set: ``(name, value)`` pairs and paths of files."""

    def copy(self) -> Scoped:
        return Scoped(dict(self.configurations), dict(self.environment), list(self.remaps), list(self.parameters))


class Declared(NamedTuple):
    """A launch argument that was met; `conditional` if it is declared only under a condition."""

    description: str
    default: Text | None
    conditional: bool


class LaunchContext:
    """The state of one evaluation of a launch description.

    With `lenient`, what cannot be found out (a package that is not here, a command that fails) is noted in `problems` and stood in for by
    a text, so that the rest can be shown; else it is raised as a `LaunchError`.

    Invariants: `scoped` is the innermost of the scopes that are open; `_outer` holds those around it, the outermost first.
    """

    def __init__(
        self,
        packages: Packages | None = None,
        *,
        arguments: Mapping[str, str] | None = None,
        environment: Mapping[str, str] | None = None,
        argv: Iterable[str] = (),
        lenient: bool = False,
        stand_ins: bool = False,
    ) -> None:
        self.packages = Packages() if packages is None else packages
        self.argv = list(argv)
        self.lenient = lenient
        self.stand_ins = stand_ins
        """Whether an empty node stands in for an executable that is not here."""
        self.scoped = Scoped(dict(arguments or {}), dict(os.environ if environment is None else environment))
        self._first_environment = dict(self.scoped.environment)
        self.problems: list[LaunchError] = []
        self.declared: dict[str, Declared] = {}
        self.locals = SimpleNamespace()
        """What a substitution such as ``$(local event.reason)`` sees: in an event handler, `event`."""
        self.file: Path | None = None
        """The launch file that is being evaluated."""
        self.line: Line | None = None
        """The line of the action that is being evaluated."""
        self.anonymous: dict[str, str] = {}
        self.depth = 0
        """How many launch files include this one."""
        self.noted: set[Path] = set()
        """The launch files that are not included here, of which the arguments have been noted."""
        self.is_shutdown = False
        self.absent_modules = False
        """Whether something stands in for a Python module that is not installed, which has been noted."""
        self.only_shown = False
        """Whether this is about what would be done later: no function and no command of the user's is called."""
        self._numbers = count(1)
        self._outer: list[Scoped] = []
        self._environments: list[dict[str, str]] = []

    # -- the words of ROS 2 -------------------------------------------------------------------------------------------------

    @property
    def launch_configurations(self) -> dict[str, str]:
        """The launch configurations that are set, arguments included."""
        return self.scoped.configurations

    @property
    def environment(self) -> MutableMapping[str, str]:
        """The environment variables for processes that are started from here on."""
        return self.scoped.environment

    @environment.setter
    def environment(self, variables: Mapping[str, str]) -> None:
        _make_equal(self.scoped.environment, variables)

    @contextmanager
    def as_own_environment(self) -> Generator[None]:
        """Make ``os.environ`` the environment of this context, for launch files in Python read and set it there; then as it was before."""
        before, own = dict(os.environ), self.scoped.environment
        _make_equal(os.environ, own)
        self.scoped.environment = os.environ
        try:
            yield
        finally:
            self.scoped.environment = dict(os.environ)
            _make_equal(os.environ, before)

    def reset_environment(self) -> None:
        """Make the environment what it was when the launch began."""
        self.environment = self._first_environment

    def perform_substitution(self, substitution: Text) -> str:
        """The text that a substitution stands for."""
        return perform(self, substitution)

    def extend_globals(self, values: Mapping[str, object]) -> None:
        """Make values visible to all substitutions from here on."""
        vars(self.locals).update(values)

    extend_locals = extend_globals

    def get_locals_as_dict(self) -> dict[str, object]:
        """What `locals` holds."""
        return dict(vars(self.locals))

    # -- scopes -------------------------------------------------------------------------------------------------------------

    def push(self) -> None:
        """Open a scope."""
        self._outer.append(self.scoped.copy())

    def pop(self) -> None:
        """Close the innermost scope: what was set in it is as it was."""
        if not self._outer:
            raise LaunchError("there is no scope to end: a Pop action without its Push action", self.line)
        outer, environment = self._outer.pop(), self.scoped.environment
        _make_equal(environment, outer.environment)
        self.scoped = outer
        self.scoped.environment = environment

    def push_environment(self) -> None:
        """Remember the environment."""
        self._environments.append(dict(self.environment))

    def pop_environment(self) -> None:
        """Bring back the environment last remembered."""
        if not self._environments:
            raise LaunchError(
                "there is no environment to bring back: PopEnvironment without PushEnvironment", self.line
            )
        self.environment = self._environments.pop()

    def fork(self) -> LaunchContext:
        """A context with the state of this one, for actions that are evaluated later."""
        other = LaunchContext(self.packages, argv=self.argv, lenient=self.lenient, stand_ins=self.stand_ins)
        other.scoped, other._first_environment = self.scoped.copy(), self._first_environment
        other.locals = SimpleNamespace(**vars(self.locals))
        other.only_shown, other.absent_modules = self.only_shown, self.absent_modules
        other.file, other.line, other.anonymous = self.file, self.line, self.anonymous
        other.problems, other.declared, other.depth = self.problems, self.declared, self.depth
        other._numbers = self._numbers
        return other

    def next_number(self) -> int:
        """The number of the next executable of this launch, from 1."""
        return next(self._numbers)

    # -- problems -----------------------------------------------------------------------------------------------------------

    def stand_in(self, error: LaunchError, text: str) -> str:
        """Note the problem and return the text that stands in for what is not known. Raises the error unless the context is lenient."""
        if not self.lenient:
            raise error.at(self.line)
        self.note(error)
        return text

    def note(self, error: LaunchError) -> None:
        """Note a problem, once."""
        placed = error.at(self.line)
        if self.absent_modules and "Unknown" in error.problem:
            return  # what the stand-in cannot do is no problem of its own
        if str(placed) not in map(str, self.problems):
            self.problems.append(placed)

    def look_up(self, find: Callable[[], str], text: str) -> str:
        """What `find` finds; the text that stands in for it, where a package or a file is not here."""
        try:
            return find()
        except LookupError as error:
            return self.stand_in(LaunchError(str(error.args[0])), text)


def _make_equal(variables: MutableMapping[str, str], wanted: Mapping[str, str]) -> None:
    for name in set(variables) - set(wanted):
        del variables[name]
    for name, value in wanted.items():
        if variables.get(name) != value:
            variables[name] = value
