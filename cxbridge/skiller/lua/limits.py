"""The configured limits of skills: ``/skiller/limits/NAME``.

See docs/lua-engine.md#bounds.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

from msgspec.structs import asdict

from cxbridge.skiller.lua.engine import MEBIBYTE, Limits

if TYPE_CHECKING:
    from cxbridge.config import Configuration

LIMITS_PATH: Final = "/skiller/limits"
"""Where limits are configured, by their names in :class:`~cxbridge.skiller.lua.engine.Limits`."""

RANGES: Final[dict[str, tuple[float, float]]] = {
    "instructions_per_loop": (1_000, 4_000_000_000),
    "instructions_to_load": (1_000, 4_000_000_000),
    "seconds_per_loop": (0.001, 3600.0),
    "seconds_to_load": (0.001, 3600.0),
    "memory": (8 * MEBIBYTE, 4_000_000_000),
    "memory_per_loop": (MEBIBYTE // 16, 4_000_000_000),
}
"""The least and the most that each may be: no skill runs within less, and more is a slip.

Whole numbers in a configuration have 32 bits.
"""


def limits_of(config: Configuration) -> Limits:
    """Read the limits of a configuration; those that it does not name have their defaults.

    :raises ConfigError: for a limit that is unknown, no number or out of its range; with file and line.
    """
    known: dict[str, Any] = asdict(Limits())
    for name in config.keys(LIMITS_PATH):
        if name not in known:
            path = f"{LIMITS_PATH}/{name}"
            raise config.error(path, f"{path} means nothing", f"the limits are: {', '.join(known)}")
    read: dict[str, Any] = {
        name: config.get_float(f"{LIMITS_PATH}/{name}", default=default)
        if isinstance(default, float)
        else config.get_uint(f"{LIMITS_PATH}/{name}", default=default)
        for name, default in known.items()
    }
    for name, value in read.items():
        least, most = RANGES[name]
        if not least <= value <= most:
            path = f"{LIMITS_PATH}/{name}"
            raise config.error(path, f"{path} cannot be {value:g}", f"from {least:g} to {most:g}")
    return Limits(**read)
