"""The mistakes: every place in a source file where one change gives another program, found in its syntax tree.

A mutant is text: the file with one piece replaced, all else as it was. Left alone are annotations, docstrings and messages, `__repr__`,
assertions, protocols, and what only a type checker sees, because no behavior depends on them.
"""

from __future__ import annotations

import ast
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Final

COMPARISONS: Final[dict[type[ast.cmpop], str]] = {
    ast.Lt: "<=", ast.LtE: "<", ast.Gt: ">=", ast.GtE: ">", ast.Eq: "!=", ast.NotEq: "==", ast.Is: "is not", ast.IsNot: "is",
    ast.In: "not in", ast.NotIn: "in",
}  # fmt: skip
NEGATED_ALREADY: Final = (ast.Eq, ast.NotEq, ast.Is, ast.IsNot, ast.In, ast.NotIn)
"""Comparisons whose exchange is their negation, so that negating the condition as well would give the same mutant twice."""
ARITHMETIC: Final[dict[type[ast.operator], ast.operator]] = {
    ast.Add: ast.Sub(), ast.Sub: ast.Add(), ast.Mult: ast.Div(), ast.Div: ast.Mult(), ast.FloorDiv: ast.Mult(),
}  # fmt: skip
CALLS: Final = {"min": "max", "max": "min", "any": "all", "all": "any"}
METHODS: Final = {"popleft": "pop", "append": "appendleft", "setdefault": "get"}
PASSED_ON: Final = {"reversed", "sorted"}
"""Functions whose argument may stand for their result."""
SILENT: Final = {"__all__", "__slots__"}
TEXT: Final = {"__repr__", "__str__"}


@dataclass(frozen=True)
class Mutant:
    """One mistake: where it is, what kind it is, the line before and after, and the whole file with it."""

    path: str
    line: int
    kind: str
    before: str
    after: str
    source: str

    def __str__(self) -> str:
        return f"{self.path}:{self.line}  {self.kind}:  {self.before}  ->  {self.after}"


def mutants_of(path: str, source: str) -> list[Mutant]:
    """Every mutant of a file, in the order of its text, each different from the others and from the file, and all of them Python."""
    finder = _Finder(source)
    finder.visit(ast.parse(source))
    found: dict[str, Mutant] = {}
    for node, kind, replacement in finder.found:
        text = finder.spliced(node, replacement)
        if text != source and text not in found and _compiles(text):
            before, after = _first_difference(source, text)
            found[text] = Mutant(path, node.lineno, kind, before, after, text)
    return sorted(found.values(), key=lambda mutant: mutant.line)


def _compiles(text: str) -> bool:
    try:
        compile(text, "mutant", "exec")
    except SyntaxError:  # such as a `return` with a value where there may be none
        return False
    return True


def _first_difference(old: str, new: str) -> tuple[str, str]:
    for before, after in zip(old.splitlines(), new.splitlines(), strict=False):
        if before != after:
            return before.strip(), after.strip()
    return "(end of file)", "(end of file)"


class _Finder(ast.NodeVisitor):
    """Walks over a file and notes replacements: the node to replace, the kind of mistake, the text instead."""

    def __init__(self, source: str) -> None:
        self.raw = source.encode()
        self.starts = [0]
        for line in self.raw.splitlines(keepends=True):
            self.starts.append(self.starts[-1] + len(line))
        self.found: list[tuple[ast.expr | ast.stmt, str, str]] = []
        self.function = ""

    def spliced(self, node: ast.expr | ast.stmt, text: str) -> str:
        begin = self.starts[node.lineno - 1] + node.col_offset
        end = self.starts[(node.end_lineno or 0) - 1] + (node.end_col_offset or 0)
        return (self.raw[:begin] + text.encode() + self.raw[end:]).decode()

    def note(self, node: ast.expr | ast.stmt, kind: str, instead: ast.AST | str) -> None:
        text = instead if isinstance(instead, str) else ast.unparse(instead)
        simple = isinstance(node, ast.stmt) or isinstance(instead, ast.Constant | ast.Name | ast.Call | ast.Attribute)
        self.found.append((node, kind, text if simple else f"({text})"))

    # -- what is left alone -------------------------------------------------------------------------------------------------

    def visit_ClassDef(self, node: ast.ClassDef) -> None:
        if not any(isinstance(base, ast.Name) and base.id == "Protocol" for base in node.bases):
            self.visit_all(node.body)

    def visit_FunctionDef(self, node: ast.FunctionDef | ast.AsyncFunctionDef) -> None:
        if node.name not in TEXT:
            outer, self.function = self.function, node.name
            self.visit_all([*node.args.defaults, *(value for value in node.args.kw_defaults if value is not None)])
            self.visit_all(node.body)
            self.function = outer

    visit_AsyncFunctionDef = visit_FunctionDef

    def visit_AnnAssign(self, node: ast.AnnAssign) -> None:
        if not (isinstance(node.annotation, ast.Name) and node.annotation.id == "TypeAlias"):
            self.assignment(node, [node.target], node.value)

    def visit_Assert(self, node: ast.Assert) -> None: ...

    def visit_JoinedStr(self, node: ast.JoinedStr) -> None: ...

    def visit_all(self, nodes: Iterator[ast.AST] | list[ast.AST] | list[ast.stmt] | list[ast.expr]) -> None:
        for node in nodes:
            self.visit(node)

    # -- conditions ---------------------------------------------------------------------------------------------------------

    def visit_If(self, node: ast.If) -> None:
        if not (isinstance(node.test, ast.Name) and node.test.id == "TYPE_CHECKING"):
            self.condition(node.test)
            self.generic_visit(node)

    def visit_While(self, node: ast.While) -> None:
        self.condition(node.test)
        self.generic_visit(node)

    def visit_IfExp(self, node: ast.IfExp) -> None:
        self.condition(node.test)
        self.generic_visit(node)

    def condition(self, test: ast.expr) -> None:
        exchanged = isinstance(test, ast.Compare) and len(test.ops) == 1 and isinstance(test.ops[0], NEGATED_ALREADY)
        if not exchanged and not isinstance(test, ast.Constant) and not _is_not(test):
            self.note(test, "condition negated", f"not ({ast.unparse(test)})")

    def visit_Compare(self, node: ast.Compare) -> None:
        for index, operator in enumerate(node.ops):
            parts = [ast.unparse(node.left)]
            for other, (each, right) in enumerate(zip(node.ops, node.comparators, strict=True)):
                sign = COMPARISONS[type(operator)] if other == index else _sign(each)
                parts += [
                    sign,
                    f"({ast.unparse(right)})" if isinstance(right, ast.IfExp | ast.BoolOp) else ast.unparse(right),
                ]
            self.note(node, "comparison", " ".join(parts))
        self.generic_visit(node)

    def visit_BoolOp(self, node: ast.BoolOp) -> None:
        swapped = ast.Or() if isinstance(node.op, ast.And) else ast.And()
        self.note(node, "and/or", ast.BoolOp(swapped, node.values))
        for index in range(len(node.values)):
            rest = [value for other, value in enumerate(node.values) if other != index]
            self.note(node, "operand removed", rest[0] if len(rest) == 1 else ast.BoolOp(node.op, rest))
        self.generic_visit(node)

    def visit_UnaryOp(self, node: ast.UnaryOp) -> None:
        if _is_not(node):
            self.note(node, "not removed", node.operand)
        self.generic_visit(node)

    # -- values -------------------------------------------------------------------------------------------------------------

    def visit_Constant(self, node: ast.Constant) -> None:
        value = node.value
        if isinstance(value, bool):
            self.note(node, "constant", ast.Constant(not value))
        elif isinstance(value, int):
            self.note(node, "constant", ast.Constant(value + 1))
            if value > 0:
                self.note(node, "constant", ast.Constant(value - 1))
        elif isinstance(value, float):
            self.note(node, "constant", ast.Constant(value * 2 or 1.0))
        elif isinstance(value, str) and value.isidentifier():  # a state or a policy; whatever has spaces is a message
            self.note(node, "constant", ast.Constant(f"not_{value}"))

    def visit_BinOp(self, node: ast.BinOp) -> None:
        other = ARITHMETIC.get(type(node.op))
        if other is not None and not any(isinstance(side, ast.JoinedStr) for side in (node.left, node.right)):
            self.note(node, "arithmetic", ast.BinOp(node.left, other, node.right))
        self.generic_visit(node)

    def visit_Call(self, node: ast.Call) -> None:
        function = node.func
        if isinstance(function, ast.Name) and function.id in CALLS:
            self.note(function, "call", ast.Name(CALLS[function.id]))
        elif isinstance(function, ast.Name) and function.id in PASSED_ON and node.args:
            self.note(node, "call", node.args[0])
        elif isinstance(function, ast.Attribute) and function.attr in METHODS:
            self.note(function, "call", ast.Attribute(function.value, METHODS[function.attr]))
        elif isinstance(function, ast.Name) and function.id in ("TypeVar", "cast", "TypeVarTuple", "ParamSpec"):
            return
        self.generic_visit(node)

    def visit_Await(self, node: ast.Await) -> None:
        self.note(node, "await removed", node.value)
        self.generic_visit(node)

    # -- statements ---------------------------------------------------------------------------------------------------------

    def visit_Expr(self, node: ast.Expr) -> None:
        if isinstance(node.value, ast.Constant):  # a docstring
            return
        self.note(node, "statement removed", "pass")
        inner = (
            node.value.value if isinstance(node.value, ast.Await) else node.value
        )  # removing only the await adds nothing
        self.visit(inner)

    def visit_Assign(self, node: ast.Assign) -> None:
        self.assignment(node, node.targets, node.value)

    def assignment(self, node: ast.Assign | ast.AnnAssign, targets: list[ast.expr], value: ast.expr | None) -> None:
        if value is None or any(isinstance(target, ast.Name) and target.id in SILENT for target in targets):
            return
        kept = all(isinstance(target, ast.Attribute | ast.Subscript) for target in targets)
        if (
            kept and self.function != "__init__"
        ):  # a name that is missing altogether would give the mistake away at once
            self.note(node, "statement removed", "pass")
        self.visit(value)

    def visit_AugAssign(self, node: ast.AugAssign) -> None:
        self.note(node, "statement removed", "pass")
        other = ARITHMETIC.get(type(node.op))
        if other is not None:
            self.note(node, "arithmetic", ast.AugAssign(node.target, other, node.value))
        self.visit(node.value)

    def visit_Delete(self, node: ast.Delete) -> None:
        self.note(node, "statement removed", "pass")

    def visit_Raise(self, node: ast.Raise) -> None:
        self.note(node, "statement removed", "pass")

    def visit_Return(self, node: ast.Return) -> None:
        if node.value is None:
            self.note(node, "return removed", "pass")
            return
        if not (isinstance(node.value, ast.Constant) and node.value.value is None):
            self.note(node, "return value", "return None")
        self.visit(node.value)

    def visit_Break(self, node: ast.Break) -> None:
        self.note(node, "break/continue", "continue")

    def visit_Continue(self, node: ast.Continue) -> None:
        self.note(node, "break/continue", "break")

    def visit_For(self, node: ast.For | ast.AsyncFor) -> None:
        self.note(node.iter, "loop skipped", ast.Name("()"))
        self.visit(node.iter)
        self.visit_all([*node.body, *node.orelse])


def _is_not(node: ast.expr) -> bool:
    return isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.Not)


def _sign(operator: ast.cmpop) -> str:
    return ast.unparse(ast.Compare(ast.Name("a"), [operator], [ast.Name("b")]))[2:-2]
