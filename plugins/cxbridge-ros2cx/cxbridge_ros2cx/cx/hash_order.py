"""The order in which the ROS 2 CX activates environments: the order of a GNU C++ hash table.

carologistics/clips_executive keeps its environments in an ``std::unordered_map``. This module computes the
iteration order of such a map, so that a recorded run can be compared in total order.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Final

# the bucket counts of a growing table in libstdc++, for more environments than any node has
_BUCKET_COUNTS: Final = (13, 29, 59, 127, 257, 541, 1109)

_HASH_SEED: Final = 0xC70F6907  # the seed of libstdc++'s std::hash
_HASH_FACTOR: Final = 0xC6A4A7935BD1E995  # multiplier of MurmurHash64A
_WORD_MASK: Final = 2**64 - 1  # cuts products to 64 bits, since Python's integers have no width


def order_by_hash(names: Iterable[str]) -> tuple[str, ...]:
    """Return names in the iteration order of an ``std::unordered_map`` filled in the given order."""
    order: list[str] = []
    bucket_count = 1
    for name_count, name in enumerate(names):
        # a full table gets more buckets, and inserts each name again in its previous order
        if name_count >= bucket_count:
            bucket_count = next(count for count in _BUCKET_COUNTS if count > name_count)
            previous_order, order = order, []
            for moved_name in previous_order:
                _insert(order, moved_name, bucket_count)
        _insert(order, name, bucket_count)
    return tuple(order)


def _insert(order: list[str], name: str, bucket_count: int) -> None:
    """Insert a name before the names of its bucket, or at the front if the bucket is empty."""
    buckets = [hash_string(placed_name) % bucket_count for placed_name in order]
    bucket = hash_string(name) % bucket_count
    order.insert(buckets.index(bucket) if bucket in buckets else 0, name)


def hash_string(text: str) -> int:
    """Return the result of libstdc++'s ``std::hash<std::string>``: MurmurHash64A with a fixed seed."""
    text_bytes = text.encode()
    tail_start = len(text_bytes) & ~7  # the bytes from here on do not fill a word of 8 bytes
    digest = _HASH_SEED ^ (len(text_bytes) * _HASH_FACTOR & _WORD_MASK)
    for offset in range(0, tail_start, 8):
        word = int.from_bytes(text_bytes[offset : offset + 8], "little")
        digest = (
            digest ^ (_shift_mix(word * _HASH_FACTOR & _WORD_MASK) * _HASH_FACTOR & _WORD_MASK)
        ) * _HASH_FACTOR & _WORD_MASK
    if text_bytes[tail_start:]:
        digest = (digest ^ int.from_bytes(text_bytes[tail_start:], "little")) * _HASH_FACTOR & _WORD_MASK
    return _shift_mix(_shift_mix(digest) * _HASH_FACTOR & _WORD_MASK)


def _shift_mix(word: int) -> int:
    return word ^ (word >> 47)  # the shift of MurmurHash64A
