"""Actions that start something: the executables of packages, and programs as they are."""

from __future__ import annotations

import re
import shlex
from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING, Any

from actors.launch.actions.events import Shutdown
from actors.launch.entity import Action, one_or_more
from actors.launch.errors import LaunchError
from actors.launch.plan import Job, NodeSpec, Process, Scope
from actors.launch.substitution import Number, Text, Truth, as_bool, normalized, perform

if TYPE_CHECKING:
    from actors.launch.conditions import Condition
    from actors.launch.context import LaunchContext


class ExecuteProcess(Action):
    """Starts a program: `cmd` is its path and its arguments, each of them a text or a list of texts that are joined.

    `respawn` starts it again whenever it ends, `respawn_delay` seconds later, at most `respawn_max_retries` times (-1: without limit).
    `on_exit` are actions for its end, or a function that gives them.
    """

    def __init__(
        self,
        *,
        cmd: Iterable[Text],
        name: Text | None = None,
        prefix: Text | None = None,
        cwd: Text | None = None,
        env: Mapping[Text, Text] | None = None,
        additional_env: Mapping[Any, Text] | None = None,
        shell: Truth = False,
        sigterm_timeout: Number | None = None,
        sigkill_timeout: Number | None = None,
        emulate_tty: Truth = False,
        output: Text | Mapping[str, str] = "log",
        output_format: str = "",
        cached_output: bool = False,
        log_cmd: bool = False,
        on_exit: object = None,
        respawn: Truth = False,
        respawn_delay: Number | None = None,
        respawn_max_retries: int = -1,
        condition: Condition | None = None,
    ) -> None:
        super().__init__(condition=condition)
        self.process_details: Mapping[str, object] | None = None
        self.cmd = [normalized(part) for part in cmd]
        self.name = None if name is None else normalized(name)
        self.prefix = None if prefix is None else normalized(prefix)
        self.cwd = None if cwd is None else normalized(cwd)
        self.env, self.additional_env = env, dict(additional_env or {})
        self.shell, self.output = shell, output
        self.emulate_tty, self.output_format, self.cached_output, self.log_cmd = (
            emulate_tty,
            output_format,
            cached_output,
            log_cmd,
        )
        self.sigterm_timeout, self.sigkill_timeout = sigterm_timeout, sigkill_timeout
        self.on_exit = on_exit
        self.respawn, self.respawn_delay, self.respawn_max_retries = respawn, respawn_delay, respawn_max_retries

    def plan(self, context: LaunchContext, scope: Scope) -> None:
        words = [perform(context, part) for part in self.cmd]
        if not words:
            raise LaunchError("cmd is empty: there is no program to start")
        shown = perform(context, self.name) if self.name is not None else _basename(words[0])
        scope.items.append(self.job(context, shown, cmd=words))

    def job(self, context: LaunchContext, name: str, node: NodeSpec | None = None, cmd: list[str] | None = None) -> Job:
        """The job that starts it, labelled by `name` and a number; `cmd` is the command of a process."""
        environment = context.environment if self.env is None else self._texts(context, self.env)
        environment = {**environment, **self._texts(context, self.additional_env)}
        output = "both" if isinstance(self.output, Mapping) else perform(context, self.output)
        process = Process(
            [] if cmd is None else [*self._prefix(context, name), *cmd],
            environment,
            None if self.cwd is None else perform(context, self.cwd),
            as_bool(context, self.shell),
            output,
            as_bool(context, context.launch_configurations.get("emulate_tty", self.emulate_tty)),
            as_bool(context, self.log_cmd),
            self._seconds(context, self.sigterm_timeout, "sigterm_timeout"),
            self._seconds(context, self.sigkill_timeout, "sigkill_timeout"),
        )
        return Job(
            label=f"{name}-{context.next_number()}",
            action=self,
            node=node,
            process=process,
            respawn=as_bool(context, self.respawn),
            respawn_delay=0.0 if self.respawn_delay is None else _number(context, self.respawn_delay),
            respawn_max_retries=int(self.respawn_max_retries),
            required=_ends_launch(self.on_exit),
            on_exit=self.on_exit,
            context=context.fork(),
            line=self.line,
        )

    def _prefix(self, context: LaunchContext, name: str) -> list[str]:
        if self.prefix is not None:
            return shlex.split(perform(context, self.prefix))
        known = context.launch_configurations
        if not re.match(known.get("launch-prefix-filter", ""), name):
            return []
        return shlex.split(known.get("launch-prefix", ""))

    def _texts(self, context: LaunchContext, texts: Mapping[Text, Text]) -> dict[str, str]:
        return {perform(context, name): perform(context, value) for name, value in texts.items()}

    def _seconds(self, context: LaunchContext, value: Number | None, name: str) -> float:
        text = context.launch_configurations.get(name, "5") if value is None else value
        return _number(context, text)


def _basename(command: str) -> str:
    return command.split()[0].rpartition("/")[2] if command.split() else command


def _ends_launch(on_exit: object) -> bool:
    given = one_or_more(on_exit)
    return bool(given) and all(isinstance(each, Shutdown) and each.condition is None for each in given)


def _number(context: LaunchContext, value: Number) -> float:
    if isinstance(value, (int, float)):
        return float(value)
    text = perform(context, value)
    try:
        return float(text)
    except ValueError:
        raise LaunchError(f"{text!r} is no number of seconds") from None
