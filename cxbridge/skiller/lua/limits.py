"""The limits of skills in time, memory and instructions; docs/skiller.md has the table."""

from __future__ import annotations

from msgspec import Struct

MEBIBYTE = 1024 * 1024


class Limits(Struct, frozen=True):
    """Limits of an engine's Lua code.

    :param instructions_per_loop: VM instructions per loop; a million takes about 10 ms.
    :param instructions_to_load: VM instructions for loading the skill space.
    :param seconds_per_loop: seconds of processor time per loop, because a single instruction such as
        ``s .. s`` may be expensive.
    :param seconds_to_load: seconds of processor time for loading the skill space.
    :param memory: the maximum size of all Lua objects in bytes.
    :param memory_per_loop: the maximum growth of the Lua objects in a loop, and the maximum length of a
        string, both in bytes.
    """

    instructions_per_loop: int = 2_000_000
    instructions_to_load: int = 50_000_000
    seconds_per_loop: float = 0.02
    seconds_to_load: float = 10.0
    memory: int = 128 * MEBIBYTE
    memory_per_loop: int = 4 * MEBIBYTE
