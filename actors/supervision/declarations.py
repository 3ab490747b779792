"""The declaration of a tree: its supervisors and nodes, their order, and what happens when one of them ends.

Everything here is an immutable value without a running part. One tree can be run any number of times, also at once.
The rules are those of Erlang/OTP's `supervisor`; `actors.supervision.running` runs a tree by them.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any, ClassVar, TypeAlias, cast

from actors.checks import (
    checked_choice,
    checked_flag,
    checked_name,
    checked_sequence,
    class_of_node,
    factory_name,
    is_whole,
    shown,
)
from actors.errors import DeclarationError
from actors.supervision.child import Child, check_policy
from actors.supervision.declaration import Declaration
from actors.supervision.policy import (
    AutoShutdown,
    Backoff,
    Intensity,
    Kind,
    Restart,
    StopTimeout,
    Strategy,
    never,
    one_for_one,
    permanent,
)
from actors.supervision.process_options import HANG_SECONDS, check_crossing, check_process, checked_hosts, why_crossing


class Supervisor(Declaration):
    """An ordered group of children with one policy: ``Supervisor("robot", Battery, Child(Listener, name="ear"))``. Supervisors nest.

    The children follow the name, or are listed in `children`; a class stands for ``Child(class)``.
    Children start in order, each after the one before is ready, and stop in strict reverse order. `strategy` says which
    children are restarted with one that failed, `intensity` how often before the supervisor gives up, `auto_shutdown`
    whether the end of significant children ends it. `restart`, `stop`, `backoff` and `significant` are for its own
    supervisor, as those of a `Child`; `stop=None` waits for its children without limit. With `process` it runs with all its
    children in an interpreter of its own, as a `Child` does, and with `host` or `hosts` on another machine; its children cannot be changed by
    requests from outside then.
    Raises `DeclarationError`, which names the option, or the options that do not go together.
    """

    __slots__ = (
        "auto_shutdown",
        "backoff",
        "children",
        "hang",
        "hosts",
        "intensity",
        "name",
        "process",
        "restart",
        "significant",
        "stop",
        "strategy",
    )
    _stored_defaults: ClassVar[dict[str, object]] = {"stop": math.inf, "children": ()}
    name: str
    strategy: Strategy
    intensity: Intensity
    children: tuple[Spec, ...]
    auto_shutdown: AutoShutdown
    restart: Restart
    stop: StopTimeout
    backoff: Backoff | None
    significant: bool
    process: bool
    hang: float
    hosts: tuple[str, ...]

    def __init__(
        self,
        name: str,
        *given: Spec | type[object] | Sequence[Spec | type[object]],
        children: Sequence[Spec | type[object]] = (),
        strategy: Strategy = one_for_one,
        intensity: Intensity = Intensity(),  # noqa: B008  # it is immutable
        auto_shutdown: AutoShutdown = never,
        restart: Restart = permanent,
        stop: StopTimeout | None = None,
        backoff: Backoff | None = None,
        significant: bool = False,
        process: bool = False,
        hang: float = HANG_SECONDS,
        host: str | None = None,
        hosts: Sequence[str] = (),
    ) -> None:
        where = f"Supervisor({shown(name)})"
        stop = math.inf if stop is None else stop
        checked_choice(where, "strategy", strategy, Strategy)
        _check_own_options(where, intensity, auto_shutdown)
        check_policy(where, restart, stop, backoff, significant)
        away = checked_hosts(where, host, hosts)
        process = process or bool(away)
        check_process(where, process, hang)
        self._set(
            name=checked_name(where, name),
            strategy=strategy,
            intensity=intensity,
            children=_checked_children(where, given, children, auto_shutdown),
            auto_shutdown=auto_shutdown,
            restart=restart,
            stop=stop,
            backoff=backoff,
            significant=checked_flag(where, "significant", significant),
            process=process,
            hang=hang,
            hosts=away,
        )
        if process:
            why = why_crossing(away) if away else f"{where} has process=True"
            _check_crossing(why, self, away=bool(away))

    @property
    def kind(self) -> Kind:
        return "supervisor"

    def check_child(self, child: Spec) -> None:
        """Raise `DeclarationError` unless `child` can become a child of this supervisor."""
        check_child(f"Supervisor({self.name!r})", child, self.auto_shutdown)

    def _positional(self) -> list[str]:
        return [repr(self.name)]


class DynamicSupervisor(Declaration):
    """A supervisor whose children are instances of one `template`, each with its own arguments, spawned while it runs.

    It starts without children. A class as the template stands for ``Child(class)``. Instances restart one for one, stop together, and are
    forgotten when they have ended for good. `max_children` is the most that it has at once, those being restarted included. The other
    options are those of `Supervisor`.
    """

    __slots__ = (
        "auto_shutdown",
        "backoff",
        "intensity",
        "max_children",
        "name",
        "restart",
        "significant",
        "stop",
        "template",
    )
    _stored_defaults: ClassVar[dict[str, object]] = {"stop": math.inf}
    name: str
    template: Child
    max_children: int | None
    intensity: Intensity
    auto_shutdown: AutoShutdown
    restart: Restart
    stop: StopTimeout
    backoff: Backoff | None
    significant: bool

    def __init__(
        self,
        name: str,
        template: Child | type[object],
        *,
        max_children: int | None = None,
        intensity: Intensity = Intensity(),  # noqa: B008  # it is immutable
        auto_shutdown: AutoShutdown = never,
        restart: Restart = permanent,
        stop: StopTimeout | None = None,
        backoff: Backoff | None = None,
        significant: bool = False,
    ) -> None:
        where = f"DynamicSupervisor({shown(name)})"
        stop = math.inf if stop is None else stop
        made = child_of(template)
        if not isinstance(made, Child):
            raise DeclarationError(f"{where}: template must be a Child, not {shown(template)}{_hint(template)}")
        if max_children is not None and (not is_whole(max_children) or max_children < 0):
            raise DeclarationError(f"{where}: max_children must be None or a whole number, not {shown(max_children)}")
        _check_own_options(where, intensity, auto_shutdown)
        check_child(where, made, auto_shutdown)
        check_policy(where, restart, stop, backoff, significant)
        self._set(
            name=checked_name(where, name),
            template=made,
            max_children=max_children,
            intensity=intensity,
            auto_shutdown=auto_shutdown,
            restart=restart,
            stop=stop,
            backoff=backoff,
            significant=checked_flag(where, "significant", significant),
        )

    @property
    def kind(self) -> Kind:
        return "supervisor"

    @property
    def strategy(self) -> Strategy:
        return one_for_one

    def instance(self, name: str, args: Sequence[object] = (), parameters: Mapping[str, object] | None = None) -> Child:
        """The template as a child called `name`. `args` follow the template's own, `parameters` override its own one by one."""
        template = self.template
        changes: dict[str, object] = {"name": checked_name(f"DynamicSupervisor({self.name!r}): instance", name)}
        if args:
            changes["args"] = (*template.args, *args)
        if parameters:
            changes["parameters"] = {**template.parameters, **parameters}
        if template.process:
            check_crossing(
                f"DynamicSupervisor({self.name!r}): instance {name!r}",
                template.factory,
                args,
                parameters or {},
                why_crossing(template.hosts),
                away=bool(template.hosts),
            )
        return template.varied(**changes)  # all but the name has been checked with the template

    def _positional(self) -> list[str]:
        return [repr(self.name), repr(self.template)]


Spec: TypeAlias = Child | Supervisor | DynamicSupervisor
"""The declaration of a child of any kind."""


def check_child(where: str, child: object, auto_shutdown: AutoShutdown) -> None:
    """Raise `DeclarationError` for an object that is no child, and for a significant child where significance has no effect."""
    if not isinstance(child, (Child, Supervisor, DynamicSupervisor)):
        raise DeclarationError(f"{where}: a child must be a Child or a Supervisor, not {shown(child)}{_hint(child)}")
    if child.significant and auto_shutdown == never:
        raise DeclarationError(
            f"{where}: child {child.name!r} has significant=True, but auto_shutdown=never ignores it: "
            "set auto_shutdown=any_significant or all_significant, or drop significant"
        )


def child_of(given: Spec | type[object]) -> Spec:
    """What is given as a child: a class stands for ``Child(class)``; anything else is returned as it is."""
    return Child(given) if isinstance(given, type) and not issubclass(given, Declaration) else cast("Spec", given)


def _hint(child: object) -> str:
    """What to write in place of a factory or a node; empty for anything else."""
    name = class_of_node(child) or (factory_name(child) if callable(child) else None)
    return f"; write Child({name}), which makes the node" if name else ""


def _checked_children(
    where: str, given: Sequence[object], listed: Sequence[Spec | type[object]], auto_shutdown: AutoShutdown
) -> tuple[Spec, ...]:
    if isinstance(listed, (type, Declaration)):
        single = f"Child({factory_name(listed)})" if isinstance(listed, type) else shown(listed)
        raise DeclarationError(f"{where}: children must be a list, write children=[{single}]")
    several: list[Any] = []
    for one in (*given, checked_sequence(where, "children", listed)):
        several += one if isinstance(one, (list, tuple)) else (one,)
    children = tuple(child_of(one) for one in several)
    seen: dict[str, Spec] = {}
    for child in children:
        check_child(where, child, auto_shutdown)
        if (twin := seen.get(child.name)) is not None:
            raise DeclarationError(
                f"{where}: duplicate id {child.name!r}: {shown(twin)} and {shown(child)}; give one of them another name"
            )
        seen[child.name] = child
    return children


def _check_own_options(where: str, intensity: object, auto_shutdown: object) -> None:
    if not isinstance(intensity, Intensity):
        raise DeclarationError(
            f"{where}: intensity must be an Intensity(restarts, within=seconds), not {shown(intensity)}"
        )
    checked_choice(where, "auto_shutdown", auto_shutdown, AutoShutdown)


def _check_crossing(why: str, spec: Supervisor, *, away: bool) -> None:
    """Raise `DeclarationError` unless all nodes below can be copied to another process, and may stay there."""
    for child in spec.children:
        one = child.template if isinstance(child, DynamicSupervisor) else child
        if one.hosts:
            raise DeclarationError(
                f"{shown(one)}: {why}, and only the process in which a tree is run gives parts of it to other machines: move this child up"
            )
        if isinstance(one, Supervisor):
            _check_crossing(why, one, away=away)
        else:
            where = f"Child({factory_name(one.factory)})"
            check_crossing(where, one.factory, one.args, one.parameters, why, away=away)
