"""Reading the arguments `parameters` and `argv` of `run`, and checking them against the tree before anything starts.

Every mistake is a `ValueError` with one line of text: what is wrong, where it was given, and what to do.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator, Mapping, Sequence
from itertools import pairwise, takewhile
from typing import Any, NamedTuple, TypeAlias, cast

from actors.logs.levels import Level
from actors.names.identity import Identity
from actors.names.names import logger_name
from actors.parameters.declare import OPTIONAL_PARAMETERS, ParameterTable
from actors.parameters.files import ParameterOverrides
from actors.qos.policies import QOS_OVERRIDES
from actors.running.arguments import RosArguments
from actors.runtime.members import has_fixed_parameters
from actors.runtime.node import Node
from actors.runtime.options import RunOptions, identity_of
from actors.suggest import did_you_mean
from actors.supervision.child import Child
from actors.supervision.declarations import DynamicSupervisor, Spec

ParameterSource: TypeAlias = str | os.PathLike[str] | Mapping[str, Mapping[str, object]]
"""The path of a ROS 2 parameter file (YAML), or ``{node: {parameter: value}}`` with its patterns: a full name, ``/**`` for all nodes."""

ParameterSources: TypeAlias = ParameterSource | Sequence[ParameterSource]
"""One source, or several, of which a later one counts more than an earlier one, as in ROS 2."""


def options_of(
    where: str, tree: Spec, parameters: ParameterSources | None, argv: Sequence[str] | None, level: int
) -> RunOptions | None:
    """The options of a run of `tree`, checked; None when nothing is given. `where` is named in errors about a mapping."""
    if parameters is None and argv is None:
        return None
    from actors.logs.levels import Level, LevelTree

    arguments = _read_arguments(argv or ())
    levels = LevelTree(Level(level) if arguments.default_log_level is None else arguments.default_log_level)
    for logger, each in arguments.logger_levels:
        levels.set(logger, each)
    said = read_parameters(where, parameters)
    options = RunOptions(
        arguments.parameters, said, arguments.remap_rules, levels, arguments.stdout_logs, arguments.user_args
    )
    nodes = list(_nodes(tree, (tree.name,), options))
    for overrides in (arguments.parameters, said):
        _check_overrides(overrides, nodes)
    if all(node.known for node in nodes):
        _check_names(arguments, nodes)
    return options


def misplaced(argv: Sequence[str]) -> Iterator[str]:
    """Each ``-p name:=value`` and ``name:=value`` that stands before ``--ros-args``, where it means nothing to ROS."""
    words = takewhile(lambda word: word != "--ros-args", argv)
    for flag, value in pairwise(("", *words)):
        if ":=" in value:
            yield f"{flag} {value}" if flag in ("-p", "--param") else value


def overruled(tree: Spec, options: RunOptions) -> Iterator[tuple[str, str, object]]:
    """The parameters of the command line without effect, because a child's declaration sets another value: (node, name, that value)."""
    for node in _nodes(tree, (tree.name,), options):
        for name, value in options.arguments.for_node(node.fqn).items():
            if (
                node.known
                and node.child.parameters.get(name, value) != value
                and name not in options.parameters.for_node(node.fqn)
            ):
                yield node.fqn, name, node.child.parameters[name]


def with_arguments(child: Child, argv: Sequence[str] | None) -> tuple[Child, Level]:
    """The child with the arguments `argv` of this one node applied, and the level of its log, `UNSET` if they set none.

    As in ROS 2 the child's own parameters and remapping rules count more than those of `argv`. Arguments for other nodes are ignored.
    """
    from actors.logs.levels import Level, LevelTree

    if argv is None:
        return child, Level.UNSET
    arguments = _read_arguments(argv, of_one_node=True)
    rules = (str(rule).partition(":=") for rule in arguments.remap_rules)
    told = child.replace(remap={**child.remap, **{old: new for old, _, new in rules if old not in child.remap}})
    fqn = identity_of(told, (child.name,)).fqn
    levels = LevelTree(arguments.default_log_level or Level.UNSET)
    for logger, level in arguments.logger_levels:
        levels.set(logger, level)
    parameters = {**arguments.parameters.for_node(fqn), **child.parameters}
    return told.replace(parameters=parameters), levels.effective(logger_name(fqn))


def with_own_arguments(child: Child, argv: Sequence[str]) -> Child:
    """The child with the parameters that its class makes of the words outside of ``--ros-args``, by ``arguments_as_parameters``.

    A class without this method takes no words of its own. Raises `ValueError` for words that it does not take.
    """
    from actors.running.arguments import parse

    reader: Callable[[Sequence[str]], dict[str, object]] | None = getattr(
        child.factory, "arguments_as_parameters", None
    )
    if reader is None:
        return child
    return child.replace(parameters={**reader(parse(argv).user_args), **child.parameters})


def _read_arguments(argv: Sequence[str], *, of_one_node: bool = False) -> RosArguments:
    """The ROS arguments in `argv`. Raises `ValueError` for an argument that is wrong, unknown, or of ROS 2 but without effect here."""
    from actors.running.arguments import InvalidRosArguments, parse

    arguments = parse(argv).require_known()
    without_effect = {
        "--enclave": arguments.enclave is not None,
        "--log-config-file": arguments.log_config_file is not None,
        "--log-file-name": arguments.log_file_name is not None,
        "--disable-rosout-logs": not arguments.rosout_logs,
        "--disable-stdout-logs": of_one_node and not arguments.stdout_logs,
    }
    for flag, given in without_effect.items():
        if given:
            raise InvalidRosArguments("this flag of ROS 2 has no effect here; leave it out", (flag,))
    return arguments


def read_parameters(where: str, parameters: ParameterSources | None) -> ParameterOverrides:
    """The overrides of all sources, in order. Raises `InvalidParams`, which names the source and, in a file, the line."""
    from actors.parameters.files import InvalidParams, ParameterOverrides

    overrides = ParameterOverrides()
    if parameters is None:
        return overrides
    single = isinstance(parameters, (str, os.PathLike, Mapping)) or not isinstance(cast("object", parameters), Sequence)
    for source in cast("Sequence[object]", [parameters] if single else parameters):
        if isinstance(source, (str, os.PathLike)):
            overrides = overrides.with_file(cast("str", source))
        elif isinstance(source, Mapping):
            overrides = overrides.with_mapping(cast("Mapping[str, Any]", source), source=where)
        else:
            problem = f"{source!r:.60} is neither the path of a parameter file nor {{node: {{parameter: value}}}}"
            raise InvalidParams(problem, source=where)
    return overrides


def parameters_by_node(where: str, tree: Spec, parameters: ParameterSources) -> dict[str, dict[str, object]]:
    """Full name of each node of the tree -> those of these parameters that apply to it, for a run of a part of the tree.

    Raises `InvalidParams`, as `run` does with the whole tree.
    """
    overrides = read_parameters(where, parameters)
    nodes = list(_nodes(tree, (tree.name,), None))
    _check_overrides(overrides, nodes)
    taken: dict[str, dict[str, Any]] = {}
    for node in nodes:
        values = overrides.for_node(node.fqn) if node.known else {}
        if node.table is not None and node.fixed:
            values = {
                name: value
                for name, value in values.items()
                if name in node.table.values or name in OPTIONAL_PARAMETERS or node.overridden(name)
            }
        if values:
            taken[node.fqn] = values
    return taken


# -- against the tree -----------------------------------------------------------------------------------------------------------


class _Declared(NamedTuple):
    """One node of the tree. `identity` is None for the template of a dynamic supervisor, `table` if its parameters are not known."""

    identity: Identity | None
    child: Child
    table: ParameterTable | None
    fixed: bool
    """Whether the node has no other parameters than those in `table`."""

    def overridden(self, name: str) -> bool:
        """Whether a parameter may be one for the quality of service of the node's endpoints."""
        kind = self.child.factory
        assert isinstance(kind, type)  # it has a table
        assert issubclass(kind, Node)
        return kind.declarations.overridable and name.startswith(QOS_OVERRIDES)

    @property
    def known(self) -> bool:
        return self.identity is not None

    @property
    def fqn(self) -> str:
        return self.identity.fqn if self.identity is not None else ""


def _nodes(spec: Spec, path: tuple[str, ...], options: RunOptions | None) -> Iterator[_Declared]:
    if isinstance(spec, DynamicSupervisor):
        yield _Declared(None, spec.template, None, False)
    elif isinstance(spec, Child):
        kind = spec.factory
        identity = identity_of(spec, path, options)
        if isinstance(kind, type) and issubclass(kind, Node):
            fixed = kind is not Node and has_fixed_parameters(kind)
            yield _Declared(identity, spec, kind.declarations.table, fixed)
        else:
            yield _Declared(identity, spec, None, False)
    else:
        for child in spec.children:
            yield from _nodes(child, (*path, child.name), options)


def _check_overrides(overrides: ParameterOverrides, nodes: Sequence[_Declared]) -> None:
    from actors.parameters.files import reaches

    for pattern, values in overrides.entries:
        reached = [node for node in nodes if node.known and reaches(pattern, node.fqn)]
        for name, value in values.items():
            origin = overrides.origin(pattern, name)
            if not reached:
                if all(node.known for node in nodes):
                    raise origin.error(_no_node(pattern, [node.fqn for node in nodes]), pattern)
                continue
            if name in OPTIONAL_PARAMETERS:
                continue  # every node has it if it is given
            if name.startswith(QOS_OVERRIDES):
                continue  # which topics a node has is known when it has started
            holders = [node for node in reached if node.table is not None and name in node.table.values]
            if not holders and all(node.fixed for node in reached):
                known = {one for node in reached if node.table is not None for one in node.table.values}
                raise origin.error(_no_parameter(name, known), pattern)
            for node in holders:
                if problem := _objection(node, name, value):
                    raise origin.error(problem)


def _no_node(pattern: str, fqns: Sequence[str]) -> str:
    """The text about a pattern that matches no node: the node that was probably meant, or all nodes."""
    last = f"/{pattern.rpartition('/')[2]}"
    elsewhere = [repr(fqn) for fqn in fqns if fqn.endswith(last)]
    near = f"; did you mean {' or '.join(elsewhere)}?" if elsewhere else did_you_mean(f"/{pattern.lstrip('/')}", fqns)
    return f"no node is called that{near or '; there are: ' + ', '.join(fqns)}"


def _no_parameter(name: str, known: set[str]) -> str:
    near = did_you_mean(name, sorted(known))
    return f"there is no parameter {name!r}{near or '; there are: ' + ', '.join(sorted(known))}"


def _objection(node: _Declared, name: str, value: object) -> str:
    """Why the node would not start with this value, as far as its declaration says; empty if nothing speaks against it."""
    from actors.parameters import ParameterError, ParameterStore

    assert node.table is not None
    try:
        ParameterStore(node.fqn, {name: value}, table=node.table)
    except ParameterError as error:
        return str(error)
    except (TypeError, ValueError) as error:  # no parameter could hold it
        return f"node {node.fqn}: {name!r}: {error}"
    return ""


def _check_names(arguments: RosArguments, nodes: Sequence[_Declared]) -> None:
    """Raise `InvalidRosArguments` for a remapping rule or a log level of a node that does not exist."""
    from actors.running.arguments import InvalidRosArguments

    names = {name for node in nodes if node.identity is not None for name in (node.child.name, node.identity.name)}
    for rule in arguments.remap_rules:
        if rule.node is not None and rule.node not in names:
            near = did_you_mean(rule.node, sorted(names)) or f"; there are: {', '.join(sorted(names))}"
            raise InvalidRosArguments(f"no node is called {rule.node!r}{near}", ("--remap", str(rule)))
    loggers = sorted({logger_name(node.fqn) for node in nodes})
    for logger, level in arguments.logger_levels:
        if not any(each == logger or each.startswith(f"{logger}.") for each in loggers):
            near = did_you_mean(logger, loggers) or f"; there are: {', '.join(loggers)}"
            text = f"no node has the logger {logger!r}{near}"
            raise InvalidRosArguments(text, ("--log-level", f"{logger}:={level.name.lower()}"))
