"""Parsing the arguments after ``--ros-args``, by the grammar of rcl.

``prog [user] --ros-args [ros] [--] [user] ...``: several blocks are allowed, a lone ``--`` ends one.
"""

import re
import sys
import warnings
from collections.abc import Callable, Sequence
from typing import Final, NamedTuple

from actors.errors import reduce_error
from actors.logs.levels import Level
from actors.names.remapping import InvalidRule, Rule
from actors.parameters.files import ParameterOverrides


class InvalidRosArguments(ValueError):
    """An argument inside ``--ros-args`` has no value or a wrong one. ``arguments`` are the flag and its value, if any."""

    __reduce__ = reduce_error

    def __init__(self, problem: str, arguments: tuple[str, ...]) -> None:
        super().__init__(f"{problem} (in: --ros-args {' '.join(arguments)})")
        self.arguments = arguments


class UnknownRosArguments(ValueError):
    """There are unknown arguments inside ``--ros-args``; ``arguments`` lists them."""

    __reduce__ = reduce_error

    def __init__(self, arguments: tuple[str, ...]) -> None:
        shown = ", ".join(map(repr, arguments))
        super().__init__(f"unknown ROS arguments: {shown}; write -- before arguments that are meant for the program")
        self.arguments = arguments


class RosArguments(NamedTuple):
    """The parsed arguments. A value; ``parse`` makes it.

    ``user_indices`` and ``unknown_indices`` are positions in argv: those of the arguments outside of the ROS blocks, and
    those of the unknown arguments inside.
    """

    argv: tuple[str, ...] = ()
    user_indices: tuple[int, ...] = ()
    unknown_indices: tuple[int, ...] = ()
    remap_rules: tuple[Rule, ...] = ()
    parameters: ParameterOverrides = ParameterOverrides()
    params_files: tuple[str, ...] = ()
    default_log_level: Level | None = None
    logger_levels: tuple[tuple[str, Level], ...] = ()
    log_config_file: str | None = None
    log_file_name: str | None = None
    enclave: str | None = None
    stdout_logs: bool = True
    rosout_logs: bool = True
    external_lib_logs: bool = True

    @property
    def user_args(self) -> tuple[str, ...]:
        """The arguments outside of the ROS blocks, the program's name included if argv has it."""
        return tuple(self.argv[index] for index in self.user_indices)

    @property
    def unknown_args(self) -> tuple[str, ...]:
        """The unknown arguments inside of ROS blocks."""
        return tuple(self.argv[index] for index in self.unknown_indices)

    def require_known(self) -> "RosArguments":
        """Returns these arguments. Raises ``UnknownRosArguments`` if some are unknown."""
        if self.unknown_indices:
            raise UnknownRosArguments(self.unknown_args)
        return self


def parse(argv: Sequence[str]) -> RosArguments:
    """Read the ROS arguments in ``argv``; parameter files are read at once, in order.

    Raises ``InvalidRosArguments`` at the first missing or wrong value; unknown flags are kept (see ``require_known``).
    A bare ``from:=to`` outside of a block is still taken as a remapping rule, with a ``DeprecationWarning``.
    """
    return _Parser(tuple(argv)).parse()


class _Parser:
    def __init__(self, argv: tuple[str, ...]) -> None:
        self.argv = argv
        self.result = RosArguments(argv)
        self.switches = {"stdout-logs": True, "rosout-logs": True, "external-lib-logs": True}

    def parse(self) -> RosArguments:
        user: list[int] = []
        unknown: list[int] = []
        inside = False
        index = 0
        while index < len(self.argv):
            argument = self.argv[index]
            if argument == "--ros-args":
                inside = True
            elif inside and argument == "--":
                inside = False
            elif not inside:
                if not self._deprecated_rule(argument):
                    user.append(index)
            elif found := _SWITCH.match(argument):
                self.switches[found[2]] = found[1] == "enable"
            elif argument in _VALUED:
                self._valued(argument, index)
                index += 1
            else:
                unknown.append(index)
            index += 1
        return self.result._replace(
            user_indices=tuple(user),
            unknown_indices=tuple(unknown),
            stdout_logs=self.switches["stdout-logs"],
            rosout_logs=self.switches["rosout-logs"],
            external_lib_logs=self.switches["external-lib-logs"],
        )

    def _valued(self, flag: str, index: int) -> None:
        if index + 1 >= len(self.argv):
            raise InvalidRosArguments("the value after this flag is missing", (flag,))
        text = self.argv[index + 1]
        try:
            self.result = _VALUED[flag](self.result, text)
        except ValueError as error:
            raise InvalidRosArguments(str(error), (flag, text)) from error

    def _deprecated_rule(self, argument: str) -> bool:
        if ":=" not in argument:
            return False
        try:
            rule = Rule.parse(argument)
        except InvalidRule:
            return False
        text = f"remapping rules outside of --ros-args are deprecated; write --ros-args --remap {argument}"
        warnings.warn(text, DeprecationWarning, stacklevel=4)
        self.result = self.result._replace(remap_rules=(*self.result.remap_rules, rule))
        return True


def remove_ros_args(argv: Sequence[str] | None = None) -> list[str]:
    """The arguments that are not for ROS, by default those of `sys.argv`: for a program with arguments of its own, before it makes its tree.

    As in rclpy the program's name, if there is one, stays first. Raises `ValueError` for a ROS argument that is wrong.
    """
    return list(parse(sys.argv if argv is None else argv).user_args)


def _remap(result: RosArguments, text: str) -> RosArguments:
    return result._replace(remap_rules=(*result.remap_rules, Rule.parse(text)))


def _param(result: RosArguments, text: str) -> RosArguments:
    return result._replace(parameters=result.parameters.with_rule(text))


def _params_file(result: RosArguments, path: str) -> RosArguments:
    parameters = result.parameters.with_file(path)
    return result._replace(parameters=parameters, params_files=(*result.params_files, path))


def _log_level(result: RosArguments, text: str) -> RosArguments:
    logger, separator, level = text.rpartition(":=")
    if not separator:
        return result._replace(default_log_level=Level.parse(text) or None)
    if not logger or ":=" in logger:
        raise ValueError("write LEVEL or logger:=LEVEL")
    levels = {**dict(result.logger_levels), logger: Level.parse(level)}
    return result._replace(logger_levels=tuple(levels.items()))


def _log_config_file(result: RosArguments, path: str) -> RosArguments:
    return result._replace(log_config_file=path)


def _log_file_name(result: RosArguments, name: str) -> RosArguments:
    return result._replace(log_file_name=name)


def _enclave(result: RosArguments, enclave: str) -> RosArguments:
    return result._replace(enclave=enclave)


_VALUED: Final[dict[str, Callable[[RosArguments, str], RosArguments]]] = {
    "-r": _remap,
    "--remap": _remap,
    "-p": _param,
    "--param": _param,
    "--params-file": _params_file,
    "--log-level": _log_level,
    "--log-config-file": _log_config_file,
    "--log-file-name": _log_file_name,
    "-e": _enclave,
    "--enclave": _enclave,
}

_SWITCH: Final = re.compile(r"--(enable|disable)-(stdout-logs|rosout-logs|external-lib-logs)\Z")
