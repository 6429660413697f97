"""Which lines of Python make NumPy ask for memory, and how often: by a handler of memory that NumPy calls (NEP 49).

tracemalloc knows what is still there; what a tick allocates and frees again nobody counts otherwise.
"""

import ctypes
import sys
from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import Any, Final, cast

import numpy as np

_SET_HANDLER, _GET_HANDLER = 304, 305
"""Where these functions are in NumPy's table of them, which never changes."""
_CAPSULE: Final = b"mem_handler"
_Allocate = ctypes.PYFUNCTYPE(ctypes.c_void_p, ctypes.c_void_p, ctypes.c_size_t)
_AllocateZeros = ctypes.PYFUNCTYPE(ctypes.c_void_p, ctypes.c_void_p, ctypes.c_size_t, ctypes.c_size_t)
_Grow = ctypes.PYFUNCTYPE(ctypes.c_void_p, ctypes.c_void_p, ctypes.c_void_p, ctypes.c_size_t)


class _Handler(ctypes.Structure):
    """PyDataMem_Handler, with its allocator."""

    _fields_ = (
        ("name", ctypes.c_char * 127),
        ("version", ctypes.c_uint8),
        ("context", ctypes.c_void_p),
        ("malloc", _Allocate),
        ("calloc", _AllocateZeros),
        ("realloc", _Grow),
        ("free", ctypes.c_void_p),
    )


Place = tuple[str, int]
"""A file and a line."""


@dataclass
class ArrayMemory:
    """What was asked for, by the line of Python that did."""

    times: Counter[Place] = field(default_factory=Counter)
    size_bytes: Counter[Place] = field(default_factory=Counter)

    def note(self, size_bytes: int) -> None:
        """Blame the caller's caller."""
        frame = sys._getframe(2)
        place = frame.f_code.co_filename, frame.f_lineno
        self.times[place] += 1
        self.size_bytes[place] += size_bytes


@contextmanager
def counted(memory: ArrayMemory) -> Iterator[None]:
    """Count what NumPy asks for meanwhile, in this thread."""
    set_handler, get_handler = _functions()
    before = get_handler()
    theirs = _Handler.from_address(_address(before))
    context, malloc, calloc, realloc = theirs.context, theirs.malloc, theirs.calloc, theirs.realloc

    def noted_malloc(_context: int, size: int) -> Any:
        memory.note(size)
        return malloc(context, size)

    def noted_calloc(_context: int, count: int, size: int) -> Any:
        memory.note(count * size)
        return calloc(context, count, size)

    def noted_realloc(_context: int, block: int, size: int) -> Any:
        memory.note(size)
        return realloc(context, block, size)

    noted = _Allocate(noted_malloc), _AllocateZeros(noted_calloc), _Grow(noted_realloc)
    # What is freed goes straight to where it came from.
    ours = _Handler(b"counted", theirs.version, context, *noted, theirs.free)
    # Arrays that outlive this free their memory by it, to the end of the process.
    ctypes.pythonapi.Py_IncRef(ctypes.py_object(ours))
    set_handler(_capsule(ctypes.addressof(ours)))
    try:
        yield
    finally:
        set_handler(before)


def _functions() -> tuple[Any, Any]:
    pointers = ctypes.cast(
        _address(cast(Any, np)._core._multiarray_umath._ARRAY_API, None), ctypes.POINTER(ctypes.c_void_p)
    )
    set_handler = ctypes.PYFUNCTYPE(ctypes.py_object, ctypes.py_object)(cast(int, pointers[_SET_HANDLER]))
    get_handler = ctypes.PYFUNCTYPE(ctypes.py_object)(cast(int, pointers[_GET_HANDLER]))
    return set_handler, get_handler


def _address(capsule: object, name: bytes | None = _CAPSULE) -> int:
    get = ctypes.pythonapi.PyCapsule_GetPointer
    get.restype, get.argtypes = ctypes.c_void_p, [ctypes.py_object, ctypes.c_char_p]
    return int(get(capsule, name))


def _capsule(address: int) -> Any:
    new = ctypes.pythonapi.PyCapsule_New
    new.restype, new.argtypes = ctypes.py_object, [ctypes.c_void_p, ctypes.c_char_p, ctypes.c_void_p]
    return new(address, _CAPSULE, None)
