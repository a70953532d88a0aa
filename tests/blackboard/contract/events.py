"""Listeners: their events, the order of events, and their threads."""

from __future__ import annotations

import threading

import pytest

from cxbridge.blackboard import EventKind, Listener, Observer, errors, listening
from cxbridge.events import Level, LogLine
from tests.blackboard.contract import BoardPair, Contract
from tests.blackboard.contract.recorder import Recorder
from tests.blackboard.samples import SampleInterface

A = "SampleInterface::a"
DATA = (EventKind.DATA_REFRESHED, EventKind.DATA_CHANGED)
INSTANCES = (
    EventKind.READER_ADDED,
    EventKind.READER_REMOVED,
    EventKind.WRITER_ADDED,
    EventKind.WRITER_REMOVED,
)


class EventsContract(Contract):
    # -- data

    def test_each_write_notifies_refreshed_before_changed(self, pair, reader, writer):
        recorder = Recorder()
        pair.near.register_listener(recorder, reader)
        pair.publish(writer)
        assert recorder.take() == [("refreshed", A)]
        pair.publish(writer, count=1)
        assert recorder.take() == [("refreshed", A), ("changed", A)]
        pair.publish(writer, count=1)
        assert recorder.take() == [("refreshed", A)]

    def test_second_registration_has_no_effect(self, pair, reader, writer):
        recorder = Recorder()
        pair.near.register_listener(recorder, reader, *DATA)
        pair.near.register_listener(recorder, reader, *DATA)
        pair.publish(writer)
        assert recorder.log == [("refreshed", A)]

    def test_listeners_are_called_in_the_order_of_registration(self, pair, reader, writer):
        log = []

        class Named(Listener):
            def __init__(self, name: str) -> None:
                self.name = name

            def data_refreshed(self, interface):
                log.append(self.name)

        for name in ("first", "second", "third"):
            pair.near.register_listener(Named(name), reader)
        pair.publish(writer)
        assert log == ["first", "second", "third"]

    # -- instances

    def test_listener_gets_serial_of_opened_and_closed_instance(self, pair, reader):
        recorder = Recorder()
        pair.near.register_listener(recorder, reader, *INSTANCES)
        second = pair.far.open_for_reading(SampleInterface, "a")
        writer = pair.far.open_for_writing(SampleInterface, "a")
        pair.settle()
        assert recorder.take() == [("+reader", A, second.serial), ("+writer", A, writer.serial)]
        writer.close()
        second.close()
        pair.settle()
        assert recorder.take() == [("-writer", A, writer.serial), ("-reader", A, second.serial)]

    def test_listener_gets_end_but_not_begin_of_its_instance(self, pair, reader):
        recorder = Recorder()
        pair.near.register_listener(recorder, reader)
        reader.close()
        pair.settle()
        assert recorder.log == [("-reader", A, reader.serial)]

    def test_order_of_created_added_removed_destroyed(self, pair):
        log: list[tuple[object, ...]] = []
        recorder = Recorder(log)

        class AtBirth(Observer):
            def interface_created(self, interface_type, interface_id):
                log.append(("created", f"{interface_type}::{interface_id}"))

        pair.near.register_observer(recorder)
        instance = pair.near.open_for_reading(SampleInterface, "a")
        pair.near.register_listener(recorder, instance)
        writer = pair.far.open_for_writing(SampleInterface, "a")
        pair.settle()
        writer.close()
        instance.close()
        pair.settle()
        assert log == [
            ("created", A),
            ("+writer", A, writer.serial),
            ("-writer", A, writer.serial),
            ("-reader", A, instance.serial),
            ("destroyed", A),
        ]

    # -- messages

    def test_message_listener_is_called_before_queueing(self, pair, reader, writer):
        seen = []

        class Peeks(Listener):
            def message_received(self, interface, message):
                seen.append((interface.msgq_size(), message.enqueued, message.id))
                return True

        pair.far.register_listener(Peeks(), writer)
        reader.msgq_enqueue(SampleInterface.ResetMessage())
        pair.settle()
        assert seen == [(0, False, 1)]
        assert writer.msgq_size() == 1

    def test_first_listener_that_returns_false_stops_message(self, pair, reader, writer):
        calls = []

        class Says(Listener):
            def __init__(self, name: str, answer: bool) -> None:
                self.name, self.answer = name, answer

            def message_received(self, interface, message):
                calls.append(self.name)
                return self.answer

        for name, answer in (("yes", True), ("no", False), ("never asked", True)):
            pair.far.register_listener(Says(name, answer), writer)
        message = SampleInterface.ResetMessage()
        assert reader.msgq_enqueue(message) == 1
        pair.settle()
        assert calls == ["yes", "no"]
        assert writer.msgq_empty()
        assert not message.enqueued

    def test_messages_can_only_be_watched_on_writers(self, pair, reader):
        with pytest.raises(
            errors.BlackBoardError, match="can only be watched on writing interface instances"
        ):
            pair.near.register_listener(Recorder(), reader, EventKind.MESSAGE_RECEIVED)

    def test_the_writer_may_be_closed_while_its_listeners_are_asked(self, pair, reader, writer):
        class Closes(Listener):
            def message_received(self, interface, message):
                interface.close()
                return True

        pair.far.register_listener(Closes(), writer)
        with pytest.raises(errors.NoWriterError):
            reader.msgq_enqueue(SampleInterface.ResetMessage())

    # -- registering while events are delivered

    def test_who_is_unregistered_in_a_callback_is_not_called_any_more(self, pair, reader, writer):
        victim = Recorder()

        class Unregisters(Listener):
            def data_refreshed(self, interface):
                pair.near.unregister_listener(victim, reader)

        pair.near.register_listener(Unregisters(), reader)
        pair.near.register_listener(victim, reader, *DATA)
        pair.publish(writer, count=1)
        assert victim.log == []

    def test_a_listener_may_open_and_close(self, pair, reader, writer):
        opened = []

        class Opens(Listener):
            def data_refreshed(self, interface):
                with pair.near.open_for_reading(SampleInterface, "a") as another:
                    another.read()
                    opened.append(another.count)

        pair.near.register_listener(Opens(), reader)
        pair.publish(writer, count=6)
        assert opened == [6]

    def test_unregistered_listeners_hear_nothing(self, pair, reader, writer):
        recorder = Recorder()
        pair.near.register_listener(recorder, reader)
        pair.near.unregister_listener(recorder, reader)
        pair.near.unregister_listener(recorder, reader)
        writer.write()
        writer.close()
        pair.settle()
        assert recorder.log == []
        reader.close()
        pair.near.unregister_listener(recorder, reader)

    def test_listeners_of_a_closed_instance_hear_nothing(self, pair, reader, writer):
        recorder = Recorder()
        pair.near.register_listener(recorder, reader, *DATA)
        reader.close()
        pair.publish(writer)
        assert recorder.log == []

    def test_a_closed_instance_cannot_be_listened_on(self, pair, reader):
        reader.close()
        with pytest.raises(errors.BlackBoardError):
            pair.near.register_listener(Recorder(), reader, *DATA)

    def test_failed_listener_is_logged_and_next_listener_called(self, pair, reader, writer):
        lines = pair.collect(LogLine)
        after = Recorder()

        class Fails(Listener):
            def data_refreshed(self, interface):
                raise ValueError("broken")

        pair.near.register_listener(Fails(), reader)
        pair.near.register_listener(after, reader, *DATA)
        pair.publish(writer)
        assert after.log == [("refreshed", A)]
        assert [(line.level, line.text) for line in lines] == [
            (Level.ERROR, "data_refreshed of SampleInterface::a failed: ValueError: broken")
        ]

    def test_failed_message_listener_does_not_stop_message(self, pair, reader, writer):
        lines = pair.collect(LogLine)

        class Fails(Listener):
            def message_received(self, interface, message):
                raise ValueError("broken")

        pair.far.register_listener(Fails(), writer)
        reader.msgq_enqueue(SampleInterface.ResetMessage())
        pair.settle()
        assert writer.msgq_size() == 1
        assert len(lines) == 1


class CallersThreadContract(Contract):
    """For local blackboards, which call listeners in the thread of the caller."""

    def test_events_are_delivered_in_the_thread_of_the_caller(self, pair: BoardPair):
        threads = []

        class Notes(Listener):
            def data_refreshed(self, interface):
                threads.append(threading.current_thread().name)

        reader = pair.near.open_for_reading(SampleInterface, "a")
        writer = pair.far.open_for_writing(SampleInterface, "a")
        pair.near.register_listener(Notes(), reader)
        thread = threading.Thread(target=writer.write, name="WritingThread")
        thread.start()
        thread.join()
        assert threads == ["WritingThread"]


class RegistrationContract(Contract):
    """A listener that is registered during the opening of an interface gets all its events."""

    def test_listener_gets_message_sent_at_opening_of_writer(self, pair):
        """Listeners that were registered after the opening missed earlier messages."""
        heard: list[str] = []

        class Hasty(Listener):
            def writer_added(self, interface, serial):
                interface.msgq_enqueue(SampleInterface.MESSAGES["ResetMessage"]())

        class Ears(Listener):
            def message_received(self, interface, message):
                heard.append(message.type)
                return False

        reader = pair.near.open_for_reading(SampleInterface, "hasty")
        pair.near.register_listener(Hasty(), reader)
        writer = pair.far.open_for_writing(SampleInterface, "hasty", listen=listening(Ears()))
        pair.settle()
        pair.settle()
        assert heard == ["ResetMessage"]
        assert writer.msgq_empty()

    def test_listener_gets_reader_closed_at_opening_of_writer(self, pair):
        heard: list[object] = []

        class Leaving(Listener):
            def writer_added(self, interface, serial):
                interface.close()

        class Ears(Listener):
            def reader_removed(self, interface, serial):
                heard.append(serial)

        reader = pair.near.open_for_reading(SampleInterface, "hasty")
        serial = reader.serial
        pair.near.register_listener(Leaving(), reader)
        pair.far.open_for_writing(SampleInterface, "hasty", listen=listening(Ears()))
        pair.settle()
        pair.settle()
        assert heard == [serial]
