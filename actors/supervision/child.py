"""`Child`: the declaration of one supervised node; and the check of the options that children of all kinds have."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import ClassVar

from actors.checks import (
    check_place,
    checked_choice,
    checked_flag,
    checked_mapping,
    checked_name,
    checked_sequence,
    class_of_node,
    default_name,
    factory_name,
    is_number,
    shown,
)
from actors.errors import DeclarationError
from actors.supervision.declaration import Declaration
from actors.supervision.policy import Backoff, Kind, Restart, StopTimeout, permanent
from actors.supervision.process_options import HANG_SECONDS, check_crossing, check_process, checked_hosts, why_crossing


class Child(Declaration):
    """One supervised node: how to make it, how long it may take to stop, and when to restart it.

    `factory`, a class or any other callable, makes the node; it is called for every incarnation, with `args`.
    `name` is the child's id among its siblings and the node's name; default: the factory's `node_name`, or the class
    name in snake_case. `namespace`, `parameters` and `remap` are those of the node. `stop` is the time for its
    clean-up in seconds. `backoff` delays its restarts. `significant` makes its end count for its supervisor's
    `auto_shutdown`.
    With `process` the node runs in an interpreter of its own, which is killed when its event loop has not turned for `hang`
    seconds (`math.inf`: never). Factory, arguments and parameters are then copied to it by `pickle`.
    With `host`, that process is on another machine, which `run(hosts=...)` knows by this name; with `hosts`, on the first of them that can
    be reached.
    Raises `DeclarationError`, which names the option that is wrong, or the argument that cannot be copied.
    """

    __slots__ = (
        "args",
        "backoff",
        "factory",
        "hang",
        "hosts",
        "name",
        "namespace",
        "parameters",
        "process",
        "remap",
        "restart",
        "significant",
        "stop",
    )
    _stored_defaults: ClassVar[dict[str, object]] = {"parameters": {}, "remap": {}}
    factory: Callable[..., object]
    name: str
    namespace: str | None
    parameters: Mapping[str, object]
    remap: Mapping[str, str]
    args: tuple[object, ...]
    restart: Restart
    stop: StopTimeout
    backoff: Backoff | None
    significant: bool
    process: bool
    hang: float
    hosts: tuple[str, ...]

    def __init__(
        self,
        factory: Callable[..., object],
        *,
        name: str | None = None,
        namespace: str | None = None,
        parameters: Mapping[str, object] | None = None,
        remap: Mapping[str, str] | None = None,
        args: Sequence[object] = (),
        restart: Restart = permanent,
        stop: StopTimeout = 5.0,
        backoff: Backoff | None = None,
        significant: bool = False,
        process: bool = False,
        hang: float = HANG_SECONDS,
        host: str | None = None,
        hosts: Sequence[str] = (),
    ) -> None:
        if isinstance(factory, Declaration):
            kind, inner = type(factory).__name__, getattr(factory, "name", "")
            raise DeclarationError(
                f"Child({kind}({inner!r})): a {kind} is a child as it is: write it without Child(...)"
            )
        where = f"Child({factory_name(factory)})"
        if not callable(factory):
            hint = f"; write Child({node})" if (node := class_of_node(factory)) else ""
            raise DeclarationError(
                f"{where}: factory must be a class or a callable that makes the node, not {shown(factory)}{hint}"
            )
        check_policy(where, restart, stop, backoff, significant)
        away = checked_hosts(where, host, hosts)
        process = process or bool(away)
        check_process(where, process, hang)
        self._set(
            factory=factory,
            name=checked_name(where, default_name(factory) if name is None else name),
            namespace=namespace,
            parameters=checked_mapping(where, "parameters", parameters),
            remap=checked_mapping(where, "remap", remap),
            args=checked_sequence(where, "args", args),
            restart=restart,
            stop=stop,
            backoff=backoff,
            significant=checked_flag(where, "significant", significant),
            process=process,
            hang=hang,
            hosts=away,
        )
        check_place(where, self.name, namespace, self.remap)
        if process:
            check_crossing(where, factory, self.args, self.parameters, why_crossing(away), away=bool(away))

    @property
    def kind(self) -> Kind:
        return "worker"

    def _positional(self) -> list[str]:
        return [factory_name(self.factory), f"name={self.name!r}"]


def check_policy(where: str, restart: object, stop: object, backoff: object, significant: object) -> None:
    """Raise `DeclarationError` unless these options of a child are valid, each by itself and together."""
    checked_choice(where, "restart", restart, Restart)
    if stop != "kill" and not (is_number(stop) and stop >= 0):
        raise DeclarationError(f'{where}: stop must be seconds, 0 or more, math.inf or "kill", not {shown(stop)}')
    if backoff is not None and not isinstance(backoff, Backoff):
        raise DeclarationError(f"{where}: backoff must be a Backoff(first, most), not {shown(backoff)}")
    if significant and restart == permanent:
        raise DeclarationError(
            f"{where}: significant=True does not go with restart=permanent: a permanent child never ends for good; "
            "make it transient or temporary"
        )
