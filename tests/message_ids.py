"""Messages over each transport: no id is 0 or the shown id, and memory does not grow.

One reader sends, the writer takes each message, checks it and answers with its id in the field ``msgid``, as
a Skiller does; every 1000th time the reader waits for the answer. The writer is on the board that is served,
so both ends of the transport are in this process. ``gateway`` goes through ZeroMQ, a gateway, and Fawkes'
protocol.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from cxbridge.blackboard import BlackBoard, LocalBlackBoard
from cxbridge.blackboard.exclusive_control import skip_stale_ids
from cxbridge.blackboard.urls import open_blackboard
from cxbridge.blackboard.zmq.server import ZmqBlackBoardServer
from cxbridge.clock import RealClock
from cxbridge.events import EventBus
from cxbridge.interfaces import InterfaceRegistry
from tests.fawkes import TRANSPORT, fawkes_server

TRANSPORTS = ("local", "zmq", *TRANSPORT, *(("gateway",) if TRANSPORT else ()))


@contextmanager
def reach(board: LocalBlackBoard, transport: str) -> Iterator[BlackBoard]:
    """Yield a board behind a transport."""
    clock = RealClock()

    def connect(url: str) -> BlackBoard:
        return stack.enter_context(open_blackboard(url, InterfaceRegistry(), clock, EventBus(clock)))

    with ExitStack() as stack:
        folder = Path(stack.enter_context(TemporaryDirectory()))
        if transport == "local":
            yield board
            return
        if transport == "zmq":
            yield connect(stack.enter_context(ZmqBlackBoardServer(board, [f"ipc://{folder}/b"])).endpoints[0])
            return
        robot = connect(f"fawkes://127.0.0.1:{stack.enter_context(fawkes_server(board)).port}")
        if transport == "fawkes":
            yield robot
            return
        from cxbridge_fawkes.gateway import Gateway

        middle = stack.enter_context(LocalBlackBoard(InterfaceRegistry(), clock))
        gateway = stack.enter_context(Gateway(robot, middle, ["SkillerInterface"]))
        gateway.start()
        while not gateway.mirrors():
            time.sleep(0.01)
        yield connect(stack.enter_context(ZmqBlackBoardServer(middle, [f"ipc://{folder}/b"])).endpoints[0])


def drive(transport: str, count: int, gauge: Callable[[], int], batch: int) -> tuple[list[int], list[str]]:
    """Send messages; return the memory after each tenth, and the faults.

    :param gauge: returns the memory that this process uses.
    :param batch: messages between two waits for an answer.
    """
    faults: list[str] = []
    sizes: list[int] = []
    with LocalBlackBoard(InterfaceRegistry(), RealClock()) as board:
        writer: Any = board.open_for_writing("SkillerInterface", "Skiller")
        with reach(board, transport) as way:
            reader: Any = way.open_for_reading("SkillerInterface", "Skiller")
            for start in range(0, count, batch):
                faults += check_batch(reader, writer, min(batch, count - start), transport)
                if start + batch >= (len(sizes) + 1) * count / 10:
                    sizes.append(gauge())
                if len(faults) > 10:
                    break
            return sizes, faults


def check_batch(reader: Any, writer: Any, count: int, transport: str) -> list[str]:
    """Send some messages, and check them."""
    faults = []
    taken: list[int] = []
    sent = []
    for _ in range(count):
        if transport == "fawkes":
            skip_stale_ids(reader, may_control=False)
        message = reader.create_message("StopExecMessage")
        number = reader.msgq_enqueue(message)
        if number == 0:
            faults.append("a message had the id 0")
        sent.append(number)
        take(writer, taken)
    end = time.monotonic() + 30
    while len(taken) < count and time.monotonic() < end:
        take(writer, taken)
        time.sleep(0.0005)
    if len(taken) != count:
        return [*faults, f"{count} were sent and {len(taken)} taken"]
    return faults + check(reader, writer, sent, taken, transport)


def check(reader: Any, writer: Any, sent: list[int], taken: list[int], transport: str) -> list[str]:
    """Check the ids of a batch, and wait for the answer to its last message."""
    faults = []
    end = time.monotonic() + 30
    if transport != "gateway" and taken != sent:
        faults.append("other ids came than were given")
    if len(set(sent)) != len(sent):
        faults.append("an id was given twice within a batch")
    if taken[-1] == writer.msgid:
        faults.append("an id was the one that is shown")
    writer.msgid = taken[-1]
    writer.write()
    while reader.msgid != sent[-1] and time.monotonic() < end:
        time.sleep(0.0005)
        reader.read()
    if reader.msgid != sent[-1]:
        faults.append(f"message {sent[-1]} was not answered, but {reader.msgid}")
    return faults


def take(writer: Any, taken: list[int]) -> None:
    while (message := writer.msgq_pop()) is not None:
        if message.type == "StopExecMessage":
            taken.append(message.id)
