"""Programs on a blackboard against a model of it: single writer, order, exactly once, late joining, deaths.

Nothing waits for anything but where a rule says so: what one program did may still be on its way to others
when the next rule is applied. So the model keeps all the values that an interface had. What a reader sees
meanwhile must be among them and never older than before; when everything has settled all must agree.
"""

from __future__ import annotations

import itertools
import os
import sys
import threading
from collections import deque
from contextlib import suppress
from dataclasses import dataclass, field
from typing import Any

from hypothesis import HealthCheck, Phase, settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, initialize, precondition, rule

from cxbridge.blackboard import EventKind, Listener, errors
from tests.blackboard.samples import SampleInterface
from tests.blackboard.sites import Site

SetCount = SampleInterface.MESSAGES["SetCountMessage"]
PROGRAMS = st.integers(0, 2)
HERE = 2  # the number of the program that is in the server's process
IDS_OF_ALL = ("a", "b")
IDS = st.sampled_from(IDS_OF_ALL)
NARROW, WIDE = 4, 256  # windows: one in which updates are conflated at once, one in which never

EXAMPLES = int(os.environ.get("CXBRIDGE_EXAMPLES", "12"))
"""How many of each transport; set it to thousands now and then."""

SETTINGS = settings(
    max_examples=EXAMPLES,
    stateful_step_count=30,
    deadline=None,
    phases=[Phase.explicit, Phase.reuse, Phase.generate],  # threads do not fail twice the same way
    suppress_health_check=list(HealthCheck),
)


class Hears(Listener):
    """Notes each value that it reads."""

    def __init__(self) -> None:
        self.heard: list[int] = []

    def data_refreshed(self, interface: Any) -> None:
        interface.read()
        self.heard.append(interface.count)


@dataclass(eq=False)
class Reader:
    """An instance that is read now and then, or whose listener reads each write.

    :param newest: what it has read last, or what its listener was checked up to.
    :param by: a listener has heard of each write after this value; before it, it may have not listened yet.
    """

    program: int
    id: str
    instance: Any
    newest: int = 0
    by: int = 0
    ear: Hears | None = None
    sent: int = 0

    def take_heard(self) -> list[int]:
        """Return what the listener has heard since this was called last."""
        assert self.ear is not None
        taken = self.ear.heard[:]
        del self.ear.heard[: len(taken)]
        return taken


@dataclass
class Shared:
    """What the model knows of an interface.

    :param history: its values, the oldest first; numbers only grow.
    :param sure: what everybody has got already.
    :param writer: its program and instance.
    :param wrote: whether that writer has written.
    :param ghost: a program that had it open was killed, and the server may not know yet.
    :param doubtful: what the killed writer wrote last may not have arrived.
    :param kept: by program: the value that its readers still have, though the server came back without it.
    :param lingering: the same, until what was written since has surely arrived.
    :param peeked: programs whose listeners may see newer data than they are notified of.
    :param queue: of the writer: serial of the sender, number.
    """

    history: list[int] = field(default_factory=lambda: [0])
    sure: int = 0
    writer: tuple[int, Any] | None = None
    wrote: bool = False
    ghost: bool = False
    doubtful: bool = False
    kept: dict[int, int] = field(default_factory=dict)
    lingering: dict[int, int] = field(default_factory=dict)
    peeked: set[int] = field(default_factory=set)
    queue: deque[tuple[Any, int]] = field(default_factory=deque)

    def value(self, program: int) -> int:
        """Return what a program reads when everything has settled."""
        return self.kept.get(program, self.history[-1])


class Machine(RuleBasedStateMachine):
    """Three programs, of which one is the server's; a transport derives its own and makes the site."""

    def make_site(self, window: int) -> Site:
        raise NotImplementedError

    @initialize(window=st.sampled_from([NARROW, WIDE]))
    def begin(self, window: int) -> None:
        self.switching = sys.getswitchinterval()
        sys.setswitchinterval(1e-4)
        self.site = self.make_site(window)
        self.programs = [self.site.connect("left"), self.site.connect("right"), self.site.board]
        self.readers: list[Reader] = []
        self.shared = {interface_id: Shared() for interface_id in IDS_OF_ALL}
        self.numbers = itertools.count(1)
        self.names = itertools.count(1)
        self.restarts = 0
        self.under_way = False  # messages that nobody acknowledges
        self.broken = False

    def teardown(self) -> None:
        if hasattr(self, "shared"):  # else it could not be made
            try:
                if not self.broken:
                    self.everything_settles()
            finally:
                self.site.close()
                sys.setswitchinterval(self.switching)

    # -- helpers

    def readers_of(self, interface_id: str, program: int | None = None) -> list[Reader]:
        return [r for r in self.readers if r.id == interface_id and program in (None, r.program)]

    def forget_unused(self, interface_id: str) -> None:
        """Data and messages die with the last instance."""
        shared = self.shared[interface_id]
        users = {reader.program for reader in self.readers_of(interface_id)}
        if shared.writer is None:
            shared.queue.clear()
            if not users:
                self.shared[interface_id] = Shared(ghost=shared.ghost)
                return
            shared.wrote = False
        else:
            users.add(shared.writer[0])
        shared.kept = {program: value for program, value in shared.kept.items() if program in users}

    def prepare_to_open(self, interface_id: str) -> None:
        """See to it that the model knows whether the interface is there."""
        if not self.readers_of(interface_id) and self.shared[interface_id].writer is None:
            self.everything_settles()

    def check_seen(self, interface_id: str, program: int, value: int, at_least: int) -> None:
        """Check what is read while others may still be on their way."""
        shared = self.shared[interface_id]
        old = (shared.kept.get(program), shared.lingering.get(program))
        assert value in (*shared.history, *old), "a value that was never written"
        assert value >= at_least, "an older value"
        shared.peeked.add(program)

    def resolve(self, interface_id: str) -> None:
        """Find out which of a killed writer's last writes have arrived."""
        shared = self.shared[interface_id]
        if not shared.doubtful:
            return
        with self.site.board.open_for_reading(SampleInterface, interface_id) as probe:
            probe.read()
            value = probe.count
        assert value in shared.history
        assert value >= shared.sure, "what everybody had is gone"
        if value not in shared.kept.values():
            del shared.history[shared.history.index(value) + 1 :]
        shared.doubtful = False

    # -- rules

    @rule(program=PROGRAMS, interface_id=IDS)
    def open_reader(self, program: int, interface_id: str) -> None:
        self.prepare_to_open(interface_id)
        instance = self.programs[program].open_for_reading(SampleInterface, interface_id)
        reader = Reader(program, interface_id, instance)
        instance.read()
        self.check_seen(interface_id, program, instance.count, self.least(interface_id, program))
        reader.newest = instance.count
        self.readers.append(reader)

    def least(self, interface_id: str, program: int) -> int:
        """Return the oldest value that a reader may find."""
        shared = self.shared[interface_id]
        return shared.kept.get(program, shared.sure)

    @rule(program=PROGRAMS, interface_id=IDS)
    def open_listener(self, program: int, interface_id: str) -> None:
        self.prepare_to_open(interface_id)
        self.join(program, interface_id)

    def join(self, program: int, interface_id: str) -> None:
        board = self.programs[program]
        instance = board.open_for_reading(SampleInterface, interface_id)
        instance.read()
        first = instance.count
        ear = Hears()
        board.register_listener(ear, instance, EventKind.DATA_REFRESHED)
        self.check_seen(interface_id, program, first, self.least(interface_id, program))
        written = self.shared[interface_id].history[-1]
        self.readers.append(Reader(program, interface_id, instance, newest=first, by=written, ear=ear))

    @rule(program=PROGRAMS, interface_id=IDS)
    def open_writer(self, program: int, interface_id: str) -> None:
        self.prepare_to_open(interface_id)
        shared = self.shared[interface_id]
        try:
            instance = self.programs[program].open_for_writing(SampleInterface, interface_id)
        except errors.WriterActiveError:
            assert shared.writer is not None or shared.ghost
        else:
            assert shared.writer is None, "a second writer"
            self.resolve(interface_id)
            shared.writer, shared.wrote = (program, instance), False

    @rule(programs=st.permutations(range(3)), interface_id=IDS)
    def contend(self, programs: list[int], interface_id: str) -> None:
        """Two programs want to be the writer at the same time."""
        self.everything_settles()
        shared = self.shared[interface_id]
        won: list[tuple[int, Any]] = []
        barrier = threading.Barrier(2)

        def try_it(program: int) -> None:
            barrier.wait()
            with suppress(errors.WriterActiveError):
                won.append((program, self.programs[program].open_for_writing(SampleInterface, interface_id)))

        threads = [threading.Thread(target=try_it, args=(program,)) for program in programs[:2]]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        assert len(won) == (shared.writer is None)
        if won:
            shared.writer, shared.wrote = won[0], False

    def have_writer(self, program: int, interface_id: str) -> Any:
        if self.shared[interface_id].writer is None:
            if self.shared[interface_id].ghost:
                self.everything_settles()
            self.open_writer(program, interface_id)
        writer = self.shared[interface_id].writer
        assert writer is not None
        return writer[1]

    def write_once(self, interface_id: str, instance: Any) -> None:
        shared = self.shared[interface_id]
        number = next(self.numbers)
        shared.history.append(number)  # before: it may be read at once
        shared.wrote = True
        shared.lingering |= shared.kept
        shared.kept.clear()
        instance.count = number
        instance.write()

    @rule(program=PROGRAMS, interface_id=IDS, times=st.integers(1, 12))
    def write(self, program: int, interface_id: str, times: int) -> None:
        instance = self.have_writer(program, interface_id)
        for _ in range(times):
            self.write_once(interface_id, instance)

    @rule(programs=st.permutations(range(3)), interface_id=IDS, times=st.integers(1, 30))
    def join_while_somebody_writes(self, programs: list[int], interface_id: str, times: int) -> None:
        instance = self.have_writer(programs[0], interface_id)
        begun = threading.Event()

        def write() -> None:
            for _ in range(times):
                self.write_once(interface_id, instance)
                begun.set()

        thread = threading.Thread(target=write)
        thread.start()
        begun.wait()
        self.join(programs[1], interface_id)
        thread.join()

    @rule(program=st.integers(0, 1), interface_id=IDS, times=st.integers(1, 30))
    def write_to_somebody_who_does_not_read(self, program: int, interface_id: str, times: int) -> None:
        writer = self.shared[interface_id].writer
        if writer is not None and writer[0] == program:
            return  # it would wait for itself
        instance = self.have_writer(HERE, interface_id)
        with self.site.not_reading(self.programs[program]):
            for _ in range(times):
                self.write_once(interface_id, instance)

    @precondition(lambda self: self.readers)
    @rule(which=st.integers(0, 20))
    def read(self, which: int) -> None:
        quiet = [reader for reader in self.readers if reader.ear is None]
        if quiet:
            reader = quiet[which % len(quiet)]
            reader.instance.read()
            self.check_seen(reader.id, reader.program, reader.instance.count, reader.newest)
            reader.newest = reader.instance.count

    @precondition(lambda self: self.readers)
    @rule(which=st.integers(0, 20), times=st.integers(1, 6))
    def send(self, which: int, times: int) -> None:
        reader = self.readers[which % len(self.readers)]
        shared = self.shared[reader.id]
        if not self.site.acknowledges:
            self.everything_settles()  # it goes by what it knows of the writer
        for _ in range(times):
            number = next(self.numbers)
            try:
                reader.instance.msgq_enqueue(SetCount(number))
            except errors.NoWriterError:
                assert shared.writer is None, "there is a writer"
            else:
                assert shared.writer is not None, "acknowledged by nobody"
                shared.queue.append((reader.instance.serial, number))
                self.under_way = not self.site.acknowledges

    @rule(interface_id=IDS)
    def take(self, interface_id: str) -> None:
        shared = self.shared[interface_id]
        if shared.writer is None:
            return
        if self.under_way:
            self.everything_settles()
        taken = []
        while (message := shared.writer[1].msgq_pop()) is not None:
            taken.append((message.source_id, message.count))
        assert taken == list(shared.queue), "messages lost, twice or out of order"
        shared.queue.clear()

    @rule(interface_id=IDS)
    def close_writer(self, interface_id: str) -> None:
        shared = self.shared[interface_id]
        if shared.writer is not None:
            if self.under_way:
                self.everything_settles()
            shared.writer[1].close()
            shared.writer = None
            self.forget_unused(interface_id)
            if not self.site.acknowledges:
                self.everything_settles()  # nor that somebody else may write now

    @precondition(lambda self: self.readers)
    @rule(which=st.integers(0, 20))
    def close_reader(self, which: int) -> None:
        self.everything_settles()  # nobody tells what its listener would still have heard
        reader = self.readers.pop(which % len(self.readers))
        reader.instance.close()
        self.forget_unused(reader.id)

    @rule(program=PROGRAMS, quietly=st.booleans())
    def kill(self, program: int, quietly: bool) -> None:
        """End a program; another one takes its place."""
        if quietly or self.under_way:
            self.everything_settles()
        mine = [reader for reader in self.readers if reader.program == program]
        self.readers = [reader for reader in self.readers if reader not in mine]
        here = self.programs[program] is self.site.board
        if here:
            for reader in mine:
                reader.instance.close()
        else:
            self.site.kill(self.programs[program])
            self.programs[program] = self.site.connect(f"number {next(self.names)}")
        for interface_id, shared in self.shared.items():
            if shared.writer is not None and shared.writer[0] == program:
                if here:
                    shared.writer[1].close()
                else:
                    shared.ghost = True
                    shared.doubtful |= shared.history[-1] != shared.sure
                shared.writer = None
                shared.wrote = False
                shared.queue.clear()
            if here:
                self.forget_unused(interface_id)
            elif any(reader.id == interface_id for reader in mine):
                shared.ghost = True
            shared.kept.pop(program, None)

    @precondition(lambda self: hasattr(self, "site") and self.site.restarts and self.restarts < 1)
    @rule(quietly=st.booleans(), times=st.integers(0, 3))
    def restart(self, quietly: bool, times: int) -> None:
        """Stop the server, write meanwhile, and serve an empty blackboard."""
        self.restarts += 1
        if quietly or self.under_way or not all(self.survives(one) for one in self.shared.values()):
            self.everything_settles()
        self.broken = True  # until it is over
        self.site.stop()
        for interface_id, shared in self.shared.items():
            self.readers = [r for r in self.readers if r.id != interface_id or r.program != HERE]
            if shared.writer is not None and shared.writer[0] == HERE:
                shared.writer = None
                shared.queue.clear()
            for _ in range(times if self.site.keeps and shared.writer is not None else 0):
                self.write_once(interface_id, shared.writer[1])  # type: ignore[index] # it is not None
        self.site.start()
        self.programs[HERE] = self.site.board
        for interface_id in IDS_OF_ALL:
            self.forget_unused(interface_id)
            self.begin_again(interface_id)
        self.site.settle()
        for reader in self.readers:
            self.check_after_restart(reader)
        self.broken = False

    def begin_again(self, interface_id: str) -> None:
        """Note what a new server has: what its writer publishes again, or nothing."""
        shared = self.shared[interface_id]
        if shared.writer is not None and shared.wrote:
            shared.history = shared.history[-1:]
        else:
            users = {reader.program for reader in self.readers_of(interface_id)}
            users |= set() if shared.writer is None else {shared.writer[0]}
            shared.kept = {program: shared.value(program) for program in users if self.site.keeps}
            shared.history = [0]
        shared.sure = 0
        shared.ghost = shared.doubtful = False

    def survives(self, shared: Shared) -> bool:
        """Return whether what was written is not lost when the server stops now."""
        if shared.history[-1] == shared.sure:
            return not shared.ghost
        return shared.writer is not None and shared.writer[0] != HERE and not shared.ghost

    def check_after_restart(self, reader: Reader) -> None:
        """Of what was written meanwhile a reader hears the last, and nothing older after something newer."""
        value = self.shared[reader.id].value(reader.program)
        if reader.ear is not None:
            heard = reader.take_heard()
            if self.site.keeps:
                assert all(before <= after for before, after in itertools.pairwise([reader.newest, *heard]))
            assert not heard or heard[-1] == value
        elif self.site.keeps:
            assert reader.newest <= value
        reader.newest = reader.by = value

    # -- when nothing is on its way any more

    @rule()
    def everything_settles(self) -> None:
        self.broken = True  # until it is over
        if any(shared.ghost for shared in self.shared.values()):
            self.site.wait_reaped()
        for interface_id in IDS_OF_ALL:
            self.shared[interface_id].ghost = False
            self.forget_unused(interface_id)
            self.resolve(interface_id)
        self.site.settle()
        self.under_way = False
        listed = {info.id: info for info in self.site.board.list_all()}
        for interface_id, shared in self.shared.items():
            readers = self.readers_of(interface_id)
            for reader in readers:
                self.check_settled(reader, shared)
            info = listed.get(interface_id)
            assert (info is not None) == bool(readers or shared.writer), f"{interface_id}: {info} {shared}"
            if info is not None:
                users = (shared.writer is not None, len(readers))
                assert (info.has_writer, info.num_readers) == users, f"{interface_id}: {info} {shared}"
            shared.sure = shared.history[-1]
            shared.lingering.clear()
            shared.peeked.clear()
        self.broken = False

    def check_settled(self, reader: Reader, shared: Shared) -> None:
        value = shared.value(reader.program)
        if reader.ear is not None:
            self.check_heard(reader, reader.take_heard(), shared)
        reader.instance.read()
        assert reader.instance.count == value, "not the newest value"
        assert reader.instance.has_writer == (shared.writer is not None)
        reader.newest = reader.by = value

    def check_heard(self, reader: Reader, heard: list[int], shared: Shared) -> None:
        """Check that a listener heard of each write once, from some moment after its opening on."""
        written = [value for value in shared.history if value > reader.newest]
        surely = [value for value in written if value > reader.by]
        missed = 0 if self.site.window == WIDE else self.site.skipped(self.programs[reader.program])
        told = f"program {reader.program} heard {heard} of {written}, at the latest from {surely[:1]} on"
        assert len(surely) <= len(heard) + missed, f"a gap: {told}"
        assert len(heard) <= len(written), f"a repetition: {told}"
        assert heard or not surely, f"nothing: {told}"
        assert set(heard) <= set(written), f"never written: {told}"
        assert not heard or heard[-1] == written[-1], f"not the newest: {told}"
        if reader.program in shared.peeked or not self.site.exact:  # what is read there, listeners read, too
            due = written[: len(heard)] if missed else written[len(written) - len(heard) :]
            assert all(one >= other for one, other in zip(heard, due, strict=True)), f"older: {told}"
            assert heard == sorted(heard), f"out of order: {told}"
        else:
            assert heard == sorted(set(heard)), f"out of order: {told}"
            assert missed or heard == written[len(written) - len(heard) :], f"a gap: {told}"
