"""Effects of a lab's own: wrenches that files outside of this package define (:mod:`rig_identification.own`).

Each is called through the address of its machine code, which stands in ``physics`` beside its numbers, once
compiled for real and once for complex numbers: no other file of the model knows it, and none is compiled anew
for it. An address is a whole number below 2^53, which a float holds exactly.
"""

from __future__ import annotations

from functools import lru_cache
from typing import Any

import numpy as np
from llvmlite import ir  # type: ignore[import-untyped]
from numba import carray, cfunc, njit, types  # type: ignore[attr-defined]
from numba.extending import intrinsic

from rig_identification.model.effects.place import OWN_NUMBERS, OWN_SIZE, active, own_block
from rig_identification.own import MOST_EFFECTS, MOST_NUMBERS, OwnEffect

_WORDS = types.void(types.int64, types.int64, types.int64, types.int64)


@intrinsic
def _pointer(typing, address):  # type: ignore[no-untyped-def]
    """An address as a pointer."""

    def generate(context, builder, signature, arguments):  # type: ignore[no-untyped-def]
        return builder.inttoptr(arguments[0], ir.IntType(8).as_pointer())

    return types.voidptr(address), generate


@intrinsic
def _call(typing, code, numbers, x, R, wrench):  # type: ignore[no-untyped-def]
    """Call the code at an address with the addresses of four arrays."""

    def generate(context, builder, signature, arguments):  # type: ignore[no-untyped-def]
        word = ir.IntType(64)
        kind = ir.FunctionType(ir.VoidType(), [word] * 4).as_pointer()
        builder.call(builder.inttoptr(arguments[0], kind), list(arguments[1:]))
        return context.get_dummy_value()

    return types.void(code, numbers, x, R, wrench), generate


@lru_cache(maxsize=64)
def code_of(effect: OwnEffect) -> tuple[Any, Any]:
    """An effect's wrench as machine code for real and for complex numbers; ``address`` is where each stands.

    It is kept for as long as the process runs: models call it.
    """
    law = njit(nogil=True)(effect.wrench)
    return _code(law, np.float64), _code(law, np.complex128)


def _code(law: Any, kind: Any) -> Any:
    @cfunc(_WORDS)
    def call(numbers, x, R, out):  # type: ignore[no-untyped-def]
        law(
            carray(_pointer(numbers), MOST_NUMBERS, kind),  # type: ignore[call-arg]
            carray(_pointer(x), 12, kind),  # type: ignore[call-arg]
            carray(_pointer(R), (3, 3), kind),  # type: ignore[call-arg]
            carray(_pointer(out), 6, kind),  # type: ignore[call-arg]
        )

    return call


@njit(cache=True, inline="always")
def _asked(physics, first):  # type: ignore[no-untyped-def]
    """Whether any number of the effect at entry ``first``, or its derivative, is asked for."""
    found = False
    for i in range(first + OWN_NUMBERS, first + OWN_SIZE):
        found = found or active(physics[i])
    return found


@njit(cache=True, inline="always")
def own_active(physics, block):  # type: ignore[no-untyped-def]
    """Whether any effect of the lab's own is asked for."""
    found = False
    for k in range(MOST_EFFECTS):
        found = found or _asked(physics, own_block(block, k))
    return found


@njit(cache=True)
def add_own(physics, block, x, R, r):  # type: ignore[no-untyped-def]
    """Add the wrench of each effect that has a number to r."""
    wrench = np.zeros(6, physics.dtype)
    for k in range(MOST_EFFECTS):
        first = own_block(block, k)
        code = physics[first if wrench.itemsize == 8 else first + 1].real
        if code == 0.0 or not _asked(physics, first):
            continue
        numbers = physics[first + OWN_NUMBERS : first + OWN_SIZE]
        wrench[:] = 0.0
        _call(np.int64(code), numbers.ctypes.data, x.ctypes.data, R.ctypes.data, wrench.ctypes.data)  # type: ignore[call-arg]
        for i in range(6):
            r[i] += wrench[i]
