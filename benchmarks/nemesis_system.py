"""Daemon, gateway, recorder, executor, Skiller and callers are killed and stopped at random; all is checked.

::

    python -m benchmarks.nemesis_system [SECONDS]

A robot with a Skiller on Fawkes' port, a gateway from there to a daemon, a recorder and an executor on the
daemon, callers that have the Skiller execute skills through both, each skill string another, and a sender of
numbered messages. Gateway, recorder and executor are the programs of ``cxbridge``. Every so often one of them
gets SIGKILL and is started again, or SIGSTOP for a while. The claims:

- *no foreign status*: a skill that a caller takes for final was executed by the robot, and not before the
  caller asked; so was an action that the skill board takes for succeeded by the executor;
- *acknowledged is delivered*: the robot took each message whose sender saw it acknowledged, once, in order. A
  message that the gateway or the robot had is lost with it (Fawkes' protocol has no acknowledgements): one is
  excused when either was killed between the last message before it that the robot took and the next;
- *recordings last*: each file of the recorder can be read after ``trace repair``;
- *it goes on*: when all that is over a skill and an action are executed, without anything being started anew.
"""

from __future__ import annotations

import random
import signal
import subprocess
import sys
import tempfile
import time
from bisect import bisect
from collections import Counter
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

from benchmarks.nemesis_zmq import Journal
from cxbridge.blackboard import EventKind, Listener, LocalBlackBoard, listening
from cxbridge.blackboard.fawkesnet.server import FawkesServer
from cxbridge.blackboard.urls import open_blackboard
from cxbridge.blackboard.zmq import ZmqBlackBoardServer
from cxbridge.clock import RealClock
from cxbridge.errors import CxbridgeError
from cxbridge.events import EventBus, InterfaceWrite
from cxbridge.interfaces import InterfaceRegistry
from cxbridge.interfaces.instance import Interface, Message
from cxbridge.skiller.board import protocol
from cxbridge.skiller.board.board import SkillBoard
from cxbridge.skiller.board.executor import SkillExecutor, Steps
from cxbridge.skiller.client.calls import CallOutcome, SkillerCall
from cxbridge.skiller.simulation.estimators import StaticEstimator
from cxbridge.skiller.simulation.simulator import SkillerSimulator

AGENT = "robot1"
CALL_S = 5.0
THIEF_S = 0.5
"""Seconds at most that a caller waits after it lost control: two that steal at once never end a skill."""

PARTS = ("robot", "daemon", "gateway", "recorder", "executor", "caller", "caller", "sender")
ON_THE_WAY = ("robot", "gateway")
"""Who has a message after its sender saw it acknowledged."""

NUMBERED = "SpeechSynthInterface"
"""What the sender's messages are for; their text is the time."""


class Worker(SkillExecutor):
    """Notes what it executes; run by ``cxbridge skill executor``."""

    skills = ("work",)
    known_settings = ("folder",)

    def execute(self, call: protocol.SkillCall) -> Steps:
        yield 0.5
        Journal(Path(str(self.settings["folder"])), "worker").note("worked", call.get("n"))


class Takes(Listener):
    """Notes numbered messages as they come."""

    def __init__(self, journal: Journal) -> None:
        self._journal = journal

    def message_received(self, interface: Interface, message: Message) -> bool:
        del interface
        self._journal.note("took", message.get("text"))
        return False


def robot(folder: Path, journal: Journal) -> None:
    """Execute skills, note each status that the Skiller shows, and numbered messages."""
    clock = RealClock()
    bus = EventBus(clock)
    board = LocalBlackBoard(InterfaceRegistry(), clock, bus)

    def note(event: Any) -> None:
        values = event.values
        journal.note("shows", values["msgid"], values["status"].name, values["skill_string"])

    bus.subscribe(note, InterfaceWrite)
    skiller = SkillerSimulator(board, clock, bus, [StaticEstimator(seconds=0.02)])
    listen = listening(Takes(journal), EventKind.MESSAGE_RECEIVED)
    board.open_for_writing(NUMBERED, "nemesis", listen=listen)
    port = int((folder / "port").read_text())
    while True:
        try:
            server = FawkesServer(board, port=port)
            break
        except CxbridgeError:
            time.sleep(0.05)
    with server:
        while True:
            skiller.loop()
            time.sleep(0.005)


def daemon(folder: Path, journal: Journal) -> None:
    """Serve a blackboard, and have the executor work."""
    clock = RealClock()
    bus = EventBus(clock)
    board = LocalBlackBoard(InterfaceRegistry(), clock, bus)
    with ZmqBlackBoardServer(board, [url_of(folder)]):
        skills = SkillBoard(board, clock, bus)
        while True:
            text = f"{time.time_ns()}"
            journal.note("asked", text)
            master = skills.request(protocol.SkillCall("work", AGENT, {"n": text}))
            while not master.is_over:
                skills.exchange()
                time.sleep(0.005)
            if master.state.name == "SUCCEEDED":
                journal.note("succeeded", text)


def caller(folder: Path, journal: Journal) -> None:
    """Have skills executed, one after the other."""
    clock = RealClock()
    number = 0
    while True:
        try:
            with open_blackboard(url_of(folder), InterfaceRegistry(), clock, EventBus(clock)) as board:
                while True:
                    number += 1
                    text = f'say{{text="{time.time_ns()}"}}'
                    with SkillerCall(board, steal=True) as call:
                        journal.note("calls", text)
                        result = call.execute(text, CALL_S)
                    journal.note("got", result.outcome.name, result.error, text)
                    if result.outcome is not CallOutcome.FINAL:
                        time.sleep(random.uniform(0, THIEF_S))
        except CxbridgeError:
            time.sleep(0.1)


def sender(folder: Path, journal: Journal) -> None:
    """Send numbered messages to the robot, one after the other."""
    clock = RealClock()
    while True:
        try:
            with open_blackboard(url_of(folder), InterfaceRegistry(), clock, EventBus(clock)) as board:
                reader = board.open_for_reading(NUMBERED, "nemesis", owner="sender")
                while True:
                    time.sleep(0.01)
                    message = reader.create_message("SayMessage")
                    message.set("text", str(number := time.time_ns()))
                    reader.msgq_enqueue(message)  # returns when the gateway has taken it
                    journal.note("acknowledged", number)
        except CxbridgeError:
            time.sleep(0.05)


ROLES: dict[str, Callable[[Path, Journal], None]] = {
    "robot": robot,
    "daemon": daemon,
    "caller": caller,
    "sender": sender,
}


def url_of(folder: Path) -> str:
    return f"ipc://{folder}/board"


class Troupe:
    """The processes, by the part that they play."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self.count = 0
        self._journal = Journal(folder, "troupe")
        self.processes = {f"{part}{index}": self.start(part) for index, part in enumerate(PARTS)}

    def start(self, part: str) -> subprocess.Popen[bytes]:
        self.count += 1
        with (self._folder / f"{part}.stderr").open("ab") as log:
            return subprocess.Popen(self._command(part), stderr=log, stdout=subprocess.DEVNULL)

    def _command(self, part: str) -> list[str]:
        folder, url = self._folder, url_of(self._folder)
        cxbridge = [sys.executable, "-m", "cxbridge"]
        match part:
            case "gateway":
                there = f"fawkes://127.0.0.1:{(folder / 'port').read_text()}"
                return [*cxbridge, "gateway", there, url, "-i", "SkillerInterface", "-i", NUMBERED, "-q"]
            case "recorder":
                file = folder / f"record-{self.count}.mcap"
                return [*cxbridge, "trace", "record", "-i", "Skill*", "-o", str(file), "--connect", url, "-q"]
            case "executor":
                target = "benchmarks.nemesis_system:Worker"
                settings = ["--set", f"folder={folder}", "--connect", url, "-q"]
                return [*cxbridge, "skill", "executor", target, "--agent", AGENT, *settings]
        return [sys.executable, "-m", "benchmarks.nemesis_system", part, str(folder)]

    def alive(self) -> None:
        """Start again who has ended by itself: the programs do so when their daemon is not there at start."""
        for name, process in self.processes.items():
            if process.poll() is not None:
                self._note_end(name)
                self.processes[name] = self.start(name.rstrip("0123456789"))

    def _note_end(self, name: str) -> None:
        if name.rstrip("0123456789") in ON_THE_WAY:
            self._journal.note("ended", time.time_ns())

    def kill(self, name: str) -> None:
        self._note_end(name)
        self.processes[name].kill()
        self.processes[name].wait()

    def end(self) -> None:
        for name in self.processes:
            self.kill(name)


def torment(troupe: Troupe, seconds: float, rng: random.Random) -> Counter[str]:
    """Kill and stop at random; return what was done how often."""
    done: Counter[str] = Counter()
    until = time.monotonic() + seconds
    while time.monotonic() < until:
        time.sleep(rng.uniform(0.5, 2.5))
        troupe.alive()
        name = rng.choice(list(troupe.processes))
        part = name.rstrip("0123456789")
        if rng.random() < 0.5:
            troupe.kill(name)
            troupe.processes[name] = troupe.start(part)
            done[f"SIGKILL {part}"] += 1
        else:
            troupe.processes[name].send_signal(signal.SIGSTOP)
            time.sleep(rng.choice([0.1, 0.3, 1.0]))
            troupe.processes[name].send_signal(signal.SIGCONT)
            done[f"SIGSTOP {part}"] += 1
    return done


def wait_until_it_goes_on(folder: Path, troupe: Troupe) -> list[str]:
    """Leave all alone until a skill and an action were executed that were asked for from now on."""
    since = time.time_ns()
    end = time.monotonic() + 60
    while time.monotonic() < end:
        troupe.alive()
        history = History(folder)
        if any(at > since for at in history.final) and any(at > since for at in history.succeeded):
            return []
        time.sleep(0.5)
    return ["no skill, or no action, was executed within a minute after the last trouble"]


class History:
    """What the journals of all processes tell; skills and actions go by when they were asked for."""

    def __init__(self, folder: Path) -> None:
        self.final: set[int] = set()
        self.succeeded: set[int] = set()
        self.executed: set[int] = set()
        self.worked: set[int] = set()
        self.acknowledged: set[int] = set()
        self.taken: list[int] = []
        self.ends: list[int] = []
        """When a robot or a gateway ended."""
        self.excused = 0
        self.ordered = True
        self.counts: Counter[str] = Counter()
        for journal in sorted(folder.glob("*.log")):
            came = len(self.taken)
            for line in journal.read_text().splitlines():
                self._add(*line.split(maxsplit=1))
            self.ordered &= self.taken[came:] == sorted(self.taken[came:])

    def _add(self, word: str, rest: str) -> None:
        digits = "".join(c for c in rest.rpartition("text=")[2] if c.isdigit()) if "text=" in rest else rest
        match word:
            case "shows" if " S_FINAL " in rest and digits.isdigit():
                self.executed.add(int(digits))
            case "got":
                self.counts[f"calls {rest.split(maxsplit=1)[0]}"] += 1
                if rest.startswith(CallOutcome.FINAL.name):
                    self.final.add(int(digits))
            case "succeeded":
                self.succeeded.add(int(rest))
            case "worked":
                self.worked.add(int(rest))
            case "acknowledged":
                self.acknowledged.add(int(rest))
            case "took":
                self.taken.append(int(rest))
            case "ended":
                self.ends.append(int(rest))

    def faults(self) -> list[str]:
        """Return which claims do not hold."""
        found = [f"skill {at} was called final and never was" for at in sorted(self.final - self.executed)]
        found += [f"action {at} succeeded and was never done" for at in sorted(self.succeeded - self.worked)]
        if not (self.final and self.succeeded and self.acknowledged):
            found.append("no skill or no action came to its end, or no message: this proves nothing")
        return found + list(self._lost())

    def _lost(self) -> Iterator[str]:
        """Yield which numbered messages were not taken once, in order, though nothing excuses it."""
        if not self.ordered:
            yield "a robot took messages out of order"
        yield from (f"message {n} was taken twice" for n, times in Counter(self.taken).items() if times > 1)
        taken, ends = sorted(self.taken), sorted(self.ends)
        self.excused = 0
        for number in sorted(self.acknowledged - set(taken)):
            at = bisect(taken, number)
            before = taken[at - 1] if at else 0
            if at == len(taken) or bisect(ends, before) < bisect(ends, taken[at]):
                self.excused += 1
            else:
                yield f"acknowledged message {number} was lost between {before} and {taken[at]}"


def check_recordings(folder: Path) -> tuple[list[str], int]:
    """Mend all recordings and read them; return what cannot be read, and how many there are."""
    faults = []
    files = [file for file in sorted(folder.glob("record-*.mcap")) if file.stat().st_size]
    for file in files:
        for command in (["repair", "--in-place"], ["info"]):
            done = subprocess.run(
                [sys.executable, "-m", "cxbridge", "trace", *command, str(file)],
                capture_output=True,
                text=True,
                check=False,
            )
            if done.returncode:
                faults.append(f"trace {command[0]} {file.name}: {done.stderr.strip()[-300:]}")
    return faults, len(files)


def run(seconds: float, *, seed: int = 1) -> list[str]:
    """Let the nemesis loose; return what it found."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        with FawkesServer(LocalBlackBoard(InterfaceRegistry(), RealClock()), port=0) as free:
            (folder / "port").write_text(str(free.port))
        troupe = Troupe(folder)
        try:
            faults = wait_until_it_goes_on(folder, troupe)
            done = torment(troupe, seconds, random.Random(seed))
            faults += wait_until_it_goes_on(folder, troupe)
        finally:
            troupe.end()
        history = History(folder)
        unreadable, recordings = check_recordings(folder)
        done += history.counts
        done.update({"recordings": recordings, "skills final": len(history.final)})
        faults += history.faults() + unreadable
        done.update({"actions succeeded": len(history.succeeded), "acknowledged": len(history.acknowledged)})
        done.update({"taken": len(history.taken), "excused": history.excused})
        print(", ".join(f"{what} {count}" for what, count in sorted(done.items())))
        for file in folder.glob("*.stderr"):
            if "Traceback" in (text := file.read_text()):
                faults.append(f"{file.stem} failed:\n{text[-3000:]}")
        return faults


def main() -> None:
    """Run for as many seconds as the command line says (60), or play a part."""
    if len(sys.argv) > 2:
        part, folder = sys.argv[1], Path(sys.argv[2])
        ROLES[part](folder, Journal(folder, part))
        return
    faults = run(float(sys.argv[1]) if len(sys.argv) > 1 else 60.0)
    for fault in faults:
        print("FAULT", fault)
    print("every claim holds" if not faults else f"{len(faults)} faults")
    sys.exit(bool(faults))


if __name__ == "__main__":
    main()
