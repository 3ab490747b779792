"""The public surface of a package, read from its syntax trees: what its faces export, and which of its own types stand in those signatures.

A *face* is a module whose ``__all__`` is public. Nothing is imported, so annotations that stand under ``TYPE_CHECKING`` are found as well.
"""

from __future__ import annotations

import ast
from collections.abc import Collection, Iterable, Iterator, Mapping
from pathlib import Path
from typing import NamedTuple

from tests.project.imports import imported_from, modules

NO_CONSTRUCTOR = "no public constructor"
"""What the docstring of a class says whose instances only the framework makes: its ``__init__`` is not a public signature."""

VARIABLES = frozenset({"TypeVar", "ParamSpec", "TypeVarTuple"})


class Definition(NamedTuple):
    """A class, function, alias or constant at the top of a module, where it is defined and not where it is imported."""

    module: str
    name: str

    def __str__(self) -> str:
        return f"{self.module}.{self.name}"


class Module(NamedTuple):
    """A module's names: statements that define them, and imports as (module, name); a module itself has the name ``""``."""

    tree: ast.Module
    defined: Mapping[str, ast.stmt]
    imported: Mapping[str, Definition]


class Surface:
    """What the faces of the package at `package` export. `internal` names public members, ``Class.member``, which users are not meant to call."""

    def __init__(self, package: Path, internal: Collection[str] = ()) -> None:
        self.paths = modules(package)
        self.modules = {name: _module(name, path, self.paths) for name, path in self.paths.items()}
        self.internal = frozenset(internal)

    def exports(self, face: str) -> tuple[str, ...]:
        """The names in the ``__all__`` of a module; none where it has none."""
        for statement in self.modules[face].tree.body:
            if isinstance(statement, ast.Assign) and any(_is_name(one, "__all__") for one in statement.targets):
                return tuple(ast.literal_eval(statement.value))
        return ()

    def exported(self, faces: Iterable[str]) -> dict[Definition, list[str]]:
        """Every definition that the faces export, and by which names, ``face.name``; an exported module counts as a definition."""
        found: dict[Definition, list[str]] = {}
        for face in faces:
            for name in self.exports(face):
                definition = self.resolve(face, name)
                assert definition is not None, f"{face}.{name} is defined nowhere"
                found.setdefault(definition, []).append(f"{face}.{name}")
        return found

    def missing(self, public: Collection[Definition]) -> dict[Definition, list[str]]:
        """The package's own types that stand in signatures of `public` and are not in it: each with the places where it stands."""
        found: dict[Definition, list[str]] = {}
        for one in public:
            if one.name:
                for where, definition in self._signature(one, public):
                    if definition not in public:
                        found.setdefault(definition, []).append(where)
        return found

    def made_by_the_framework(self, one: Definition) -> bool:
        """True if the class says in its docstring that it has no public constructor."""
        return _has_no_constructor(self.modules[one.module].defined[one.name])

    def resolve(self, module: str, name: str) -> Definition | None:
        """Where the name of a module is defined; None if not in this package."""
        while True:
            known = self.modules[module]
            if name in known.defined:
                return Definition(module, name)
            if name not in known.imported:
                return Definition(f"{module}.{name}", "") if f"{module}.{name}" in self.modules else None
            module, name = known.imported[name]
            if not name:
                return Definition(module, "")

    # -- signatures -------------------------------------------------------------------------------------------------------------

    def _signature(self, one: Definition, public: Collection[Definition]) -> Iterator[tuple[str, Definition]]:
        """(place, type) for every type of the package in the signature of a definition.

        A base that is not public is only a place for code: its members, and its own bases, count as those of the public class.
        """
        classes = [one]
        made_elsewhere = self.made_by_the_framework(one)
        for kind in classes:
            statement = self.modules[kind.module].defined[kind.name]
            for place, expression in self._expressions(one.name, statement, made_elsewhere):
                yield from ((place, found) for found in self._types(kind.module, expression) if found not in classes)
            for base in statement.bases if isinstance(statement, ast.ClassDef) else ():
                for found in self._types(kind.module, base):
                    if found in public or found in classes:
                        continue
                    if _is_base(base, found):
                        classes.append(found)
                    else:
                        yield one.name, found

    def _expressions(
        self, name: str, statement: ast.stmt, made_elsewhere: bool = False
    ) -> Iterator[tuple[str, ast.expr]]:
        if isinstance(statement, ast.ClassDef):
            yield from self._of_class(name, statement, made_elsewhere)
        elif isinstance(statement, (ast.FunctionDef, ast.AsyncFunctionDef)):
            yield from ((name, one) for one in _annotations(statement))
        elif isinstance(statement, ast.AnnAssign):
            yield name, statement.annotation
            if _is_name(statement.annotation, "TypeAlias") and statement.value is not None:
                yield name, statement.value
        elif isinstance(statement, ast.Assign):
            yield name, statement.value.func if isinstance(statement.value, ast.Call) else statement.value

    def _of_class(self, name: str, kind: ast.ClassDef, made_elsewhere: bool) -> Iterator[tuple[str, ast.expr]]:
        for statement in kind.body:
            for member in _names_of(statement):
                if _is_public(member) and f"{name}.{member}" not in self.internal:
                    yield from self._member(name, member, statement, made_elsewhere)

    def _member(
        self, name: str, member: str, statement: ast.stmt, made_elsewhere: bool
    ) -> Iterator[tuple[str, ast.expr]]:
        if member == "__init__" and isinstance(statement, ast.FunctionDef):
            yield from self._attributes(name, statement)
            if made_elsewhere:
                return
        if not isinstance(statement, ast.Assign):
            yield from self._expressions(f"{name}.{member}", statement)

    def _attributes(self, name: str, init: ast.FunctionDef) -> Iterator[tuple[str, ast.expr]]:
        """The public attributes that a constructor sets: by their annotation, or by that of the parameter that they are set to."""
        arguments = (*init.args.posonlyargs, *init.args.args, *init.args.kwonlyargs)
        parameters = {one.arg: one.annotation for one in arguments if one.annotation is not None}
        for statement in ast.walk(init):
            if isinstance(statement, ast.AnnAssign):
                targets, type_ = [statement.target], statement.annotation
            elif isinstance(statement, ast.Assign) and isinstance(statement.value, ast.Name):
                targets, type_ = statement.targets, parameters.get(statement.value.id)
            elif isinstance(statement, ast.Assign) and isinstance(statement.value, ast.Call):
                targets, type_ = statement.targets, statement.value.func
            else:
                continue
            for target in targets:
                if not (isinstance(target, ast.Attribute) and _is_name(target.value, "self") and type_ is not None):
                    continue
                if _is_public(target.attr) and f"{name}.{target.attr}" not in self.internal:
                    yield f"{name}.{target.attr}", type_

    def _types(self, module: str, expression: ast.expr) -> Iterator[Definition]:
        if isinstance(expression, ast.Constant):
            if isinstance(expression.value, str):
                yield from self._types(module, ast.parse(expression.value, mode="eval").body)
        elif isinstance(expression, (ast.Name, ast.Attribute)):
            definition = self._named(module, expression)
            if definition is not None and definition.name:
                yield from self._type(definition)
        elif isinstance(expression, ast.Subscript):
            yield from self._types(module, expression.value)
            if not _is_name(expression.value, "Literal"):
                inner = expression.slice
                if _is_name(expression.value, "Annotated") and isinstance(inner, ast.Tuple):
                    inner = inner.elts[0]
                yield from self._types(module, inner)
        elif isinstance(expression, (ast.Tuple, ast.List)):
            for one in expression.elts:
                yield from self._types(module, one)
        elif isinstance(expression, ast.BinOp):
            yield from self._types(module, expression.left)
            yield from self._types(module, expression.right)
        elif isinstance(expression, ast.Starred):
            yield from self._types(module, expression.value)

    def _type(self, definition: Definition) -> Iterator[Definition]:
        """The definition if it is a type; for a type variable what bounds it."""
        statement = self.modules[definition.module].defined[definition.name]
        if isinstance(statement, (ast.FunctionDef, ast.AsyncFunctionDef)):
            return
        value = statement.value if isinstance(statement, (ast.Assign, ast.AnnAssign)) else None
        if isinstance(value, ast.Call) and isinstance(value.func, ast.Name) and value.func.id in VARIABLES:
            for one in (*value.args[1:], *(word.value for word in value.keywords)):
                yield from self._types(definition.module, one)
        else:
            yield definition

    def _named(self, module: str, expression: ast.expr) -> Definition | None:
        if isinstance(expression, ast.Name):
            return self.resolve(module, expression.id)
        if not isinstance(expression, ast.Attribute):
            return None
        base = self._named(module, expression.value)
        if base is None or base.name:  # a class within a class goes by the outer one
            return base
        return self.resolve(base.module, expression.attr)


def _module(name: str, path: Path, known: Mapping[str, Path]) -> Module:
    tree = ast.parse(path.read_text(encoding="utf-8"))
    folder = name if path.name == "__init__.py" else name.rpartition(".")[0]
    defined: dict[str, ast.stmt] = {}
    imported: dict[str, Definition] = {}
    for statement in _statements(tree.body):
        if isinstance(statement, ast.Import):
            for alias in statement.names:
                if alias.name in known:
                    imported[alias.asname or alias.name.partition(".")[0]] = Definition(
                        alias.name if alias.asname else alias.name.partition(".")[0], ""
                    )
        elif isinstance(statement, ast.ImportFrom):
            base = imported_from(statement, folder)
            for alias in statement.names:
                if f"{base}.{alias.name}" in known:
                    imported[alias.asname or alias.name] = Definition(f"{base}.{alias.name}", "")
                elif base in known:
                    imported[alias.asname or alias.name] = Definition(base, alias.name)
        else:
            for found in _names_of(statement):
                defined.setdefault(found, statement)
    return Module(tree, defined, imported)


def _statements(body: Iterable[ast.stmt]) -> Iterator[ast.stmt]:
    for statement in body:
        if isinstance(statement, ast.If):
            yield from _statements(statement.body)
            yield from _statements(statement.orelse)
        elif isinstance(statement, ast.Try):
            yield from _statements(statement.body)
        else:
            yield statement


def _annotations(function: ast.FunctionDef | ast.AsyncFunctionDef) -> Iterator[ast.expr]:
    given = function.args
    for one in (*given.posonlyargs, *given.args, *given.kwonlyargs, given.vararg, given.kwarg):
        if one is not None and one.annotation is not None:
            yield one.annotation
    if function.returns is not None:
        yield function.returns


def _names_of(statement: ast.stmt) -> Iterator[str]:
    if isinstance(statement, (ast.ClassDef, ast.FunctionDef, ast.AsyncFunctionDef)):
        yield statement.name
    elif isinstance(statement, (ast.Assign, ast.AnnAssign)):
        for target in statement.targets if isinstance(statement, ast.Assign) else [statement.target]:
            for one in target.elts if isinstance(target, ast.Tuple) else [target]:
                if isinstance(one, ast.Name):
                    yield one.id


def _has_no_constructor(statement: ast.stmt) -> bool:
    text = ast.get_docstring(statement) if isinstance(statement, ast.ClassDef) else None
    return NO_CONSTRUCTOR in " ".join((text or "").split())


def _is_base(base: ast.expr, found: Definition) -> bool:
    """The class that is derived from, and not one of the arguments in its brackets."""
    plain = base.value if isinstance(base, ast.Subscript) else base
    return ast.unparse(plain).rpartition(".")[2] == found.name


def _is_public(name: str) -> bool:
    return not name.startswith("_") or (name.startswith("__") and name.endswith("__"))


def _is_name(expression: ast.expr, name: str) -> bool:
    return isinstance(expression, ast.Name) and expression.id == name
