"""From a launch file to a tree that runs: `Launch`, and `launch_tree` for what was planned."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path

from actors.launch.children import scope_supervisor
from actors.launch.context import LaunchContext
from actors.launch.errors import LaunchError
from actors.launch.launcher import Launcher
from actors.launch.loading import include_file
from actors.launch.looking import looking
from actors.launch.packages import Packages
from actors.launch.plan import Scope
from actors.launch.requests import Requests
from actors.launch.shim import shim
from actors.launch.show import tree_text
from actors.launch.substitution import shown
from actors.supervision.child import Child
from actors.supervision.declarations import Supervisor
from actors.supervision.policy import any_significant, transient


class Launch:
    """One launch file, evaluated: what it would start, and what is wrong. Nothing runs.

    `path` is that of the file; `arguments` are those of the file, name to text; `packages` say
    where executables and files are.

    Unless `lenient`, what cannot be evaluated raises `LaunchError` here. If it is, the rest is evaluated all the same, and `problems` tells
    what is wrong; such a launch can be shown, but not run, and nothing is written, run or sent
    for it: what would do so is left out, with a `NotDone` among the problems. With `stand_ins`, an empty node stands in for an executable that is not here.
    """

    def __init__(
        self,
        path: Path,
        arguments: Mapping[str, str] | None = None,
        *,
        packages: Packages | None = None,
        argv: Iterable[str] = (),
        lenient: bool = False,
        stand_ins: bool = False,
    ) -> None:
        self._context = context = LaunchContext(
            packages, arguments=arguments, argv=argv, lenient=lenient, stand_ins=stand_ins
        )
        plan = Scope("launch", "launch")
        self.is_broken = False
        """Whether the file itself cannot be read, so that nothing of it can be shown."""
        try:
            with shim(context), looking(lenient):
                include_file(path, context, plan)
        except LaunchError as error:
            if not lenient:
                raise
            context.note(error)
            self.is_broken = True
        self._plan = next((item for item in plan.items if isinstance(item, Scope)), plan)

    @property
    def problems(self) -> list[LaunchError]:
        """What is wrong, in the order in which it was found. Without `lenient` only what does not hinder a start, such as a missing file."""
        return self._context.problems

    @property
    def arguments(self) -> list[str]:
        """The names of the arguments that the file declares."""
        return list(self._context.declared)

    def show_arguments(self) -> str:
        """The arguments as text, in the form of `ros2 launch --show-args`."""
        return arguments_text(self._context)

    def show(self) -> str:
        """The tree, as text."""
        return tree_text(self._plan)

    def tree(self, write: Callable[[str], None] = print, on_ready: Callable[[], None] = lambda: None) -> Supervisor:
        """The supervisor tree, to be run once by `run`. It ends when nothing is left to do, or when a required executable has ended.

        `write` takes the lines that processes write, `on_ready` is called when the file says that it is ready for tests.
        """
        return launch_tree(self._plan, write, on_ready, Requests())


def launch_tree(
    plan: Scope, write: Callable[[str], None], on_ready: Callable[[], None], requests: Requests
) -> Supervisor:
    """The supervisor tree of a plan. Its last child carries it out, and so is the first to stop: it ends what it has started."""
    launcher = Child(
        Launcher, args=(plan, write, on_ready, requests), restart=transient, significant=True, stop=math.inf
    )
    return Supervisor("launch", children=[scope_supervisor(plan), launcher], auto_shutdown=any_significant)


def arguments_text(context: LaunchContext) -> str:
    """The arguments that were declared in a context, as `ros2 launch --show-args` lists them."""
    lines = ["Arguments (pass arguments as '<name>:=<value>'):"]
    for name, declared in context.declared.items():
        lines += ["", f"    {name!r}:{' *' if declared.conditional else ''}"]
        lines += [f"        {line}" for line in declared.description.splitlines()]
        if declared.default is not None:
            lines.append(f"        (default: {shown(declared.default)})")
    if not context.declared:
        lines += ["", "  No arguments."]
    if any(declared.conditional for declared in context.declared.values()):
        lines += ["", "* argument(s) which are only used if specific conditions occur"]
    return "\n".join(lines)
