"""Reads and writes, time stamps, and the flags refreshed and changed."""

from __future__ import annotations

import pytest

from cxbridge.blackboard import errors
from cxbridge.events import InterfaceWrite
from tests.blackboard.contract import Contract
from tests.blackboard.samples import SampleInterface


class DataContract(Contract):
    def test_read_loads_written_data(self, pair, reader, writer):
        pair.publish(writer, count=3, text="three")
        assert (reader.count, reader.text) == (0, "")
        assert reader.read() is True
        assert (reader.count, reader.text) == (3, "three")

    def test_reader_refuses_write(self, reader):
        with pytest.raises(errors.WriteDeniedError) as caught:
            reader.write()
        assert caught.value.message == (
            "This interface instance 'a' of type 'SampleInterface' is not opened for writing. Cannot write."
        )

    def test_later_reader_gets_present_data(self, pair, writer):
        pair.publish(writer, count=5)
        late = pair.near.open_for_reading(SampleInterface, "a")
        assert late.refreshed is False
        assert late.read() is True
        assert (late.count, late.changed) == (5, True)

    # -- flags

    def test_writer_flags(self, writer):
        assert (writer.refreshed, writer.changed) == (False, False)
        writer.count = 1
        assert (writer.refreshed, writer.changed) == (True, True)
        writer.write()
        assert (writer.refreshed, writer.changed) == (False, False)
        writer.count = 1
        assert (writer.refreshed, writer.changed) == (True, False)

    def test_reader_flags_compare_the_last_two_reads(self, pair, reader, writer):
        pair.publish(writer, count=1)
        assert (reader.refreshed, reader.changed) == (False, False)
        reader.read()
        assert (reader.refreshed, reader.changed) == (True, True)
        assert reader.read() is False
        assert (reader.refreshed, reader.changed) == (False, False)

    def test_setting_the_same_value_refreshes_and_does_not_change(self, pair, reader, writer):
        pair.publish(writer, count=1)
        reader.read()
        pair.publish(writer, count=1)
        assert reader.read() is True
        assert (reader.refreshed, reader.changed) == (True, False)

    def test_refreshed_needs_no_progress_of_the_clock(self, pair, reader, writer):
        stamps = []
        for count in (1, 2):
            pair.publish(writer, count=count)
            assert reader.read() is True
            stamps.append(reader.timestamp_us)
        assert stamps == [pair.clock.now_us()] * 2

    def test_write_without_set_fields_does_not_refresh_readers(self, pair, reader, writer):
        pair.publish(writer, count=1)
        reader.read()
        pair.clock.sleep_until(pair.clock.now_us() + 1000)
        before = reader.timestamp_us
        pair.publish(writer)
        assert reader.read() is False
        assert (reader.timestamp_us, reader.changed) == (before, False)

    def test_read_discards_values_set_by_reader(self, pair, reader, writer):
        pair.publish(writer, count=1)
        reader.read()
        reader.count = 7
        assert reader.read() is False
        assert (reader.count, reader.changed) == (1, False)

    def test_read_restores_shared_data_of_writer(self, writer):
        writer.count = 1
        writer.write()
        writer.count = 2
        writer.read()
        assert writer.count == 1

    def test_chunk_replaces_copy_without_flags(self, pair, reader, writer):
        other = pair.far.open_for_writing(SampleInterface, "b")
        other.count = 9
        other.write()
        writer.set_from_chunk(other.to_bytes())
        assert (writer.count, writer.refreshed, writer.changed) == (9, False, False)
        pair.publish(writer)
        assert reader.read() is True  # the chunk has a new time stamp
        assert (reader.count, reader.timestamp_us) == (9, other.timestamp_us)
        reader.set_from_chunk(bytes(SampleInterface.SCHEMA.datasize))
        assert reader.count == 0
        assert reader.read() is True
        assert (reader.count, reader.changed) == (9, True)

    # -- time stamps

    def test_write_has_time_of_board_clock(self, pair, reader, writer):
        for step in (0, 1, 1_000_000):
            pair.clock.sleep_until(pair.clock.now_us() + step)
            pair.publish(writer, count=1)
            reader.read()
            assert reader.timestamp_us == writer.timestamp_us == pair.clock.now_us()

    def test_time_stamps_by_hand(self, pair, reader, writer):
        writer.auto_timestamping = False
        writer.set_timestamp(1_500_000)
        assert (writer.refreshed, writer.changed) == (True, True)
        pair.publish(writer)
        reader.read()
        assert reader.timestamp_us == 1_500_000
        pair.publish(writer, timestamp_us=2_500_000)
        assert reader.read() is True
        assert reader.timestamp_us == 2_500_000
        writer.auto_timestamping = True
        pair.publish(writer, count=1)
        reader.read()
        assert reader.timestamp_us == pair.clock.now_us()

    def test_explicit_time_stamps_are_refused_in_automatic_mode_and_on_readers(self, reader, writer):
        assert writer.auto_timestamping is True
        with pytest.raises(errors.TimestampError, match="Auto timestamping enabled, cannot set explicit"):
            writer.set_timestamp(1)
        reader.auto_timestamping = False
        with pytest.raises(errors.TimestampError, match="Timestamp can only be set on writing instance"):
            reader.set_timestamp(1)

    # -- the life of the data

    def test_data_remain_after_writer_while_reader_is_open(self, pair, reader, writer):
        writer.count = 4
        writer.write()
        writer.close()
        pair.settle()
        assert reader.read() is True
        assert (reader.count, reader.has_writer) == (4, False)

    def test_data_are_lost_with_last_instance(self, pair, reader, writer):
        writer.count = 4
        writer.write()
        writer.close()
        reader.close()
        pair.settle()
        again = pair.near.open_for_reading(SampleInterface, "a")
        assert again.read() is False
        assert (again.count, again.timestamp_us) == (0, 0)

    def test_later_writer_starts_with_zeros(self, pair, reader, writer):
        writer.count, writer.text = 4, "keep"
        writer.write()
        writer.close()
        pair.settle()
        second = pair.far.open_for_writing(SampleInterface, "a")
        assert (second.count, second.text) == (0, "")
        pair.publish(second, count=5)
        reader.read()
        assert (reader.count, reader.text) == (5, "")

    def test_later_writer_keeps_data_that_it_reads(self, pair, reader, writer):
        writer.count, writer.text = 4, "keep"
        writer.write()
        writer.close()
        pair.settle()
        second = pair.far.open_for_writing(SampleInterface, "a")
        second.read()
        pair.publish(second, count=5)
        reader.read()
        assert (reader.count, reader.text) == (5, "keep")

    # -- recording

    def test_bus_gets_writes(self, pair, writer):
        events = pair.collect(InterfaceWrite)
        pair.publish(writer, count=2, text="two")
        assert [(event.time_us, event.uid) for event in events] == [
            (pair.clock.now_us(), "SampleInterface::a")
        ]
        assert events[0].values == {"count": 2, "text": "two", "numbers": (0,) * 64}
        assert list(events[0].values) == ["count", "text", "numbers"]
