"""What a field of a local interface costs, in times of a bare struct call on the same field.

The yardstick is ``struct.unpack_from(format, buffer, offset)`` and ``struct.pack_into(format, buffer,
offset, ...)`` in the same process, in turn with what is measured; strings are bytes to struct, already
encoded. Printed is the median of the rounds' ratios. There are two ways of writing: ``write`` gives another
value each time; ``first`` too, but to a block that is not marked as changed, which is what a loop does that
sets a field once before each write().

    python -m benchmarks.bench_fields     exits with 1 when a read or a write is above the limit
"""

from __future__ import annotations

import statistics
import struct
import sys
import timeit
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from cxbridge.interfaces.block import Block
from cxbridge.interfaces.classes import make_interface_class
from cxbridge.interfaces.layout import make_field, place_fields
from cxbridge.interfaces.schema import EnumItem, EnumSchema, InterfaceSchema

LIMIT = 3.0
ROUNDS = 11
REPEATS = 3  # of which the best counts, in every round: other processes only ever add time
ENUM = EnumSchema("Mode", tuple(EnumItem(f"MODE_{number}", number) for number in range(4)))

Value = Any


@dataclass(frozen=True)
class Case:
    """A field to measure, with two values of it."""

    type: str
    length: int | None
    values: tuple[Value, Value]

    @property
    def name(self) -> str:
        return f"{self.type}_{self.length or 'one'}"


CASES = [
    Case("bool", None, (True, False)),
    Case("int8", None, (-3, 4)),
    Case("uint8", None, (3, 4)),
    Case("int16", None, (-300, 400)),
    Case("uint16", None, (300, 400)),
    Case("int32", None, (-70000, 7)),
    Case("uint32", None, (70000, 7)),
    Case("int64", None, (-(1 << 40), 7)),
    Case("uint64", None, (1 << 40, 7)),
    Case("float", None, (1.5, 0.1)),
    Case("double", None, (1.5, 0.1)),
    Case("byte", None, (1, 2)),
    Case("Mode", None, (1, 2)),
    Case("string", 32, ("map", "base_link")),
    Case("string", 128, ("no error", "the gripper is stuck")),
    Case("string", 1024, ('say{text="hello"}', 'goto{place="C-BS-I"}')),
    Case("int32", 8, (tuple(range(8)), tuple(range(1, 9)))),
    Case("double", 3, ((0.5, 1.5, 2.5), (3.5, 4.5, 5.5))),
    Case("float", 360, (tuple(map(float, range(360))), tuple(map(float, range(1, 361))))),
    Case("Mode", 4, ((0, 1, 2, 3), (3, 2, 1, 0))),
]


def make_block() -> Block:
    """Make a block that has all the fields."""
    fields = [
        make_field(case.name, case.type, case.length, enum=ENUM if case.type == ENUM.name else None)
        for case in CASES
    ]
    placed, datasize = place_fields(fields)
    schema = InterfaceSchema("BenchInterface", bytes(16), datasize, placed, enums=(ENUM,))
    block_class = make_interface_class(schema)
    block = block_class.__new__(block_class)
    Block.__init__(block)
    return block


def measure(block: Block, case: Case) -> dict[str, float]:
    """Return the ratios for one field."""
    field = block.field(case.name)
    code = field.storage.code
    layout = f"={field.runtime_length}{code}"
    raw = [value.encode() if case.type == "string" else value for value in case.values]
    spread = "*" if field.is_array else ""
    names = {"block": block, "buffer": bytearray(block.to_bytes()), "struct": struct}
    names |= {"a": case.values[0], "b": case.values[1], "raw_a": raw[0], "raw_b": raw[1]}
    setattr(block, case.name, case.values[0])
    count = 5_000 if field.size < 100 else 1_000

    def timer(statement: str) -> Callable[[], float]:
        bench = timeit.Timer(statement, globals=names)
        return lambda: min(bench.repeat(REPEATS, count))

    place = f"'{layout}', buffer, {field.offset}"
    bare_read = timer(f"struct.unpack_from({place})")
    bare_write = timer(f"struct.pack_into({place}, {spread}raw_a); struct.pack_into({place}, {spread}raw_b)")
    read = timer(f"block.{case.name}")
    write = timer(f"block.{case.name} = a; block.{case.name} = b")
    unmark = "block._changed = False"
    first = timer(f"{unmark}; block.{case.name} = a; {unmark}; block.{case.name} = b")
    marks = timer(f"{unmark}; {unmark}")
    reads, writes, firsts = [], [], []
    for _ in range(ROUNDS):
        reads.append(read() / bare_read())
        yardstick = bare_write()
        writes.append(write() / yardstick)
        firsts.append((first() - marks()) / yardstick)
    return {
        name: statistics.median(ratios)
        for name, ratios in zip(("read", "write", "first"), (reads, writes, firsts), strict=True)
    }


def main() -> int:
    """Measure all fields and print the table."""
    block = make_block()
    print(f"{'field':>14} {'read':>6} {'write':>6} {'first':>6}   times a struct call, limit {LIMIT:g}")
    worst = 0.0
    for case in CASES:
        ratios = measure(block, case)
        worst = max(worst, ratios["read"], ratios["write"])
        print(f"{case.name:>14} " + " ".join(f"{ratio:6.2f}" for ratio in ratios.values()))
    print(f"worst read or write: {worst:.2f}")
    return int(worst > LIMIT)


if __name__ == "__main__":
    sys.exit(main())
