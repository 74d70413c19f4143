"""Every small change that can be made to a module: comparisons, constants, logic and signs."""

from __future__ import annotations

import ast
import copy
from collections.abc import Iterator
from dataclasses import dataclass

__all__ = ["Mutant", "mutants_of"]

_COMPARED: dict[type[ast.cmpop], type[ast.cmpop]] = {
    ast.Lt: ast.LtE, ast.LtE: ast.Lt, ast.Gt: ast.GtE, ast.GtE: ast.Gt, ast.Eq: ast.NotEq,
    ast.NotEq: ast.Eq, ast.Is: ast.IsNot, ast.IsNot: ast.Is, ast.In: ast.NotIn, ast.NotIn: ast.In,
}  # fmt: skip
_SIGNS: dict[type[ast.operator], type[ast.operator]] = {ast.Add: ast.Sub, ast.Sub: ast.Add}
_HALF = 1.5  # what a number with a fraction is multiplied by


@dataclass(frozen=True)
class Mutant:
    """A module with one change: where it is, what it is, and the whole source."""

    line: int
    change: str
    source: str


def mutants_of(source: str) -> list[Mutant]:
    """Return ``source`` (Python) with each small change in turn, in the order of the lines."""
    tree = ast.parse(source)
    _drop_what_says_nothing(tree)
    made = []
    for place, node in enumerate(ast.walk(tree)):
        for number in range(len(list(_changes(node)))):
            changed = copy.deepcopy(tree)
            same = next(n for i, n in enumerate(ast.walk(changed)) if i == place)
            before = ast.unparse(same)
            list(_changes(same))[number]()
            made.append(
                Mutant(
                    getattr(node, "lineno", 0),
                    f"{before} -> {ast.unparse(same)}",
                    ast.unparse(ast.fix_missing_locations(changed)),
                )
            )
    return sorted(made, key=lambda m: m.line)


def _drop_what_says_nothing(tree: ast.AST) -> None:
    """Take off docstrings, annotations and ``__all__``: no test sees a change of them."""
    for node in ast.walk(tree):
        if isinstance(node, ast.arg):
            node.annotation = None
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
            node.returns = None
        body = getattr(node, "body", None)
        if isinstance(body, list):
            node.body = [n for n in body if not _says_nothing(n)] or [ast.Pass()]  # type: ignore[attr-defined]


def _says_nothing(node: ast.AST) -> bool:
    if isinstance(node, ast.Expr):
        return isinstance(node.value, ast.Constant)
    if isinstance(node, ast.Assign):
        return any(isinstance(t, ast.Name) and t.id == "__all__" for t in node.targets)
    return False


def _changes(node: ast.AST) -> Iterator[_Change]:
    """Give the changes that can be made to ``node``, each to be called once."""
    match node:
        case ast.Compare(ops=ops):
            for i, op in enumerate(ops):
                if other := _COMPARED.get(type(op)):
                    yield _Change(ops, i, other())
        case ast.BinOp(op=op) if other := _SIGNS.get(type(op)):
            yield _Change(node, "op", other())
        case ast.BoolOp(op=op):
            yield _Change(node, "op", ast.Or() if isinstance(op, ast.And) else ast.And())
        case ast.UnaryOp(op=ast.Not(), operand=operand):
            yield _Change(node, "operand", ast.UnaryOp(ast.Not(), operand))
        case ast.UnaryOp(op=ast.USub()):
            yield _Change(node, "op", ast.UAdd())
        case ast.Constant(value=bool() as value):
            yield _Change(node, "value", not value)
        case ast.Constant(value=int() as value):
            yield _Change(node, "value", value + 1)
        case ast.Constant(value=float() as value):
            yield _Change(node, "value", value * _HALF if value else 1.0)


@dataclass(frozen=True)
class _Change:
    """Put ``new`` into the place ``at`` of a list or node."""

    of: ast.AST | list[ast.cmpop]
    at: str | int
    new: object

    def __call__(self) -> None:
        if isinstance(self.of, list):
            self.of[int(self.at)] = self.new  # type: ignore[call-overload]
        else:
            setattr(self.of, str(self.at), self.new)
