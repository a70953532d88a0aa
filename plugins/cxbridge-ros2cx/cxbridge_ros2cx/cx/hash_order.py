"""The order in which the original activates its environments: that of GNU's hash tables in C++."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Final

_BUCKETS: Final = (13, 29, 59, 127, 257, 541, 1109)
"""The sizes to which a table grows, one after the other."""

_SEED: Final = 0xC70F6907
_FACTOR: Final = 0xC6A4A7935BD1E995
_WORD: Final = 2**64 - 1


def hash_order(names: Iterable[str]) -> tuple[str, ...]:
    """Return names in the order of an ``std::unordered_map`` into which they are put one after the other."""
    order: list[str] = []
    size = 1
    for count, name in enumerate(names):
        if count >= size:
            size = next(each for each in _BUCKETS if each > count)
            present, order = order, []
            for each in present:
                _put(order, each, size)
        _put(order, name, size)
    return tuple(order)


def _put(order: list[str], name: str, size: int) -> None:
    """Put a name before those of its bucket, or before all when the bucket is empty."""
    bucket = hash_of(name) % size
    same = (place for place, other in enumerate(order) if hash_of(other) % size == bucket)
    order.insert(next(same, 0), name)


def hash_of(text: str) -> int:
    """Return what ``std::hash<std::string>`` returns: MurmurHash64A with the library's seed."""
    data = text.encode()
    whole = len(data) & ~7
    found = _SEED ^ (len(data) * _FACTOR & _WORD)
    for place in range(0, whole, 8):
        word = int.from_bytes(data[place : place + 8], "little")
        found = (found ^ (_mixed(word * _FACTOR & _WORD) * _FACTOR & _WORD)) * _FACTOR & _WORD
    if data[whole:]:
        found = (found ^ int.from_bytes(data[whole:], "little")) * _FACTOR & _WORD
    return _mixed(_mixed(found) * _FACTOR & _WORD)


def _mixed(word: int) -> int:
    return word ^ (word >> 47)
