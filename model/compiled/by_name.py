"""Kernels that their callers find by name in the running program, and do not contain.

Numba puts what a kernel calls into the kernel's own code, and optimises all of it once more: the
effects stood in a dozen kernels, a third of the first compilation. A kernel made here is compiled
once. Its callers know its name and its types; its address is given to the linker before
any of them is compiled or read from the cache.
"""

from __future__ import annotations

import functools
from collections.abc import Callable
from typing import Any, TypeVar

from llvmlite.binding import add_symbol
from numba.core import cgutils, sigutils, types
from numba.core.compiler_lock import global_compiler_lock
from numba.core.typing.templates import ConcreteTemplate, infer_global, signature
from numba.extending import lower_builtin

from dearig.model.compiled.addresses import PROVIDERS, provide
from dearig.model.compiled.jit import is_enabled, jit

__all__ = ["MATRIX", "VECTOR", "by_name", "compile_some"]

#: Numba's texts for contiguous arrays of numbers that can be written, of one and two dimensions.
VECTOR, MATRIX = "float64[::1]", "float64[:, ::1]"

_Function = TypeVar("_Function", bound=Callable[..., Any])


def by_name(types_of: str) -> Callable[[_Function], _Function]:
    """Return a decorator that compiles a function as ``jit`` does, for one choice of types.

    ``types_of`` is numba's text of a signature, such as ``"float64(int64, float64[::1])"``.
    """

    def decorate(function: _Function) -> _Function:
        return _found_by_name(function, types_of) if is_enabled() else function

    return decorate


def _found_by_name(function: _Function, types_of: str) -> _Function:
    kernel: Any = jit(function)
    arguments, returned = sigutils.normalize_signature(types_of)
    called = signature(returned, *arguments)
    symbol = f"{function.__module__}.{function.__qualname__}"

    @functools.wraps(function)
    def stand_in(*given: Any) -> Any:
        return kernel(*given)

    def give() -> None:
        kernel.compile(called)
        compiled = kernel.overloads[arguments]
        name = compiled.fndesc.llvm_func_name
        add_symbol(symbol, compiled.library.get_pointer_to_function(name))

    class Template(ConcreteTemplate):
        key = stand_in
        cases = (called,)

        def apply(self, args: Any, kws: Any) -> Any:
            """Return the types of a call; first let the linker know what is called."""
            provide(symbol)
            return super().apply(args, kws)

    def code(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        convention = context.call_conv
        kind = convention.get_function_type(sig.return_type, sig.args)
        target = cgutils.get_or_insert_function(builder.module, kind, symbol)
        status, value = convention.call_function(builder, target, sig.return_type, sig.args, args)
        with cgutils.if_unlikely(builder, status.is_error):
            convention.return_status_propagate(builder, status)
        return value

    infer_global(stand_in, types.Function(Template))
    lower_builtin(stand_in, *called.args)(code)
    PROVIDERS[symbol] = give
    return stand_in  # type: ignore[return-value]


def compile_some(part: int, of: int) -> None:
    """Compile every ``of``-th kernel that is found by name, from number ``part`` on."""
    with global_compiler_lock:
        for symbol in list(PROVIDERS)[part::of]:
            provide(symbol)
