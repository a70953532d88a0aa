"""The limits of skills in time, memory and instructions, and their configuration ``/skiller/limits/NAME``.

docs/skiller.md, section "A skill in Lua", has the table.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

from msgspec import Struct
from msgspec.structs import asdict

if TYPE_CHECKING:
    from cxbridge.config import Configuration

MEBIBYTE = 1024 * 1024


class Limits(Struct, frozen=True):
    """Limits of an engine's Lua code.

    :param instructions_per_loop: VM instructions per loop; a million takes about 10 ms.
    :param instructions_to_load: VM instructions for loading the skill space.
    :param seconds_per_loop: seconds of processor time per loop, because a single instruction such as
        ``s .. s`` may be expensive.
    :param seconds_to_load: seconds of processor time for loading the skill space.
    :param memory: the bytes of all Lua objects.
    :param memory_per_loop: additional bytes per step, and the maximum length of a text.
    """

    instructions_per_loop: int = 2_000_000
    instructions_to_load: int = 50_000_000
    seconds_per_loop: float = 0.02
    seconds_to_load: float = 10.0
    memory: int = 128 * MEBIBYTE
    memory_per_loop: int = 4 * MEBIBYTE


LIMITS_PATH: Final = "/skiller/limits"
"""The configured limits, named as in :class:`Limits`."""

RANGES: Final[dict[str, tuple[float, float]]] = {
    "instructions_per_loop": (1_000, 4_000_000_000),
    "instructions_to_load": (1_000, 4_000_000_000),
    "seconds_per_loop": (0.001, 3600.0),
    "seconds_to_load": (0.001, 3600.0),
    "memory": (8 * MEBIBYTE, 4_000_000_000),
    "memory_per_loop": (MEBIBYTE // 16, 4_000_000_000),
}
"""The permitted range of each limit.

Skills need at least the minimum. The maximum catches typing mistakes and fits into the 32 bits of configured
integers.
"""


def read_limits(config: Configuration) -> Limits:
    """Read the limits; missing limits have their defaults.

    :raises ConfigError: if a limit is unknown, not a number or out of range, with file and line.
    """
    defaults: dict[str, Any] = asdict(Limits())
    # a misspelt limit would silently not hold
    for name in config.keys(LIMITS_PATH):
        if name not in defaults:
            path = f"{LIMITS_PATH}/{name}"
            raise config.error(path, f"{path} is not a limit", f"the limits are: {', '.join(defaults)}")
    limits: dict[str, Any] = {
        name: config.get_float(f"{LIMITS_PATH}/{name}", default=default)
        if isinstance(default, float)
        else config.get_uint(f"{LIMITS_PATH}/{name}", default=default)
        for name, default in defaults.items()
    }
    for name, value in limits.items():
        minimum, maximum = RANGES[name]
        if not minimum <= value <= maximum:
            path = f"{LIMITS_PATH}/{name}"
            raise config.error(path, f"{path} cannot be {value:g}", f"from {minimum:g} to {maximum:g}")
    return Limits(**limits)
