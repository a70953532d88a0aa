"""The protocol of a planner's process: pickled values, with their length before them."""

from __future__ import annotations

import pickle
import struct
from dataclasses import dataclass
from math import inf
from typing import IO, Final

from cxbridge.executive.pddl.ast import Domain, Problem
from cxbridge.executive.planning.planner import Planner

_LENGTH: Final = struct.Struct("!Q")


@dataclass(frozen=True, slots=True)
class Job:
    """What to plan.

    :param seconds: how long the planner may take.
    :param memory: bytes of address space that the process may have; 0: no limit.
    """

    planner: Planner
    domain: Domain
    problem: Problem
    memory: int = 0
    seconds: float = inf


def send(stream: IO[bytes], value: object) -> None:
    """Write a value."""
    data = pickle.dumps(value)
    stream.write(_LENGTH.pack(len(data)) + data)
    stream.flush()


def receive(stream: IO[bytes]) -> object:
    """Read a value that :func:`send` wrote.

    :raises EOFError: when the other end is gone.
    """
    head = stream.read(_LENGTH.size)
    if len(head) < _LENGTH.size:
        raise EOFError
    length = _LENGTH.unpack(head)[0]
    data = stream.read(length)
    if len(data) < length:
        raise EOFError
    return pickle.loads(data)  # noqa: S301  from the process that we started, or that started us
