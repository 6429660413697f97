"""Everything here rests on names that Numba does not promise to keep; nothing else in feelahead does.

Tried with the versions that pyproject.toml pins. To try another one: widen the pin, run tests/robot_side/compiled
on an empty cache, and see that cold compilation takes no longer.
"""

import contextlib
from collections.abc import Callable
from typing import Any, cast

from numba.core.caching import FunctionCache
from numba.core.compiler import CompilerBase, DefaultPassBuilder
from numba.core.compiler_machinery import LoweringPass, register_pass
from numba.core.typed_passes import NativeLowering


@register_pass(mutates_CFG=False, analysis_only=True)  # type: ignore[no-untyped-call]
class _ForCallers(LoweringPass):
    """What `NativeLowering` leaves out without machine code: making the function known to its callers."""

    _name = "for_callers"

    def __init__(self) -> None:
        super().__init__()  # type: ignore[no-untyped-call]

    def run_pass(self, state: Any) -> bool:
        """Numba knows a compiled function by its entry point, so each gets one that nothing calls."""
        entry_point = object().__reduce_ex__
        state["cr"] = state["cr"]._replace(cfunc=entry_point)
        state.targetctx.insert_user_function(entry_point, state["cr"].fndesc, [state["library"]])
        return True


class WithoutMachineCode(CompilerBase):
    """Compile to what a kernel needs to link the function in.

    By default Numba also makes machine code of it, and wrappers by which Python and C may call it: more than half
    of the time in all, as nothing but kernels calls these functions.
    """

    def define_pipelines(self) -> list[Any]:
        """The ordinary passes and `_ForCallers`."""
        self.state.flags.no_cpython_wrapper = True
        self.state.flags.no_cfunc_wrapper = True
        self.state.flags.no_compile = True
        passes: Any = DefaultPassBuilder.define_nopython_pipeline(self.state)  # type: ignore[no-untyped-call]
        passes.add_pass_after(_ForCallers, NativeLowering)
        passes.finalize()
        return [passes]


class _CacheByDigest(FunctionCache):
    """Numba's cache on disk, with a digest of ours in its key.

    Numba by itself looks only at the file of the kernel, and would go on running machine code with an old version of
    a building block from another file.
    """

    def __init__(self, function: Callable[..., Any], digest: Callable[[Callable[..., Any]], str]) -> None:
        super().__init__(function)  # type: ignore[no-untyped-call]
        self._digest = digest(function)

    def _index_key(self, signature: Any, codegen: Any) -> tuple[Any, ...]:
        key: tuple[Any, ...] = super()._index_key(signature, codegen)  # type: ignore[no-untyped-call]
        return (*key, self._digest)

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        """The compiled kernel, or None where there is none.

        What a damaged file holds (after a crash or a full disk) is thrown away and compiled again.
        """
        try:
            return super().load_overload(sig, target_context)  # type: ignore[no-untyped-call]
        except Exception:
            # Unpickling may raise anything.
            with contextlib.suppress(OSError):
                self.flush()  # type: ignore[no-untyped-call]
            return None


def keep_on_disk(dispatcher: Any, function: Callable[..., Any], digest: Callable[[Callable[..., Any]], str]) -> None:
    """Give the dispatcher of `function` a cache on disk that is keyed by `digest(function)`, too.

    RuntimeError where there is no writable place for it.
    """
    dispatcher._cache = cast(Any, _CacheByDigest)(function, digest)


def entry_point(dispatcher: Any, signature: Any) -> int:
    """The address of a compiled kernel's machine code, as kernels call each other."""
    result = dispatcher.overloads[signature.args]
    return int(result.library.get_pointer_to_function(result.fndesc.llvm_func_name))


def call_at(context: Any, builder: Any, signature: Any, address: Any, given: list[Any]) -> Any:
    """Build the call of a kernel of this signature at an address; what it returns."""
    convention = context.call_conv
    callee = builder.inttoptr(address, convention.get_function_type(signature.return_type, signature.args).as_pointer())
    status, result = convention.call_function(builder, callee, signature.return_type, signature.args, given)
    with cast(Any, builder).if_then(status.is_error):
        convention.return_status_propagate(builder, status)
    return result
