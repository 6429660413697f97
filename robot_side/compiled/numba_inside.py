"""All uses of Numba's private names, which may change without notice; no other module of feelahead has any.

Tested with the versions that pyproject.toml pins. To test another one: widen the pin, run tests/robot_side/compiled
with an empty cache, and check that cold compilation takes no longer.
"""

import contextlib
import math
import pickle
import sys
from typing import Any, Final, cast

import llvmlite
import numba
from llvmlite import ir
from numba.core.caching import _Cache
from numba.core.cgutils import alloca_once
from numba.core.codegen import JITCodeLibrary
from numba.core.compiler import CompilerBase, CompileResult
from numba.core.compiler_machinery import LoweringPass, PassManager, register_pass
from numba.core.registry import cpu_target
from numba.core.serialize import dumps
from numba.core.typed_passes import (
    IRLegalization,
    NativeLowering,
    NoPythonBackend,
    NopythonTypeInference,
    PreLowerStripPhis,
)
from numba.core.types import BooleanLiteral, IntegerLiteral
from numba.core.untyped_passes import FixupArgs, GenericRewrites, IRProcessing, ReconstructSSA, TranslateByteCode
from numba.np.arrayobj import get_itemsize, make_array

from robot_side.compiled.machine_code import keep, kept, machine_code_folder


@register_pass(mutates_CFG=False, analysis_only=True)  # type: ignore[no-untyped-call]
class _ForCallers(LoweringPass):
    """Compiler pass that registers a function for its callers. `NativeLowering` does so only with machine code."""

    _name = "for_callers"

    def __init__(self) -> None:
        super().__init__()  # type: ignore[no-untyped-call]

    def run_pass(self, state: Any) -> bool:
        """Register the function with a dummy entry point: Numba identifies compiled functions by their entry points."""
        entry_point = object().__reduce_ex__
        state["cr"] = state["cr"]._replace(cfunc=entry_point)
        state.targetctx.insert_user_function(entry_point, state["cr"].fndesc, [state["library"]])
        return True


class _Optimised(JITCodeLibrary):
    """Library whose code is optimised once, at the end. Numba's usual library does so three times."""

    def _optimize_functions(self, ll_module: Any) -> None:
        ll_module.data_layout = self._codegen._data_layout

    def _optimize_final_module(self) -> None:
        passes, builder = cast(Any, self._codegen)._module_pass_manager()
        passes.run(self._final_module, builder)


class _ForLinking(_Optimised):
    """Library of one function's code as it was written, which is only linked into kernels.

    Numba's usual library links and optimises a function again with each function that calls it.
    """

    def finalize(self) -> None:
        """Do nothing but note the addresses that the code contains: the kernel links and optimises it."""
        self._finalize_dynamic_globals()  # type: ignore[no-untyped-call]
        self._finalized = True


class _Kernel(_Optimised):
    """Library of a kernel, into which each function that it uses is linked once. All are optimised together."""

    def finalize(self) -> None:
        """Link, optimise, and generate machine code."""
        found = dict.fromkeys(self._linking_libraries)
        waiting = list(found)
        while waiting:
            library = waiting.pop()
            if isinstance(library, _ForLinking):
                new = [other for other in library._linking_libraries if other not in found]
                found.update(dict.fromkeys(new))
                waiting += new
        self._linking_libraries = list(found)
        super().finalize()  # type: ignore[no-untyped-call]


def _pipeline(state: Any, library: Any, *last: Any) -> list[Any]:
    """Return the compiler's passes: those of Numba's that our functions need, a third of all."""
    state.library = library(state.targetctx.codegen(), state.func_id.func_qualname)
    state.library.enable_object_caching()
    passes: Any = PassManager("kernels")  # type: ignore[no-untyped-call]
    for one in (*_PASSES, *last):
        passes.add_pass(one, one.__name__)
    passes.finalize()
    return [passes]


_PASSES: Final[tuple[Any, ...]] = (
    *(TranslateByteCode, FixupArgs, IRProcessing, GenericRewrites, ReconstructSSA),
    *(NopythonTypeInference, PreLowerStripPhis, IRLegalization, NativeLowering),
)


class ForPython(CompilerBase):
    """Compiler of kernels."""

    def define_pipelines(self) -> list[Any]:
        """Return the pipeline, which ends with machine code."""
        self.state.flags.no_cfunc_wrapper = True
        return _pipeline(self.state, _Kernel, NoPythonBackend)


class WithoutMachineCode(CompilerBase):
    """Compiler of functions that only kernels call. It stops once there is code that a kernel can link.

    By default Numba goes on to machine code and wrappers for Python and C, which take more than half of the time.
    """

    def define_pipelines(self) -> list[Any]:
        """Return the pipeline, which ends with `_ForCallers`."""
        flags = self.state.flags
        flags.no_cpython_wrapper = flags.no_cfunc_wrapper = flags.no_compile = True
        return _pipeline(self.state, _ForLinking, _ForCallers, NoPythonBackend)


def ignore_constants(dispatcher: Any) -> Any:
    """Let Numba compile one version of a function for all integers and bools; return the function's dispatcher.

    By default Numba compiles one version more for each constant that is an argument.
    """
    of_types = dispatcher.get_call_template

    def plain(given: Any) -> Any:
        return given.literal_type if isinstance(given, BooleanLiteral | IntegerLiteral) else given

    def of_plain_types(args: Any, kws: Any) -> Any:
        return of_types(tuple(map(plain, args)), {name: plain(value) for name, value in kws.items()})

    dispatcher.get_call_template = of_plain_types
    return dispatcher


def machine() -> str:
    """Return the versions of Numba, llvmlite and Python, and the processor, on which machine code depends."""
    processor = cast(Any, cpu_target).target_context.codegen().magic_tuple()
    return f"{numba.__version__} {llvmlite.__version__} {sys.implementation.cache_tag} {processor}"


class _OnDisk(_Cache):
    """Cache of one kernel's machine code, in a file of `machine_code`. It replaces Numba's own cache.

    Numba's checks only the kernel's own source file, so it would run an old version of a building block from another
    file. It also stores nothing in a read-only folder, and a full disk raises an error that would end the program.
    """

    cache_path = property(lambda _: str(machine_code_folder()))

    def __init__(self, name: str, key: str) -> None:
        self._names: Final = name, key

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        """Return the compiled kernel from disk; None if there is none that can be read."""
        del sig
        target_context.refresh()
        code = kept(*self._names)
        # Numba's own format. A program that can write to this folder can run code as this user anyway.
        with contextlib.suppress(Exception):  # unpickling may raise anything: then the kernel is compiled again
            return code and cast(Any, CompileResult)._rebuild(target_context, *pickle.loads(code))  # noqa: S301
        return None

    def save_overload(self, sig: Any, data: Any) -> None:
        """Store the compiled kernel."""
        del sig
        # Dynamic globals are addresses of this process.
        if not data.library.has_dynamic_globals:
            keep(*self._names, cast(Any, dumps)(data._reduce()))

    def enable(self) -> None:
        """Do nothing: the cache is always enabled."""

    disable = flush = enable


def keep_on_disk(dispatcher: Any, name: str, key: str) -> None:
    """Let a kernel's dispatcher load machine code for `name` and `key` from disk, and store new code there."""
    dispatcher._cache = cast(Any, _OnDisk)(name, key)


def entry_point(dispatcher: Any, signature: Any) -> int:
    """Return the address of a compiled kernel's machine code, for calls from other kernels."""
    result = dispatcher.overloads[signature.args]
    return int(result.library.get_pointer_to_function(result.fndesc.llvm_func_name))


def call_at(context: Any, builder: Any, signature: Any, address: Any, given: list[Any]) -> Any:
    """Emit LLVM code that calls a kernel of this signature at an address; return the result's value.

    An error in the called kernel is passed on to the caller.
    """
    convention = context.call_conv
    callee = builder.inttoptr(address, convention.get_function_type(signature.return_type, signature.args).as_pointer())
    status, result = convention.call_function(builder, callee, signature.return_type, signature.args, given)
    with cast(Any, builder).if_then(status.is_error):
        convention.return_status_propagate(builder, status)
    return result


def array_at(context: Any, builder: Any, array_type: Any, pointer: Any, count: Any, inner: tuple[int, ...]) -> Any:
    """Emit LLVM code that makes a C-contiguous array of this type around the memory at a pointer, and return the array.

    The shape is (count, *inner); `count` is a 64-bit integer. The memory is not owned, so it is never freed.
    """
    integer, itemsize = count.type, get_itemsize(context, array_type)  # type: ignore[no-untyped-call]
    data = builder.bitcast(pointer, context.get_data_type(array_type.dtype).as_pointer())
    items = builder.mul(count, integer(math.prod(inner))) if inner else count
    # Numba's fields: the memory's owner, its parent, number of items, bytes of an item, data, shape, strides.
    array = ir.Constant(context.get_value_type(array_type), None)
    for place, value in enumerate((items, integer(itemsize), data), start=2):
        array = builder.insert_value(array, value, place)
    for axis, size in enumerate((count, *map(integer, inner))):
        array = builder.insert_value(array, size, (5, axis))
        array = builder.insert_value(array, integer(itemsize * math.prod(inner[axis:])), (6, axis))
    return array


def elements_of(context: Any, builder: Any, table_type: Any, table: Any, count: int) -> list[Any]:
    """Emit LLVM code that reads the first `count` elements of a C-contiguous table; return the elements' values."""
    data = make_array(table_type)(context, builder, table).data  # type: ignore[no-untyped-call]
    index = ir.IntType(64)
    return [builder.load(builder.gep(data, [index(place)])) for place in range(count)]


def room_on_stack(context: Any, builder: Any, element: Any, count: int) -> Any:
    """Emit LLVM code that reserves `count` elements in the function's stack frame; return the pointer.

    The memory begins at a cache line.
    """
    room = alloca_once(builder, context.get_data_type(element), count)  # type: ignore[no-untyped-call]
    room.align = 64
    return room
