"""All uses of Numba's private names, which may change without notice; no other module of feelahead has any.

Tested with the versions that pyproject.toml pins. To test another one: widen the pin, run tests/robot_side/compiled
with an empty cache, and check that cold compilation takes no longer.
"""

import contextlib
import pickle
import sys
from typing import Any, Final, cast

import llvmlite
import numba
from numba.core.caching import _Cache
from numba.core.cgutils import alloca_once
from numba.core.codegen import JITCodeLibrary
from numba.core.compiler import CompilerBase, CompileResult, DefaultPassBuilder
from numba.core.compiler_machinery import LoweringPass, register_pass
from numba.core.registry import cpu_target
from numba.core.serialize import dumps
from numba.core.typed_passes import NativeLowering
from numba.core.types import BooleanLiteral, boolean
from numba.np.arrayobj import get_itemsize, make_array, populate_array

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


class _ForLinking(JITCodeLibrary):
    """Library of optimised code that is only linked into kernels, and never loaded to run by itself.

    With Numba's usual library a kernel's loops over lanes are half as fast.
    """

    def _finalize_final_module(self) -> None:
        self._finalize_dynamic_globals()  # type: ignore[no-untyped-call]
        self._finalized = True


class WithoutMachineCode(CompilerBase):
    """Compiler of functions that only kernels call. It stops once there is code that a kernel can link.

    By default Numba goes on to machine code and wrappers for Python and C, which take more than half of the time.
    """

    def define_pipelines(self) -> list[Any]:
        """Return the pipeline: Numba's ordinary passes, with `_ForCallers` added."""
        self.state.flags.no_cpython_wrapper = True
        self.state.flags.no_cfunc_wrapper = True
        self.state.flags.no_compile = True
        library: Any = cast(Any, _ForLinking)(self.state.targetctx.codegen(), self.state.func_id.func_qualname)
        library.enable_object_caching()
        self.state.library = library
        passes: Any = DefaultPassBuilder.define_nopython_pipeline(self.state)  # type: ignore[no-untyped-call]
        passes.add_pass_after(_ForCallers, NativeLowering)
        passes.finalize()
        return [passes]


def ignore_constant_flags(dispatcher: Any) -> Any:
    """Let Numba compile one version of a function for all bools; return the function's dispatcher.

    By default Numba compiles one version for a literal True and one for a literal False.
    """
    of_types = dispatcher.get_call_template

    def plain(given: Any) -> Any:
        return boolean if isinstance(given, BooleanLiteral) else given

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


def array_at(context: Any, builder: Any, array_type: Any, pointer: Any, shape: list[Any]) -> Any:
    """Emit LLVM code that makes a C-contiguous array of this type around the memory at a pointer, and return the array.

    shape: 64-bit integers. The memory is not owned, so it is never freed.
    """
    array = make_array(array_type)(context, builder)  # type: ignore[no-untyped-call]
    itemsize = shape[0].type(get_itemsize(context, array_type))  # type: ignore[no-untyped-call]
    strides = [itemsize]
    for size in reversed(shape[1:]):
        strides.insert(0, builder.mul(size, strides[0]))
    data = builder.bitcast(pointer, context.get_data_type(array_type.dtype).as_pointer())
    populate_array(array, data, shape, strides, itemsize, meminfo=None)  # type: ignore[no-untyped-call]
    return array._getvalue()


def element_of(context: Any, builder: Any, table_type: Any, table: Any, row: int, column: int) -> Any:
    """Emit LLVM code that reads one element of a C-contiguous table of two columns; return the element's value."""
    array = make_array(table_type)(context, builder, table)  # type: ignore[no-untyped-call]
    return builder.load(builder.gep(array.data, [array.itemsize.type(2 * row + column)]))


def room_on_stack(context: Any, builder: Any, element: Any, count: int) -> Any:
    """Emit LLVM code that reserves `count` elements in the function's stack frame; return the pointer.

    The memory begins at a cache line.
    """
    room = alloca_once(builder, context.get_data_type(element), count)  # type: ignore[no-untyped-call]
    room.align = 64
    return room
