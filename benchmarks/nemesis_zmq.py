"""Kills and stops processes on a blackboard over ZeroMQ at random, and checks their histories.

::

    python -m benchmarks.nemesis_zmq [SECONDS]

There are a daemon, writers that contend for one interface, and readers that check the blocks and send
messages. From time to time a random process is killed and started again, or stopped for at most a second. The
claims:

- *single writer*: at the daemon each block comes from the process that is the writer at that moment;
- *untorn, monotone*: a block is whole, and a reader never reads an older block of a writer after a newer one;
- *acknowledged means delivered*: a writer has received each acknowledged message, once and in order;
- *no stale writer*: the daemon soon releases a stopped writer, and the interface can be opened again;
- *still working*: at the end a write reaches a reader within two seconds.
"""

from __future__ import annotations

import os
import random
import signal
import subprocess
import sys
import tempfile
import threading
import time
import zlib
from collections import Counter
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

from cxbridge.blackboard import EventKind, Listener, LocalBlackBoard, listening
from cxbridge.blackboard.errors import BlackBoardError
from cxbridge.blackboard.zmq import ZmqBlackBoard, ZmqBlackBoardServer
from cxbridge.clock import RealClock
from cxbridge.interfaces import InterfaceRegistry
from cxbridge.interfaces.instance import Interface, Message

HEARTBEAT_S = 0.1  # short, so that the daemon soon releases stopped processes
TYPE, ID = "SkillerInterface", "contested"
PAYLOAD_LENGTH = 900  # characters of a payload without its checksum; the field has 1024 bytes


class Journal:
    """Lines of a process, each written at once, so that they outlive a killed process."""

    def __init__(self, folder: Path, role: str) -> None:
        self._fd = os.open(folder / f"{role}.{os.getpid()}.log", os.O_WRONLY | os.O_CREAT | os.O_APPEND)

    def note(self, *words: object) -> None:
        """Write a line."""
        os.write(self._fd, (" ".join(str(word) for word in words) + "\n").encode())


class Write(NamedTuple):
    """A write: the writer's process id, and the number of the write from 1."""

    pid: int
    number: int


def payload(pid: int, number: int) -> str:
    """Return ``pid:number:``, repeated, and its checksum, so that mixed texts are detected."""
    unit = f"{pid}:{number}:"
    text = (unit * (PAYLOAD_LENGTH // len(unit) + 1))[:PAYLOAD_LENGTH]
    return f"{text}|{zlib.crc32(text.encode()):08x}"


def parse(text: str) -> Write | None:
    """Return the write of a payload; None for a mixed payload."""
    body, _, checksum = text.partition("|")
    if f"{zlib.crc32(body.encode()):08x}" != checksum:
        return None
    pid, number, _ = body.split(":", 2)
    return Write(int(pid), int(number))


def connect(url: str, name: str) -> ZmqBlackBoard:
    """Connect a client with this name; try again until the daemon is available."""
    while True:
        try:
            return ZmqBlackBoard(url, InterfaceRegistry(), RealClock(), name=name, timeout=2.0)
        except BlackBoardError:
            time.sleep(0.05)


# -- the roles


class _WriteReferee(Listener):
    """Checks each write at the daemon, and notes violations."""

    def __init__(self, journal: Journal) -> None:
        self._journal = journal

    def data_refreshed(self, interface: Interface) -> None:
        interface.read()
        written = parse(interface.get("skill_string"))
        if written is None:
            self._journal.note("violation torn at the daemon")
        elif str(written.pid) != interface.writer:
            self._journal.note("violation", written.pid, "wrote while the writer is", interface.writer)


def daemon(url: str, journal: Journal) -> None:
    """Serve, and check that only the writer writes."""
    board = LocalBlackBoard(InterfaceRegistry(), RealClock())
    reader = board.open_for_reading(TYPE, ID, owner="referee")
    board.register_listener(_WriteReferee(journal), reader, EventKind.DATA_REFRESHED)
    with ZmqBlackBoardServer(board, [url], heartbeat=HEARTBEAT_S):
        journal.note("serving")
        signal.pause()


class _MessageRecorder(Listener):
    """Records messages before their acknowledgement.

    A message comes twice, to the listener and from the queue, in two threads: it is recorded once.
    """

    def __init__(self, journal: Journal) -> None:
        self._journal = journal
        self._seen: set[str] = set()
        self._lock = threading.Lock()

    def message_received(self, interface: Interface, message: Message) -> bool:
        with self._lock:
            self._empty(interface)
            self._note(message)
        return True

    def empty(self, interface: Interface) -> None:
        """Empty the queue, and record the messages from before the registration."""
        with self._lock:
            self._empty(interface)

    def _empty(self, interface: Interface) -> None:
        while (message := interface.msgq_pop()) is not None:
            self._note(message)

    def _note(self, message: Message) -> None:
        text = str(message.get("skill_string"))
        if text not in self._seen:
            self._seen.add(text)
            self._journal.note("took", text)


def writer(url: str, journal: Journal) -> None:
    """Write for a random time whenever the process can open the writer, and receive messages."""
    board = connect(url, "writer")
    recorder = _MessageRecorder(journal)
    number = 0
    while True:
        try:
            listen = listening(recorder, EventKind.MESSAGE_RECEIVED)
            instance = board.open_for_writing(TYPE, ID, owner=str(os.getpid()), listen=listen)
        except BlackBoardError:
            journal.note("refused")
            time.sleep(0.02)
            continue
        until = time.monotonic() + random.uniform(0.5, 3.0)
        try:
            while time.monotonic() < until:
                number += 1
                instance.set("skill_string", payload(os.getpid(), number))
                instance.write()
                recorder.empty(instance)
                time.sleep(0.001)
            recorder.empty(instance)
            instance.close()
        except BlackBoardError:
            time.sleep(0.02)


def reader(url: str, journal: Journal) -> None:
    """Check the read blocks, and send a message after every 20 reads."""
    board = connect(url, "reader")
    instance = board.open_for_reading(TYPE, ID, owner="reader")
    newest: Counter[int] = Counter()  # the number of the newest write by process id
    message_number = reads = 0
    noted = time.monotonic()
    while True:
        for _ in range(20):
            reads += 1
            if instance.read():
                write = parse(instance.get("skill_string"))
                if write is None:
                    journal.note("violation torn")
                elif write.number < newest[write.pid]:
                    journal.note("violation", tuple(write), "after", newest[write.pid])
                else:
                    newest[write.pid] = write.number
            time.sleep(0.0005)
        message_number += 1
        message = instance.create_message("ExecSkillMessage")
        message.set("skill_string", f"{os.getpid()} {message_number}")
        try:
            instance.msgq_enqueue(message)
            if message.enqueued:
                journal.note("acknowledged", os.getpid(), message_number)
        except BlackBoardError:
            time.sleep(0.01)
        if time.monotonic() - noted > 0.2:
            journal.note("reads", reads)
            reads, noted = 0, time.monotonic()


ROLES: dict[str, Callable[[str, Journal], None]] = {"daemon": daemon, "writer": writer, "reader": reader}


# -- the nemesis


class Processes:
    """The processes, by names: a role and a number, such as ``writer2``."""

    def __init__(self, url: str, folder: Path, roles: list[str]) -> None:
        self._url, self._folder = url, folder
        self.by_name = {f"{role}{index}": self._start(role) for index, role in enumerate(roles)}

    def _start(self, role: str) -> subprocess.Popen[bytes]:
        log = (self._folder / "stderr.txt").open("ab")
        with log:
            command = [sys.executable, "-m", "benchmarks.nemesis_zmq", role, self._url, str(self._folder)]
            return subprocess.Popen(command, stderr=log)

    def kill(self, name: str) -> None:
        """Kill a process, and wait for its end."""
        process = self.by_name[name]
        process.kill()
        process.wait()

    def restart(self, name: str) -> None:
        """Kill a process, and start one with the same role."""
        self.kill(name)
        self.by_name[name] = self._start(name.rstrip("0123456789"))

    def freeze(self, name: str, seconds: float) -> None:
        """Stop a process for some seconds."""
        process = self.by_name[name]
        process.send_signal(signal.SIGSTOP)
        time.sleep(seconds)
        process.send_signal(signal.SIGCONT)

    def stop_all_but(self, role: str) -> None:
        """Stop the processes of all other roles."""
        for name, process in self.by_name.items():
            if not name.startswith(role):
                process.send_signal(signal.SIGSTOP)

    def kill_all_but(self, role: str) -> None:
        """Kill the processes of all other roles."""
        for name in self.by_name:
            if not name.startswith(role):
                self.kill(name)

    def end(self) -> None:
        """Kill all processes."""
        for name in self.by_name:
            self.kill(name)


def disturb(processes: Processes, seconds: float, rng: random.Random, max_pause_s: float) -> Counter[str]:
    """Kill and stop processes at random; return the number of operations by signal and role.

    :param max_pause_s: the longest pause between two operations.
    """
    operations: Counter[str] = Counter()
    until = time.monotonic() + seconds
    while time.monotonic() < until:
        time.sleep(rng.uniform(0.3, 1.0) * max_pause_s)
        # each client is twice as likely as the daemon
        name = rng.choice(
            [name for name in processes.by_name if not name.startswith("daemon")] * 2 + ["daemon0"]
        )
        if rng.random() < 0.5:
            processes.restart(name)
            operations[f"SIGKILL {name.rstrip('0123456789')}"] += 1
        else:
            processes.freeze(name, rng.choice([0.1, 0.2, 0.5, 1.0]))
            operations[f"SIGSTOP {name.rstrip('0123456789')}"] += 1
    return operations


def check_end(url: str, processes: Processes) -> list[str]:
    """Check that the daemon releases a stopped writer, and that a write then reaches a reader.

    Stops and kills all processes except the daemon.

    :returns: the faults; empty if the checks succeed.
    """
    faults = []
    with connect(url, "check") as board:

        def has_writer() -> bool:
            return any(info.has_writer for info in board.list(TYPE, ID))

        deadline = time.monotonic() + 10
        while not has_writer():
            if time.monotonic() > deadline:
                return ["nobody could become the writer"]
            time.sleep(0.001)
        processes.stop_all_but("daemon")
        stopped = time.monotonic()
        while has_writer():
            if time.monotonic() - stopped > 20 * HEARTBEAT_S:  # 2.5 heartbeats if the machine is not busy
                return ["a stopped writer was not released"]
            time.sleep(0.001)
        released = (time.monotonic() - stopped) / HEARTBEAT_S
        print(f"the last writer was released {released:.1f} heartbeats after its stop")
        processes.kill_all_but("daemon")
        with board.open_for_reading(TYPE, ID) as instance, connect(url, "last") as other_board:
            last_writer = other_board.open_for_writing(TYPE, ID, owner=str(os.getpid()))
            last_writer.set("skill_string", payload(os.getpid(), 1))
            last_writer.write()
            deadline = time.monotonic() + 2
            while not (instance.read() and parse(instance.get("skill_string")) == (os.getpid(), 1)):
                if time.monotonic() > deadline:
                    faults.append("a write does not reach a reader in two seconds")
                    break
                time.sleep(0.001)
    return faults


class History:
    """The history in the journals of all processes: records, messages and faults."""

    def __init__(self) -> None:
        self.faults: list[str] = []
        self.counts: Counter[str] = Counter()
        """The numbers of records by their first word; for ``reads`` the number of reads."""
        self.taken: set[tuple[str, str]] = set()
        self.acknowledged: set[tuple[str, str]] = set()
        """The acknowledged messages as sender and number, like the received messages in ``taken``."""

    def add(self, journal: Path) -> None:
        """Add the records of a journal, and its faults."""
        last_numbers: dict[str, int] = {}  # of received messages by sender
        for line in journal.read_text().splitlines():
            word, *values = line.split()
            self.counts[word] += int(values[0]) if word == "reads" else 1
            if word == "violation":
                self.faults.append(f"{journal.name}: {line}")
            elif word == "acknowledged":
                self.acknowledged.add((values[0], values[1]))
            elif word == "took":
                self._add_taken(journal.name, last_numbers, values[0], values[1])

    def _add_taken(self, name: str, last_numbers: dict[str, int], sender: str, number: str) -> None:
        if (sender, number) in self.taken:
            self.faults.append(f"{name}: took {sender} {number} again")
        elif int(number) <= last_numbers.get(sender, 0):
            self.faults.append(f"{name}: took {sender} {number} after {last_numbers[sender]}")
        self.taken.add((sender, number))
        last_numbers[sender] = int(number)

    def check_taken(self) -> None:
        """Add a fault for each acknowledged message that no writer has received."""
        for sender, number in sorted(self.acknowledged - self.taken):
            self.faults.append(f"acknowledged message {sender} {number} was lost")


def check_history(folder: Path) -> tuple[list[str], Counter[str]]:
    """Check the journals; return the faults, and the numbers of records by their first word.

    A writer listens before it is open, and notes a message before the acknowledgement. So no acknowledged
    message may be missing.
    """
    history = History()
    for journal in sorted(folder.glob("*.log")):
        history.add(journal)
    history.check_taken()
    return history.faults, history.counts


def run(
    seconds: float, *, writers: int = 3, readers: int = 2, seed: int = 1, max_pause_s: float = 1.0
) -> list[str]:
    """Run the processes with random kills and stops; return the faults, empty if every claim holds."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        url = f"ipc://{folder}/board"
        processes = Processes(url, folder, ["daemon", *["writer"] * writers, *["reader"] * readers])
        try:
            with connect(url, "start"):
                pass
            operations = disturb(processes, seconds, random.Random(seed), max_pause_s)
            time.sleep(1.0)  # the last restarted process begins its work
            faults = check_end(url, processes)
        finally:
            processes.end()
        history_faults, counts = check_history(folder)
        print(", ".join(f"{event} {count}" for event, count in sorted((operations + counts).items())))
        errors = (folder / "stderr.txt").read_text()
        if errors:
            faults.append(f"somebody failed:\n{errors[-3000:]}")
        if not (counts["acknowledged"] and counts["reads"]):
            faults.append("nothing was acknowledged or read: this proves nothing")
        return faults + history_faults


def main() -> None:
    """Run for the seconds of the command line, by default 60, or run a role as a child process.

    The exit status is 1 if a claim does not hold.
    """
    if len(sys.argv) > 2:
        role, url, folder = sys.argv[1:4]
        ROLES[role](url, Journal(Path(folder), role))
        return
    faults = run(float(sys.argv[1]) if len(sys.argv) > 1 else 60.0)
    for fault in faults:
        print("FAULT", fault)
    print("every claim holds" if not faults else f"{len(faults)} faults")
    sys.exit(bool(faults))


if __name__ == "__main__":
    main()
