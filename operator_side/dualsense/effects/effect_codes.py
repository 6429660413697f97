"""The byte that sets a trigger's effect: the first of the eleven that the output report has for each trigger."""

from typing import Final

OFF_CODE: Final = 0x05
FEEDBACK_CODE: Final = 0x21
"""Also of several positions, and of slopes: the parameters tell."""
WEAPON_CODE: Final = 0x25
VIBRATION_CODE: Final = 0x26

BOW_CODE: Final = 0x22
GALLOPING_CODE: Final = 0x23
MACHINE_CODE: Final = 0x27
SIMPLE_FEEDBACK_CODE: Final = 0x01
SIMPLE_WEAPON_CODE: Final = 0x02
SIMPLE_VIBRATION_CODE: Final = 0x06
"""These six are unofficial."""

DEBUG_CODES: Final = frozenset({0xFC, 0xFD, 0xFE})
"""Never to reach a controller: they corrupt a trigger until it is reset."""
