"""Texts with substitutions, ``$(find-pkg-share demo)/launch/$(var file)``, as they stand in XML, YAML and parameter files."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import Final, NamedTuple

from actors.launch.errors import SubstitutionFailure
from actors.launch.substitution import Substitution, TextSubstitution
from actors.launch.substitutions.logic import (
    AllSubstitution,
    AndSubstitution,
    AnySubstitution,
    EqualsSubstitution,
    IfElseSubstitution,
    NotEqualsSubstitution,
    NotSubstitution,
    OrSubstitution,
    PythonExpression,
    StringJoinSubstitution,
)
from actors.launch.substitutions.paths import (
    Command,
    ExecutableInPackage,
    FileContent,
    FindExecutable,
    FindPackagePrefix,
    FindPackageShare,
    PathJoinSubstitution,
    ThisLaunchFile,
    ThisLaunchFileDir,
)
from actors.launch.substitutions.values import (
    AnonName,
    EnvironmentVariable,
    ForEachVar,
    ForLoopIndex,
    LaunchConfiguration,
    LaunchLogDir,
    Parameter,
)
from actors.suggest import did_you_mean
from actors.yaml_bounds import DEEPEST

_NAME: Final = re.compile(r"[A-Za-z][\w-]*")
_OPEN: Final = "$("


class Known(NamedTuple):
    """A substitution: how it is made, and how many arguments it takes."""

    make: Callable[..., Substitution]
    least: int
    most: int


Words = list[Substitution]
"""One argument of a substitution: its parts."""


def _many(make: Callable[..., Substitution]) -> Known:
    return Known(make, 1, 1000)


def _defaulted(make: Callable[..., Substitution], option: str) -> Callable[..., Substitution]:
    """Makes a substitution of a name and of a default, which may be missing."""

    def made(name: Words, default: Words | None = None) -> Substitution:
        return make(name, **{option: default})

    return made


def _command(command: Words, mode: Words | None = None) -> Substitution:
    return Command(command) if mode is None else Command(command, on_stderr=mode)


def _program(name: Words) -> Substitution:
    return FindExecutable(name=name)


def _path(*parts: Words) -> Substitution:
    return PathJoinSubstitution(parts)


def _joined(delimiter: Words, *parts: Words) -> Substitution:
    return StringJoinSubstitution(parts, delimiter)


def _expression(text: Words, modules: Words | None = None) -> Substitution:
    if modules is None:
        return PythonExpression(text)
    names = "".join(one.text for one in modules if isinstance(one, TextSubstitution))
    return PythonExpression(text, [name.strip() for name in names.split(",")])


SUBSTITUTIONS: Final[Mapping[str, Known]] = MappingProxyType(
    {
        "all": _many(AllSubstitution),
        "and": Known(AndSubstitution, 2, 2),
        "anon": Known(AnonName, 1, 1),
        "any": _many(AnySubstitution),
        "command": Known(_command, 1, 2),
        "dirname": Known(ThisLaunchFileDir, 0, 0),
        "env": Known(_defaulted(EnvironmentVariable, "default_value"), 1, 2),
        "equals": Known(EqualsSubstitution, 2, 2),
        "eval": Known(_expression, 1, 2),
        "exec-in-pkg": Known(ExecutableInPackage, 2, 2),
        "file-content": Known(FileContent, 1, 1),
        "filename": Known(ThisLaunchFile, 0, 0),
        "find-exec": Known(_program, 1, 1),
        "find-pkg-prefix": Known(FindPackagePrefix, 1, 1),
        "find-pkg-share": Known(FindPackageShare, 1, 1),
        "for-var": Known(_defaulted(ForEachVar, "default_value"), 1, 2),
        "if": Known(IfElseSubstitution, 2, 3),
        "index": Known(ForLoopIndex, 1, 1),
        "launch_log_dir": Known(LaunchLogDir, 0, 0),
        "log_dir": Known(LaunchLogDir, 0, 0),
        "not": Known(NotSubstitution, 1, 1),
        "not-equals": Known(NotEqualsSubstitution, 2, 2),
        "or": Known(OrSubstitution, 2, 2),
        "param": Known(_defaulted(Parameter, "default"), 1, 2),
        "path-join": _many(_path),
        "string-join": _many(_joined),
        "var": Known(_defaulted(LaunchConfiguration, "default"), 1, 2),
    }
)
"""The substitutions by the name after ``$(``."""


def parse_substitution(text: str) -> list[Substitution]:
    """The parts of a text. A backslash is removed and takes the meaning from
    what follows it: ``\\$(`` stands for a dollar sign and a parenthesis, ``\\\\`` for a backslash. Raises `SubstitutionFailure`."""
    return _Parser(text).template("")


def parse_command_line(text: str) -> list[list[Substitution]]:
    """The words of a text: they are separated by spaces outside of quotation marks and of substitutions. Raises `SubstitutionFailure`."""
    words: list[list[Substitution]] = []
    plain: list[str] = []
    quote, inside = "", False
    for part in parse_substitution(text):
        if not isinstance(part, TextSubstitution):
            _extend(words, plain, inside)
            words[-1].append(part)
            inside = True
            continue
        for letter in part.text:
            if letter == quote:
                quote = ""
            elif not quote and letter in "\"'":
                quote = letter
                _extend(words, plain, inside)
                inside = True
            elif not quote and letter.isspace():
                if inside:
                    _extend(words, plain, inside)
                inside = False
            else:
                _extend(words, [], inside)
                plain.append(letter)
                inside = True
        if inside:
            _extend(words, plain, inside)
    if quote:
        raise SubstitutionFailure(f"a quotation mark {quote} is missing in {text!r}")
    return words


def _extend(words: list[list[Substitution]], plain: list[str], inside: bool) -> None:
    """Put the letters read so far into the present word, or into a new one."""
    if not inside:
        words.append([])
    _flush(plain, words[-1])


class _Parser:
    """Reads one text from left to right; `at` is the next character."""

    def __init__(self, text: str) -> None:
        self.text = text
        self.at = 0
        self._depth = 0

    def template(self, quote: str) -> list[Substitution]:
        """The parts up to the closing quotation mark, or up to the end of the text if `quote` is empty."""
        parts: list[Substitution] = []
        plain: list[str] = []
        while self.at < len(self.text):
            character = self.text[self.at]
            if self.opens():
                _flush(plain, parts)
                parts.append(self.substitution())
            elif quote and character == quote:
                self.at += 1
                break
            else:
                plain.append(self.character())
        else:
            if quote:
                raise SubstitutionFailure(f"a quotation mark {quote} is missing at the end of {self.text!r}")
        _flush(plain, parts)
        return parts

    def opens(self) -> bool:
        """Whether a substitution begins here. As in ROS 2, none does behind a backslash, not even one that stands for itself."""
        return self.text.startswith(_OPEN, self.at) and self.text[self.at - 1 : self.at] != "\\"

    def character(self) -> str:
        """The next character, without the backslash before it: who wants one writes two."""
        character = self.text[self.at]
        self.at += 1
        if character == "\\" and self.at < len(self.text) and self.text[self.at] != "\n":
            character = self.text[self.at]
            self.at += 1
        return character

    def substitution(self) -> Substitution:
        """What stands in ``$(...)``."""
        begin = self.at
        self._depth += 1
        if self._depth > DEEPEST:
            raise SubstitutionFailure(f"substitutions are nested more than {DEEPEST} levels deep")
        self.at += len(_OPEN)
        match = _NAME.match(self.text, self.at)
        name = match[0] if match is not None else ""
        self.at += len(name)
        arguments: list[list[Substitution]] = []
        while True:
            while self.at < len(self.text) and self.text[self.at].isspace():
                self.at += 1
            if self.at >= len(self.text):
                raise SubstitutionFailure(f"a parenthesis is missing at the end of {self.text[begin:]!r}")
            if self.text[self.at] == ")":
                self.at += 1
                self._depth -= 1
                return _made(name, arguments, self.text[begin : self.at])
            arguments.append(self.argument())

    def argument(self) -> list[Substitution]:
        """One argument: in quotation marks, or up to a space or a parenthesis."""
        if (quote := self.text[self.at]) in "\"'":
            self.at += 1
            return self.template(quote)
        parts: list[Substitution] = []
        plain: list[str] = []
        while self.at < len(self.text) and not (self.text[self.at].isspace() or self.text[self.at] == ")"):
            if self.opens():
                _flush(plain, parts)
                parts.append(self.substitution())
            else:
                plain.append(self.character())
        _flush(plain, parts)
        return parts


def _flush(plain: list[str], parts: list[Substitution]) -> None:
    if plain:
        parts.append(TextSubstitution(text="".join(plain)))
        plain.clear()


def _made(name: str, arguments: list[list[Substitution]], text: str) -> Substitution:
    known = SUBSTITUTIONS.get(name)
    if known is None:
        near = did_you_mean(name, SUBSTITUTIONS) or f"; there are: {', '.join(SUBSTITUTIONS)}"
        raise SubstitutionFailure(f"there is no substitution {name!r}{near} (in {text})")
    if not known.least <= len(arguments) <= known.most:
        wanted = str(known.least) if known.least == known.most else f"{known.least} to {known.most}"
        raise SubstitutionFailure(
            f"$({name} ...) takes {wanted} arguments, not {len(arguments)} (in {text}); quote an argument with spaces"
        )
    return known.make(*arguments)
