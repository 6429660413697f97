"""Encoding and decoding of the arm's recorded states. Exports need them without the kernels of a simulation.

    state   time f64, n u16, positions n f64, velocities n f64, f u16, fingers f f64, opening f64,
            flags u8: 1 for holding, 2 for a doubt; its length u16 and text, if there is one,
            loads n f64 and simulated time f64, or the loads only, or nothing

Values are float64, bit for bit as the core got them.
"""

import struct
from typing import Any, Final

import numpy as np

from robot_side.arm.port import ArmState

_DOUBTED: Final = 2


def pack_state(state: ArmState) -> bytes:
    """Encode a state."""
    joints, fingers, loads = state.joint_positions_rad, state.finger_positions, state.joint_loads_nm
    simulated_s = None if loads is None else state.simulated_s
    doubt = None if state.doubt is None else state.doubt.encode()
    return b"".join(
        (
            struct.pack("<dH", state.time_s, len(joints)),
            joints.tobytes(),
            state.joint_velocities_rad_s.tobytes(),
            struct.pack("<H", len(fingers)),
            fingers.tobytes(),
            struct.pack("<dB", state.gripper_opening_m, state.gripper_holding + _DOUBTED * (state.doubt is not None)),
            b"" if doubt is None else struct.pack("<H", len(doubt)) + doubt,
            b"" if loads is None else loads.tobytes(),
            b"" if simulated_s is None else struct.pack("<d", simulated_s),
        )
    )


def unpack_state(content: bytes) -> ArmState:
    """Decode a state; ValueError or struct.error for invalid content."""
    time_s, joints = struct.unpack_from("<dH", content)
    position = 10

    def values(count: int) -> Any:
        nonlocal position
        read = np.frombuffer(content, "<f8", count, position).copy()
        position += 8 * count
        return read

    positions, velocities = values(joints), values(joints)
    (fingers,) = struct.unpack_from("<H", content, position)
    position += 2
    finger_positions = values(fingers)
    opening_m, flags = struct.unpack_from("<dB", content, position)
    position += 9
    doubt = None
    if flags & _DOUBTED:
        (length,) = struct.unpack_from("<H", content, position)
        doubt = content[position + 2 : position + 2 + length].decode()
        position += 2 + length
    loads = values(joints) if len(content) > position else None
    simulated_s = struct.unpack_from("<d", content, position)[0] if len(content) > position else None
    holding = bool(flags & 1)
    return ArmState(time_s, positions, velocities, finger_positions, opening_m, holding, loads, simulated_s, doubt)
