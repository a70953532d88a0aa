"""The protocol of a planner's process: pickled values with a length prefix."""

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
    """A planning job.

    :param seconds: the time limit.
    :param memory: the limit of address space in bytes; 0: none.
    """

    planner: Planner
    domain: Domain
    problem: Problem
    memory: int = 0
    seconds: float = inf


def send(stream: IO[bytes], value: object) -> None:
    data = pickle.dumps(value)
    stream.write(_LENGTH.pack(len(data)) + data)
    stream.flush()


def receive(stream: IO[bytes]) -> object:
    """Read a value from :func:`send`.

    :raises EOFError: if the other process has ended.
    """
    head = stream.read(_LENGTH.size)
    if len(head) < _LENGTH.size:
        raise EOFError
    length = _LENGTH.unpack(head)[0]
    data = stream.read(length)
    if len(data) < length:
        raise EOFError
    return pickle.loads(data)  # noqa: S301  only cxbridge's own parent or child process writes to this pipe
