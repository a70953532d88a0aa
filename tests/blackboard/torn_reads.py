"""Reads during continuous writes: a torn read mixes two writes, an old read is older than an earlier read.

Each word of a block depends on a counter and on the position of the word, as does the time stamp, so that
each mix of two writes and each shift is detected. Only reads of a new block count. Threads read on a local
blackboard; processes with several open instances read over ZeroMQ (``ipc``), while other processes write and
serve.
"""

from __future__ import annotations

import hashlib
import multiprocessing
import random
import struct
import sys
import tempfile
import threading
import time
from collections.abc import Callable
from dataclasses import dataclass
from multiprocessing.connection import Connection
from typing import Any

from cxbridge.blackboard import BlackBoard, LocalBlackBoard
from cxbridge.blackboard.zmq import ZmqBlackBoard, ZmqBlackBoardServer
from cxbridge.clock import RealClock
from cxbridge.interfaces.classes import make_interface_class
from cxbridge.interfaces.instance import STAMP, Interface
from cxbridge.interfaces.layout import make_field, place_fields
from cxbridge.interfaces.schema import InterfaceSchema

WORDS = 320
INSTANCES = 8
"""The number of instances of a reader, which reads them in turn."""
READERS = 2
SECOND = 1_000_000

_FIELDS, _SIZE = place_fields([make_field("words", "uint32", WORDS)])
_SCHEMA = InterfaceSchema("TornInterface", hashlib.md5(b"torn").digest(), _SIZE, _FIELDS, ())
_TornInterface: Any = make_interface_class(_SCHEMA)
_PLACES = int.from_bytes(random.Random(7).randbytes(4 * WORDS), "little")  # different words
_EACH = int.from_bytes(struct.pack("<I", 1) * WORDS, "little")


class Registry:
    """A registry with a single type."""

    def get(self, name: str) -> type[Interface]:
        assert name == _SCHEMA.name
        known: type[Interface] = _TornInterface
        return known


def make_block(number: int) -> bytes:
    """Return the block of a write."""
    words = (number * _EACH) ^ _PLACES
    return STAMP.pack(*divmod(number, SECOND)) + words.to_bytes(4 * WORDS, "little")


def find_write_number(block: bytes) -> int | None:
    """Return the number of the write of a block; None for a mixed block."""
    seconds, microseconds = STAMP.unpack_from(block)
    number = int(seconds * SECOND + microseconds)
    words = int.from_bytes(block[STAMP.size :], "little") ^ _PLACES
    return number if words == number * _EACH else None


@dataclass
class Tally:
    """The number of reads of a new block, and of torn or old reads."""

    reads: int = 0
    faults: int = 0

    def add(self, other: Tally) -> None:
        self.reads += other.reads
        self.faults += other.faults


def write(board: BlackBoard, done: Callable[[], bool]) -> None:
    """Write without a pause."""
    writer = board.open_for_writing(_TornInterface, "torn", owner="writer")
    writer.auto_timestamping = False
    number = 0
    while not done():
        number += 1
        writer.set_from_chunk(make_block(number))
        writer.set_timestamp(number)
        writer.write()


def read(board: BlackBoard, reads: int) -> Tally:
    """Read until ``reads`` new blocks have arrived."""
    instances = [board.open_for_reading(_TornInterface, "torn", owner="reader") for _ in range(INSTANCES)]
    tally = Tally()
    newest = 0
    while (before := tally.reads) < reads:
        for instance in instances:
            if not instance.read():
                continue
            tally.reads += 1
            block = instance.to_bytes()
            number = find_write_number(block) if any(block) else 0  # 0 before the first write
            if number is None or number < newest:
                tally.faults += 1
            else:
                newest = number
        if tally.reads == before:
            time.sleep(0)  # give the processor to the writer
    for instance in instances:
        instance.close()
    return tally


def read_in_threads(reads: int) -> Tally:
    """Read in threads the blocks that another thread writes."""
    board = LocalBlackBoard(Registry(), RealClock())
    total = Tally()
    done = threading.Event()

    def reader() -> None:
        tally = read(board, reads // READERS)
        with lock:
            total.add(tally)

    lock = threading.Lock()
    readers = [threading.Thread(target=reader) for _ in range(READERS)]
    writer = threading.Thread(target=write, args=(board, done.is_set))
    before = sys.getswitchinterval()
    sys.setswitchinterval(1e-5)
    try:
        for thread in (writer, *readers):
            thread.start()
        for thread in readers:
            thread.join()
    finally:
        done.set()
        writer.join()
        sys.setswitchinterval(before)
        board.shutdown()
    return total


def _connect(url: str, name: str) -> ZmqBlackBoard:
    return ZmqBlackBoard(url, Registry(), RealClock(), name=name, connect_timeout=30.0, timeout=30.0)


def _write_in_process(url: str, pipe: Connection) -> None:
    with _connect(url, "writer") as board:
        write(board, pipe.poll)


def _read_in_process(url: str, pipe: Connection, reads: int) -> None:
    with _connect(url, "reader") as board:
        pipe.send(read(board, reads))


def read_in_processes(reads: int) -> Tally:
    """Read in processes over ZeroMQ the blocks that another process writes."""
    spawn = multiprocessing.get_context("spawn")
    total = Tally()
    with tempfile.TemporaryDirectory() as folder:
        board = LocalBlackBoard(Registry(), RealClock())
        url = f"ipc://{folder}/board"
        with ZmqBlackBoardServer(board, [url]):
            stop, stopped = spawn.Pipe()
            writer = spawn.Process(target=_write_in_process, args=(url, stopped), daemon=True)
            pipes, processes = [], [writer]
            for _ in range(READERS):
                own_end, reader_end = spawn.Pipe()
                pipes.append(own_end)
                arguments = (url, reader_end, reads // READERS)
                processes.append(spawn.Process(target=_read_in_process, args=arguments, daemon=True))
            for process in processes:
                process.start()
            try:
                for pipe in pipes:
                    total.add(pipe.recv())
            finally:
                stop.send(None)
                for process in processes:
                    process.join(30)
                    process.kill()
    return total
