"""The order in which carologistics/clips_executive activates environments: that of a GNU C++ hash table."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Final

_BUCKETS: Final = (13, 29, 59, 127, 257, 541, 1109)  # numbers of buckets of a growing table

_SEED: Final = 0xC70F6907  # of libstdc++'s std::hash
_FACTOR: Final = 0xC6A4A7935BD1E995  # multiplier of MurmurHash64A
_WORD: Final = 2**64 - 1  # Python's integers have no width: products are cut to 64 bits


def hash_order(names: Iterable[str]) -> tuple[str, ...]:
    """Return names in the iteration order of an ``std::unordered_map`` filled in the given order."""
    order: list[str] = []
    size = 1
    for count, name in enumerate(names):
        # a rehash goes through the old order and inserts each name again
        if count >= size:
            size = next(buckets for buckets in _BUCKETS if buckets > count)
            old_order, order = order, []
            for moved_name in old_order:
                _insert(order, moved_name, size)
        _insert(order, name, size)
    return tuple(order)


def _insert(order: list[str], name: str, size: int) -> None:
    """Insert a name before the names of its bucket, or at the front if the bucket is empty."""
    bucket = hash_of(name) % size
    indices = (index for index, placed in enumerate(order) if hash_of(placed) % size == bucket)
    order.insert(next(indices, 0), name)


def hash_of(text: str) -> int:
    """Return the result of ``std::hash<std::string>``: MurmurHash64A with the library's seed."""
    data = text.encode()
    tail = len(data) & ~7  # start of the bytes that fill no word
    digest = _SEED ^ (len(data) * _FACTOR & _WORD)
    for offset in range(0, tail, 8):
        word = int.from_bytes(data[offset : offset + 8], "little")
        digest = (digest ^ (_shift_mix(word * _FACTOR & _WORD) * _FACTOR & _WORD)) * _FACTOR & _WORD
    if data[tail:]:
        digest = (digest ^ int.from_bytes(data[tail:], "little")) * _FACTOR & _WORD
    return _shift_mix(_shift_mix(digest) * _FACTOR & _WORD)


def _shift_mix(word: int) -> int:
    return word ^ (word >> 47)
