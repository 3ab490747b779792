"""The parameter store of one node: it declares, reads, sets, describes and lists parameters by the rules of ROS 2, as rclpy applies them.

Guarantees: a refused set changes nothing; an atomic set is applied completely or not at all; on-set callbacks see values before they are
stored, post-set callbacks and the owner's `on_event` after that. Refusals are `SetResult`s; wrong names and declarations raise
(`actors.parameters.errors`). There is no I/O, no waiting and no threading.

Nodes share the declarations of their class. A store has one dictionary of values of its own, and copies the descriptors when a parameter is
declared, deleted or described at run time. `store.values[name]` gives a plain value by one lookup.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any, Final, cast

import msgspec

from actors.parameters.callbacks import CallbackChains, CallbackHandle, OnSetCallback, PostSetCallback, PreSetCallback
from actors.parameters.checks import DYNAMIC, UNDESCRIBED, checked, invalid, objection, planned, refused, unpacked
from actors.parameters.declare import NO_PARAMETERS, ParameterTable
from actors.parameters.descriptor import ParameterDescriptor, redescribed_type
from actors.parameters.errors import (
    ParameterAlreadyDeclared,
    ParameterBusy,
    ParameterImmutable,
    ParameterNotDeclared,
    ParameterUninitialized,
)
from actors.parameters.values import Parameter, ParameterChange, ParameterNames, ParameterType, SetResult, widened

SEPARATOR: Final = "."


def listed(declared: Iterable[str], prefixes: Sequence[str], depth: int) -> ParameterNames:
    """Return the names in `declared` that prefixes and depth select, in order, and their groups.

    Raises TypeError for arguments of another type and ValueError for a negative depth.
    """
    if isinstance(prefixes, str) or not all(isinstance(cast("object", prefix), str) for prefix in prefixes):
        raise TypeError(f"prefixes must be a list of strings, not {prefixes!r}.")
    if not isinstance(cast("object", depth), int):
        raise TypeError(f"depth must be an integer, not {depth!r}.")
    if depth < 0:
        raise ValueError(f"depth must be 0 (all levels) or more, not {depth}.")
    names = tuple(name for name in declared if _is_listed(name, prefixes, depth))
    groups = dict.fromkeys(name.rpartition(SEPARATOR)[0] for name in names if SEPARATOR in name)
    return ParameterNames(names, tuple(groups))


def _is_listed(name: str, prefixes: Sequence[str], depth: int) -> bool:
    if not prefixes:
        return not depth or name.count(SEPARATOR) < depth
    return any(_is_in_group(name, prefix, depth) for prefix in prefixes)


def _is_in_group(name: str, prefix: str, depth: int) -> bool:
    if name == prefix:
        return True
    start = f"{prefix}{SEPARATOR}"
    return name.startswith(start) and (not depth or name.count(SEPARATOR, len(start)) < depth)


NO_OVERRIDES: Final[Mapping[str, Any]] = {}
_ACCEPTED: Final = SetResult()


class ParameterStore:
    """The parameters of the node `node` (its fully qualified name, used in errors).

    `overrides` replace declared values (name -> plain value); an int is widened to a declared float, and unused overrides are ignored.
    `table` holds the declarations of the node's class. With `allow_undeclared`, setting any name declares it with dynamic typing. With
    `automatically_declare`, every override is declared. `on_event` is called with every change after it is stored, beginning with the
    initial values (unless ``announce=False``).

    Raises InvalidParameterType and InvalidParameterValue for an override that does not fit its declaration.
    """

    # Invariants:
    # * Every name in `values` is declared, and its value obeys its descriptor.
    # * `_descriptors` is the table of the class, which is never changed, until `_own` has copied it.

    __slots__ = ("_chains", "_descriptors", "_shared", "allow_undeclared", "node", "on_event", "overrides", "values")

    def __init__(
        self,
        node: str,
        overrides: Mapping[str, Any] | None = None,
        *,
        table: ParameterTable = NO_PARAMETERS,
        allow_undeclared: bool = False,
        automatically_declare: bool = False,
        on_event: Callable[[ParameterChange], None] | None = None,
        announce: bool = True,
    ) -> None:
        self.node = node
        self.overrides = overrides or NO_OVERRIDES
        self.allow_undeclared = allow_undeclared
        self.on_event = on_event
        self.values: dict[str, Any] = dict(table.values)
        """Name -> plain value. A declared parameter without a value is missing here."""
        self._descriptors: Mapping[str, ParameterDescriptor] = table.descriptors
        self._shared = True
        self._chains: CallbackChains | None = None
        for name, value in self.overrides.items():
            described = self._descriptors.get(name)
            if described is not None:
                self.values[name] = checked(self.node, widened(name, value, described.type), described).value
        if on_event is not None and announce:
            on_event(ParameterChange(new=tuple(self._present(name) for name in self.values)))
        if automatically_declare:
            for name, value in self.overrides.items():
                if name not in self._descriptors:
                    self.declare(name, value, UNDESCRIBED)

    def __repr__(self) -> str:
        return f"<parameters of {self.node}: {', '.join(f'{n}={v!r}' for n, v in self.values.items())}>"

    # -- reading -----------------------------------------------------------------------------------------------------

    def has(self, name: str) -> bool:
        """Whether `name` is declared, with or without a value."""
        return name in self._descriptors

    def value(self, name: str) -> Any:
        """The plain value. Raises as `get` does."""
        return self.get(name).value

    def get(self, name: str) -> Parameter:
        """The parameter. If `name` is undeclared and the node allows that, it has neither type nor value.

        Raises ParameterNotDeclared, and ParameterUninitialized for a parameter declared by type only that has no value yet.
        """
        if name in self.values:
            return self._present(name)
        if name in self._descriptors:
            raise ParameterUninitialized.of(self.node, name, self._descriptors[name].type.name)
        if self.allow_undeclared:
            return Parameter(name)
        raise ParameterNotDeclared.among(self.node, [name], self._descriptors)

    def get_or(self, name: str, alternative: object) -> Parameter:
        """The parameter, or one of that name with the value `alternative` if it has none. Nothing is stored."""
        if self.values.get(name) is None:
            return Parameter(name, alternative)
        return self._present(name)

    def get_by_prefix(self, prefix: str) -> dict[str, Parameter]:
        """The parameters of the group `prefix`, by their names without the prefix; for '' all of them."""
        start = f"{prefix}{SEPARATOR}" if prefix else ""
        return {name[len(start) :]: self._present(name) for name in self._descriptors if name.startswith(start)}

    def type_of(self, name: str) -> ParameterType:
        """The type of the present value of `name`; NOT_SET if it has none, or is undeclared and the node allows that.

        Raises ParameterNotDeclared.
        """
        if not (self.allow_undeclared and name not in self._descriptors):
            self._declared(name)
        return self._present(name).type

    def list(self, prefixes: Sequence[str] = (), depth: int = 0) -> ParameterNames:
        """The names in order of declaration.

        A `depth` of 0 means all levels. Without prefixes, a name is listed if it has fewer than `depth` separators; with prefixes, if it is
        one of them or is in the group of one with fewer than `depth` separators below it. Raises TypeError for arguments of another type
        and ValueError for a negative depth.
        """
        return listed(self._descriptors, prefixes, depth)

    def describe(self, name: str) -> ParameterDescriptor:
        """The descriptor; with dynamic typing, its type is that of the value. Empty if undeclared and the node allows that.

        Raises ParameterNotDeclared.
        """
        if self.allow_undeclared and name not in self._descriptors:
            return UNDESCRIBED
        described = self._declared(name)
        if described.dynamic_typing:
            return msgspec.structs.replace(described, type=self._present(name).type)
        return described

    def coerced(self, name: str, value: object) -> Parameter:
        """Return `value` as a parameter to set, widened to the type of `name` (an int to a float, an empty list to any array).

        For values from Python or a command line, where 2 may mean 2.0. An undeclared name keeps the type of the value. Raises TypeError and
        ValueError for a value that no parameter can hold.
        """
        described = self._descriptors.get(name)
        return Parameter(name, value) if described is None else widened(name, value, self.describe(name).type)

    def _present(self, name: str) -> Parameter:
        """The parameter, whether or not it has a value."""
        value = self.values.get(name)
        if value is None:
            return Parameter(name)
        kind = self._descriptors[name].type
        return Parameter(name, value) if kind is ParameterType.NOT_SET else Parameter(name, value, kind)

    def _declared(self, name: str) -> ParameterDescriptor:
        try:
            return self._descriptors[name]
        except KeyError:
            raise ParameterNotDeclared.among(self.node, [name], self._descriptors) from None

    # -- declaring ---------------------------------------------------------------------------------------------------

    def declare(
        self,
        name: str,
        value: object = None,
        descriptor: ParameterDescriptor | None = None,
        *,
        ignore_override: bool = False,
    ) -> Parameter:
        """Declare a parameter and return it as stored.

        `value` is the default and gives the type, unless the descriptor has dynamic typing; a `ParameterType` instead of a value declares
        without a value. An override replaces the value. On-set and post-set callbacks are called. A name alone is deprecated and means
        dynamic typing without a value.

        Raises InvalidParameterName, ParameterAlreadyDeclared, ValueError (no type or two types), TypeError (a value that no parameter can
        hold), InvalidParameterType (of an override), InvalidParameterValue (range, choices, refusal by a callback).
        """
        self._refuse_reentry()
        parameter, described = planned(
            self.node, name, value, descriptor, NO_OVERRIDES if ignore_override else self.overrides
        )
        if name in self._descriptors:
            raise ParameterAlreadyDeclared(self.node, [name])
        return self._declare(parameter, described)

    def declare_many(
        self, namespace: str, parameters: Iterable[tuple[object, ...]], *, ignore_override: bool = False
    ) -> tuple[Parameter, ...]:
        """Declare several parameters, given as (name), (name, value) or (name, value, descriptor) and named `namespace.name`.

        All names and types are checked before the first parameter is declared. They are then declared one by one, so a later refusal by
        range or callback keeps the earlier ones. Raises as `declare` does.
        """
        self._refuse_reentry()
        overrides = NO_OVERRIDES if ignore_override else self.overrides
        plans: list[tuple[Parameter, ParameterDescriptor]] = []
        for item in parameters:
            name, value, descriptor = unpacked(item)
            full = f"{namespace}{SEPARATOR}{name}" if namespace else name
            plans.append(planned(self.node, full, value, descriptor, overrides))
        names = [parameter.name for parameter, _ in plans]
        twice = [name for position, name in enumerate(names) if name in self._descriptors or name in names[:position]]
        if twice:
            raise ParameterAlreadyDeclared(self.node, twice)
        return tuple(self._declare(parameter, described) for parameter, described in plans)

    def undeclare(self, name: str) -> None:
        """Remove a parameter. As in rclpy, no callback runs and no event is sent.

        Raises ParameterNotDeclared, and ParameterImmutable for a read-only parameter.
        """
        self._refuse_reentry()
        if self._declared(name).read_only:
            raise ParameterImmutable(
                f"parameter {name!r} of node {self.node} is read-only and cannot be undeclared.",
                node=self.node,
                names=[name],
            )
        self._forget(name)

    # -- changing ----------------------------------------------------------------------------------------------------

    def set(self, parameters: Iterable[Parameter]) -> tuple[SetResult, ...]:
        """Set each parameter by itself, in order, and return one result for each. Types are exact (see `coerced`).

        Raises ParameterNotDeclared at an undeclared name. The parameters before it stay set; those after it are not set.
        """
        return tuple(self.set_atomically([parameter]) for parameter in parameters)

    def set_atomically(self, parameters: Iterable[Parameter]) -> SetResult:
        """Set all parameters or none, with one result and one event.

        The order is: pre-set callbacks; checks of declaration, read-only, type, range and choices; on-set callbacks; store; event; post-set
        callbacks. A value of None deletes a parameter with dynamic typing. If a name is given twice, its last value counts. Raises
        ParameterNotDeclared, with nothing set.
        """
        self._refuse_reentry()
        wanted: Sequence[Parameter] = tuple(parameters)
        chains = self._chains
        if chains is not None and chains.pre:
            wanted = chains.rewrite(wanted)
            if not wanted:
                return SetResult(False, "parameter list cannot be empty: the pre-set callbacks left nothing to set.")
        self._require_declared(wanted)
        for parameter in wanted:
            reason = objection(parameter, self._descriptors.get(parameter.name))
            if reason is not None:
                return SetResult(False, reason)
        result = self._validated(wanted)
        if result.successful:
            self._apply(wanted)
        return result

    def set_values(self, values: Mapping[str, object]) -> SetResult:
        """Set values from Python, all or none, each widened to the type of its parameter (see `coerced`).

        Raises ParameterNotDeclared, with nothing set, and TypeError or ValueError for a value that no parameter can hold.
        """
        return self.set_atomically([self.coerced(name, value) for name, value in values.items()])

    def set_descriptor(self, name: str, descriptor: ParameterDescriptor, alternative: object = None) -> Parameter:
        """Give a parameter a new descriptor. Its name stays, and its type too unless the new descriptor has dynamic typing.

        If the value does not obey the new descriptor, it is replaced by `alternative`, which is reported as a change. Undeclared names are
        ignored if the node allows them. Raises ParameterNotDeclared, ParameterImmutable if the parameter is read-only,
        InvalidParameterValue if neither value is allowed, and ValueError if a parameter without type and value is to become static.
        """
        self._refuse_reentry()
        if self.allow_undeclared and name not in self._descriptors:
            return Parameter(name)
        old = self._declared(name)
        if old.read_only:
            raise ParameterImmutable(
                f"parameter {name!r} of node {self.node} is read-only, so its descriptor cannot be replaced.",
                node=self.node,
                names=[name],
            )
        current = self._present(name)
        described = msgspec.structs.replace(descriptor, name=name, type=redescribed_type(descriptor, old, current))
        if current.type is ParameterType.NOT_SET or described.value_objection(current) is None:
            self._own()[name] = described
            return current
        replacement = current if alternative is None else widened(name, alternative, described.type)
        checked(self.node, replacement, described)
        self._own()[name] = described
        self._apply([replacement], post=False)
        return replacement

    # -- callbacks ---------------------------------------------------------------------------------------------------

    def add_pre_set_callback(self, callback: PreSetCallback) -> CallbackHandle:
        """Let `callback` rewrite the parameters of every set, but not of declarations. The callback added last runs first."""
        return self._own_chains().add("pre", callback)

    def add_on_set_callback(self, callback: OnSetCallback) -> CallbackHandle:
        """Let `callback` refuse sets and declarations. The callback added last runs first, and the first refusal ends the chain."""
        return self._own_chains().add("on", callback)

    def add_post_set_callback(self, callback: PostSetCallback) -> CallbackHandle:
        """Call `callback` with stored values, of sets and declarations. The callback added last runs first."""
        return self._own_chains().add("post", callback)

    def check_overrides(self) -> None:
        """Call the on-set callbacks for the overrides of declared values. Raises InvalidParameterValue if they refuse."""
        given = [self._present(name) for name in self.overrides if name in self._descriptors]
        if given and not (result := self._validated(given)).successful:
            raise refused(self.node, given, result.reason)

    # -- inside ------------------------------------------------------------------------------------------------------

    def _require_declared(self, parameters: Iterable[Parameter]) -> None:
        if not self.allow_undeclared:
            missing = [parameter.name for parameter in parameters if parameter.name not in self._descriptors]
            if missing:
                raise ParameterNotDeclared.among(self.node, missing, self._descriptors)

    def _declare(self, parameter: Parameter, described: ParameterDescriptor) -> Parameter:
        if parameter.type is not ParameterType.NOT_SET:
            checked(self.node, parameter, described)
        result = self._validated([parameter])
        if not result.successful:
            raise invalid(self.node, parameter, result.reason)
        self._own()[parameter.name] = described
        if parameter.type is not ParameterType.NOT_SET or described.dynamic_typing:
            self.values[parameter.name] = parameter.value
        self._report(ParameterChange(new=(parameter,)), [parameter])
        return parameter

    def _apply(self, parameters: Sequence[Parameter], *, post: bool = True) -> None:
        new: list[Parameter] = []
        changed: list[Parameter] = []
        deleted: list[Parameter] = []
        # A name given twice counts once, with its last value, so that an event does not contradict itself.
        for name, parameter in {parameter.name: parameter for parameter in parameters}.items():
            if parameter.type is ParameterType.NOT_SET:
                if name in self._descriptors:
                    self._forget(name)
                    deleted.append(parameter)
                continue
            if name not in self._descriptors:
                self._own()[name] = msgspec.structs.replace(DYNAMIC, name=name)
            (new if self.values.get(name) is None else changed).append(parameter)
            self.values[name] = parameter.value
        change = ParameterChange(tuple(new), tuple(changed), tuple(deleted))
        self._report(change, parameters if post else ())

    def _report(self, change: ParameterChange, told: Sequence[Parameter]) -> None:
        if self.on_event is not None and (change.new or change.changed or change.deleted):
            self.on_event(change)
        if self._chains is not None and told:
            self._chains.tell(told)

    def _validated(self, parameters: Sequence[Parameter]) -> SetResult:
        return _ACCEPTED if self._chains is None else self._chains.validate(parameters)

    def _forget(self, name: str) -> None:
        del self._own()[name]
        self.values.pop(name, None)

    def _own(self) -> dict[str, ParameterDescriptor]:
        """The descriptors, copied from the class before the first change."""
        if self._shared:
            self._descriptors = dict(self._descriptors)
            self._shared = False
        return cast("dict[str, ParameterDescriptor]", self._descriptors)

    def _own_chains(self) -> CallbackChains:
        if self._chains is None:
            self._chains = CallbackChains()
        return self._chains

    def _refuse_reentry(self) -> None:
        if self._chains is not None and self._chains.running:
            raise ParameterBusy(
                f"a parameter callback of node {self.node} tried to change parameters of the same node; "
                "rewrite the list in a pre-set callback, or set them after the callbacks have run.",
                node=self.node,
            )
