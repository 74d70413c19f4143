"""Source of compiled functions, gathered into one file that needs NumPy alone.

The functions are those that the kernel runs: their Python source, with everything that they call,
their constants as literals, without decorators and annotations. Branches for effects and strain
energies that a model does not have are left out.
"""

from __future__ import annotations

import ast
import builtins
import inspect
import textwrap
from collections.abc import Callable, Iterable, Iterator
from types import ModuleType
from typing import Any

import numpy as np

from dearig.errors import InputError

__all__ = ["gathered"]

_LIBRARIES = {"math", "numpy"}
_SCALARS = (bool, int, float, str, type(None))


def gathered(
    roots: Iterable[Callable[..., Any]], of_motion: int, of_sensor: int, springs: Iterable[int]
) -> tuple[str, dict[str, str]]:
    """Return the source of ``roots`` and all that they use, and the name of each root in it.

    Parameters
    ----------
    roots : iterable of callable
        Functions, compiled or not.
    of_motion, of_sensor : int
        Bits of the effects that the model has (``assembly.active`` and ``active_sensors``).
    springs : iterable of int
        Codes of the strain energies that the model has.

    Returns
    -------
    str
        Functions, classes and constants, each after what it uses.
    dict of str to str
        Name in the file of each root, by its own name.

    Raises
    ------
    InputError
        If the source of a function cannot be read.
    """
    gatherer = _Gatherer(of_motion, of_sensor, frozenset(springs))
    found = [_plain(root) for root in roots]
    for function in found:
        gatherer.take(function)
    gatherer.name_all()
    return gatherer.text(), {f.__name__: gatherer.names[id(f)] for f in found}


def _plain(thing: Any) -> Any:
    """The Python function of a compiled one; anything else as it is."""
    return getattr(thing, "py_func", thing)


class _Gatherer:
    """Objects that were found, each after those that it uses, and their names in the file."""

    def __init__(self, of_motion: int, of_sensor: int, springs: frozenset[int]) -> None:
        self.of_motion, self.of_sensor, self.springs = of_motion, of_sensor, springs
        self.names: dict[int, str] = {}
        self._objects: dict[int, tuple[str, Any]] = {}
        self._trees: dict[int, ast.AST] = {}
        self._begun: set[int] = set()

    def take(self, thing: Any, module: str = "", name: str = "") -> None:
        """Take ``thing`` and, before it, all that it uses."""
        if id(thing) in self._begun:
            return
        self._begun.add(id(thing))
        if inspect.isfunction(thing) or inspect.isclass(thing):
            tree = self._tree(thing)
            self._trees[id(thing)] = tree
            space = vars(_module_of(thing))
            for used, where, called in _used(tree, space):
                self.take(used, where, called)
            self._objects[id(thing)] = (thing.__module__.rpartition(".")[2], thing)
        else:
            self._objects[id(thing)] = (module, thing)
            self.names[id(thing)] = f"{module}_{name.lstrip('_')}"

    def _tree(self, thing: Any) -> ast.AST:
        try:
            source = textwrap.dedent(inspect.getsource(thing))
        except (OSError, TypeError) as error:
            raise InputError(
                f"the source of {thing.__qualname__} cannot be read ({error}): a folder for "
                f"compiled kernels is needed, set NUMBA_CACHE_DIR to one"
            ) from error
        tree: ast.AST = _Bare().visit(ast.parse(source)).body[0]
        if thing.__module__.endswith("assembled_hooks"):
            sensor = thing.__name__ in ("sense", "active_sensors")
            tree = _Pruned(self.of_sensor if sensor else self.of_motion).visit(tree)
        if thing.__module__.endswith("assembled_laws"):
            tree = _OfSprings(self.springs).visit(tree)
        return ast.fix_missing_locations(tree)

    def name_all(self) -> None:
        """Give each function and class a name that nothing else in the file has."""
        kinds = [o for o in self._objects.values() if hasattr(o[1], "__name__")]
        taken = {
            n for key, tree in self._trees.items() if key in self._objects for n in _locals(tree)
        }
        for module, thing in kinds:
            plain = thing.__name__
            twins = sum(other.__name__ == plain for _, other in kinds)
            alone = twins == 1 and plain not in taken
            name = plain if alone else f"{module}_{plain.lstrip('_')}"
            while name in taken or name in self.names.values():
                name += "_"
            self.names[id(thing)] = name

    def text(self) -> str:
        """Return the source of all objects."""
        parts = []
        for key, (_, thing) in self._objects.items():
            if key in self._trees:
                space = vars(_module_of(thing))
                tree = _Renamed(space, self.names, _locals(self._trees[key])).visit(
                    self._trees[key]
                )
                tree.name = self.names[key]
                parts.append(ast.unparse(ast.fix_missing_locations(tree)))
            else:
                parts.append(f"{self.names[key]} = {_literal(thing)}")
        return "\n\n\n".join(parts) + "\n"


def _module_of(thing: Any) -> ModuleType:
    module = inspect.getmodule(thing)
    if module is None:  # pragma: no cover - of generated modules only that have been unloaded
        raise InputError(f"the module of {thing.__qualname__} is not loaded")
    return module


def _literal(value: Any) -> str:
    if isinstance(value, np.ndarray):
        return f"np.array({value.tolist()!r})"
    if isinstance(value, tuple):
        return f"({', '.join(map(_literal, value))}{',' if len(value) == 1 else ''})"
    if isinstance(value, float) and not np.isfinite(value):
        return f'float("{value}")'
    if isinstance(value, np.generic):
        return repr(value.item())
    if isinstance(value, _SCALARS):
        return repr(value)
    raise InputError(f"a constant of the kernel is a {type(value).__name__}, not a number")


def _locals(tree: ast.AST) -> set[str]:
    """Names that a function binds."""
    found = {n.arg for n in ast.walk(tree) if isinstance(n, ast.arg)}
    stored = (n for n in ast.walk(tree) if isinstance(n, ast.Name))
    return found | {n.id for n in stored if isinstance(n.ctx, ast.Store)}


def _resolved(node: ast.AST, space: dict[str, Any], local: set[str]) -> Any:
    """The global object that a name, or an attribute of a module, means; None for all others."""
    if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Load) and node.id not in local:
        if node.id not in space:
            return None if hasattr(builtins, node.id) else _MISSING
        return space[node.id]
    if isinstance(node, ast.Attribute) and isinstance(node.value, ast.Name):
        owner = space.get(node.value.id) if node.value.id not in local else None
        if isinstance(owner, ModuleType) and owner.__name__ not in _LIBRARIES:
            return getattr(owner, node.attr)
    return None


_MISSING = object()


def _used(tree: ast.AST, space: dict[str, Any]) -> Iterator[tuple[Any, str, str]]:
    """Yield functions, classes, arrays and tuples that a function uses, with module and name."""
    local = _locals(tree)
    for node in ast.walk(tree):
        thing = _plain(_resolved(node, space, local))
        if thing is _MISSING:
            raise InputError(f"the kernel uses {ast.unparse(node)}, which is not in its module")
        if thing is None or isinstance(thing, (*_SCALARS, ModuleType)):
            continue
        if getattr(thing, "__module__", "") in ("typing", "numpy", "builtins"):
            continue
        name = node.attr if isinstance(node, ast.Attribute) else getattr(node, "id", "")
        yield thing, str(space["__name__"]).rpartition(".")[2], name


class _Bare(ast.NodeTransformer):
    """Leaves decorators and annotations out."""

    def visit_FunctionDef(self, node: ast.FunctionDef) -> ast.AST:
        node.decorator_list, node.returns = [], None
        self.generic_visit(node)
        return node

    def visit_arg(self, node: ast.arg) -> ast.AST:
        node.annotation = None
        return node

    def visit_ClassDef(self, node: ast.ClassDef) -> ast.AST:
        node.decorator_list = []
        return node  # the fields of a named tuple are its annotations

    def visit_AnnAssign(self, node: ast.AnnAssign) -> ast.AST | None:
        if node.value is None:
            return None
        return ast.copy_location(ast.Assign([node.target], node.value), node)


class _Pruned(ast.NodeTransformer):
    """Leaves out what assembled hooks do for effects that the model does not have."""

    def __init__(self, bits: int) -> None:
        self._bits = bits

    def visit_If(self, node: ast.If) -> ast.AST | None:
        test, first = node.test, node.body[0]
        if isinstance(test, ast.BinOp) and isinstance(test.op, ast.BitAnd):
            mask: Any = test.right
        elif isinstance(first, ast.AugAssign) and isinstance(first.op, ast.BitOr):
            mask = first.value
        else:
            return node
        if not mask.value & self._bits:
            return None
        self.generic_visit(node)
        return node


class _OfSprings(ast.NodeTransformer):
    """Leaves out the strain energies that the model does not have."""

    def __init__(self, codes: frozenset[int]) -> None:
        self._codes = codes

    def visit_If(self, node: ast.If) -> ast.AST | None:
        test: Any = node.test
        return node if test.comparators[0].value in self._codes else None


class _Renamed(ast.NodeTransformer):
    """Puts names of the file for global objects, and literals for numbers."""

    def __init__(self, space: dict[str, Any], names: dict[int, str], local: set[str]) -> None:
        self._space, self._names, self._local = space, names, local

    def _other(self, node: ast.AST) -> ast.AST | None:
        thing = _plain(_resolved(node, self._space, self._local))
        if thing is None or thing is _MISSING:
            return None
        if id(thing) in self._names:
            return ast.Name(self._names[id(thing)], ast.Load())
        if isinstance(thing, (*_SCALARS, np.generic)):
            return ast.parse(_literal(thing), mode="eval").body
        return None

    def visit_Name(self, node: ast.Name) -> ast.AST:
        return self._other(node) or node

    def visit_Attribute(self, node: ast.Attribute) -> ast.AST:
        self.generic_visit(node)
        return self._other(node) or node

    def visit_ClassDef(self, node: ast.ClassDef) -> ast.AST:
        return node
