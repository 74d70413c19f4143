"""Numbers of several films at once, for kernels that step films side by side.

A ``Pack`` holds ``WIDTH`` double-precision numbers, one of each film, as one vector of the
processor: AVX2 has four doubles in a register, AVX-512 and NEON take the same code in one or two.
To numba it is a number type with +, -, * and /, so that a kernel written for single numbers
compiles for packs as it stands. ``rows`` makes an array (n, WIDTH) behave as n packs.
"""

from __future__ import annotations

import inspect
import operator
from collections.abc import Callable
from typing import Any, TypeVar

from llvmlite import ir
from numba import extending
from numba.core import cgutils, types
from numba.core.typing.templates import AbstractTemplate, infer_global, signature
from numba.extending import lower_builtin, models, register_model

from dearig.model.compiled.jit import INTO_CALLER

__all__ = ["WIDTH", "Pack", "first", "lane", "larger", "of_packs", "rows", "spread", "with_lane"]

WIDTH = 4  #: films in a pack

# numba's own types of these have the arguments of the compiler too
intrinsic: Any = extending.intrinsic
overload: Any = extending.overload

_DOUBLE, _INDEX = ir.DoubleType(), ir.IntType(64)
_VECTOR = ir.VectorType(_DOUBLE, WIDTH)
_FLAGS = ("contract", "arcp", "nsz", "reassoc")  # as of all kernels (``jit``)


class Pack(types.Type):
    """Numba's type of one number of each of ``WIDTH`` films."""

    def __init__(self) -> None:
        super().__init__(name="Pack")


class _Rows(types.Type):
    """Numba's type of an array (n, WIDTH) whose rows are packs."""

    def __init__(self) -> None:
        super().__init__(name="Rows")


_PACK, _ROWS = Pack(), _Rows()


@register_model(Pack)
class _PackModel(models.PrimitiveModel):
    def __init__(self, manager: Any, of: Any) -> None:
        super().__init__(manager, of, _VECTOR)


@register_model(_Rows)
class _RowsModel(models.StructModel):
    def __init__(self, manager: Any, of: Any) -> None:
        members = [("data", types.voidptr), ("step", types.intp), ("count", types.intp)]
        super().__init__(manager, of, members)


class _Arithmetic(AbstractTemplate):
    """Types of an operation on two packs, or on a pack and a number."""

    def generic(self, args: Any, _kws: Any) -> Any:
        """Return the signature for the types ``args``; None where no pack is among them."""
        packs = [isinstance(a, Pack) for a in args]
        numbers = [isinstance(a, (types.Float, types.Integer)) for a in args]
        if not any(packs) or not all(p or n for p, n in zip(packs, numbers, strict=True)):
            return None
        return signature(_PACK, *(_PACK if p else types.float64 for p in packs))


def _splat(builder: Any, value: Any) -> Any:
    """Return a pack of one ``value``."""
    none = ir.Constant(_VECTOR, ir.Undefined)
    places = ir.Constant(ir.VectorType(ir.IntType(32), WIDTH), [0] * WIDTH)
    one = builder.insert_element(none, value, ir.Constant(ir.IntType(32), 0))
    return builder.shuffle_vector(one, none, places)


def _lowered(instruction: str) -> Callable[..., Any]:
    def lower(_context: Any, builder: Any, sig: Any, args: Any) -> Any:
        both = [
            a if isinstance(of, Pack) else _splat(builder, a)
            for of, a in zip(sig.args, args, strict=True)
        ]
        return getattr(builder, instruction)(*both, flags=_FLAGS)

    return lower


for _name, _instruction in (("add", "fadd"), ("sub", "fsub"), ("mul", "fmul"), ("truediv", "fdiv")):
    for _operation in (getattr(operator, _name), getattr(operator, f"i{_name}")):
        infer_global(_operation)(_Arithmetic)
        for _kinds in ((Pack, Pack), (Pack, types.Float), (types.Float, Pack)):
            lower_builtin(_operation, *_kinds)(_lowered(_instruction))


@intrinsic
def rows(_typing: Any, array: Any) -> Any:
    """Return an ``array`` (n, WIDTH), contiguous, as n packs that can be read and written."""

    def code(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        of = context.make_array(sig.args[0])(context, builder, args[0])
        found = cgutils.create_struct_proxy(sig.return_type)(context, builder)
        found.data = builder.bitcast(of.data, cgutils.voidptr_t)
        found.step = cgutils.unpack_tuple(builder, of.strides)[0]
        found.count = cgutils.unpack_tuple(builder, of.shape)[0]
        return found._getvalue()

    return _ROWS(array), code


def _place(context: Any, builder: Any, of: Any, held: Any, index: Any) -> Any:
    """Return the pointer to pack ``index`` of rows ``held``."""
    row = cgutils.create_struct_proxy(of)(context, builder, value=held)
    at = builder.ptrtoint(row.data, _INDEX)
    at = builder.add(at, builder.mul(index, row.step))
    return builder.inttoptr(at, _VECTOR.as_pointer())


@intrinsic
def _row(_typing: Any, held: Any, index: Any) -> Any:
    def code(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        return builder.load(_place(context, builder, sig.args[0], *args), align=8)

    return _PACK(held, types.intp), code


@intrinsic
def _put(_typing: Any, held: Any, index: Any, value: Any) -> Any:
    def code(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        builder.store(args[2], _place(context, builder, sig.args[0], *args[:2]), align=8)
        return context.get_dummy_value()

    return types.void(held, types.intp, _PACK), code


@intrinsic
def _count(_typing: Any, held: Any) -> Any:
    def code(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        return cgutils.create_struct_proxy(sig.args[0])(context, builder, value=args[0]).count

    return types.intp(held), code


@overload(operator.getitem)
def _getitem(held, index):  # type: ignore[no-untyped-def]
    if isinstance(held, _Rows):
        return lambda held, index: _row(held, index)
    return None


@overload(operator.setitem)
def _setitem(held, index, value):  # type: ignore[no-untyped-def]
    if isinstance(held, _Rows):
        return lambda held, index, value: _put(held, index, value)
    return None


@overload(len)
def _len(held):  # type: ignore[no-untyped-def]
    if isinstance(held, _Rows):
        return lambda held: _count(held)
    return None


@intrinsic
def lane(_typing: Any, pack: Any, i: Any) -> Any:
    """Return the number of film ``i`` in a ``pack``."""

    def code(_context: Any, builder: Any, _sig: Any, args: Any) -> Any:
        return builder.extract_element(*args)

    return types.float64(pack, types.intp), code


@intrinsic
def with_lane(_typing: Any, pack: Any, i: Any, value: Any) -> Any:
    """Return a ``pack`` whose number of film ``i`` is ``value``."""

    def code(_context: Any, builder: Any, _sig: Any, args: Any) -> Any:
        return builder.insert_element(args[0], args[2], args[1])

    return _PACK(pack, types.intp, types.float64), code


@intrinsic
def _spread(_typing: Any, value: Any) -> Any:
    def code(_context: Any, builder: Any, _sig: Any, args: Any) -> Any:
        return _splat(builder, args[0])

    return _PACK(types.float64), code


_Function = TypeVar("_Function", bound=Callable[..., Any])


def of_packs(in_pack: Callable[..., Any]) -> Callable[[_Function], _Function]:
    """Return a decorator of a function of numbers, in whose place packs get ``in_pack``.

    Both have the same parameters. Called by a kernel the one that fits is compiled into it; called
    from Python the function is as it stands.
    """

    def decorate(function: _Function) -> _Function:
        def chosen(*args: Any) -> Callable[..., Any]:
            return in_pack if any(isinstance(a, Pack) for a in args) else function

        # numba compares it with that of what it compiles
        chosen.__signature__ = inspect.signature(function)  # type: ignore[attr-defined]
        overload(function, jit_options=INTO_CALLER)(chosen)
        return function

    return decorate


def _spread_in_pack(value: float, like: float) -> float:
    return _spread(value)


@of_packs(_spread_in_pack)
def spread(value: float, like: float) -> float:
    """Return ``value`` for every film of a pack ``like``; ``value`` itself for one film."""
    return value


def _first_in_pack(number: float) -> float:
    return lane(number, 0)


@of_packs(_first_in_pack)
def first(number: float) -> float:
    """Return the ``number`` of a pack's first film; ``number`` itself of one film."""
    return number


@intrinsic
def _larger(_typing: Any, one: Any, other: Any) -> Any:
    def code(_context: Any, builder: Any, _sig: Any, args: Any) -> Any:
        below = builder.fsub(ir.Constant(_VECTOR, [0.0] * WIDTH), args[1])
        size = builder.select(builder.fcmp_ordered(">", below, args[1]), below, args[1])
        # of a size that is not a number the comparison is false, as of one film
        return builder.select(builder.fcmp_ordered(">", size, args[0]), size, args[0])

    return _PACK(one, other), code


def _larger_in_pack(one: float, other: float) -> float:
    return _larger(one, other)


@of_packs(_larger_in_pack)
def larger(one: float, other: float) -> float:
    """Return the larger of ``one`` and the size of an ``other`` number, for each film of a pack."""
    return max(one, abs(other))
