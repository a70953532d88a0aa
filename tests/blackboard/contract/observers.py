"""Observers of created and destroyed interfaces."""

from __future__ import annotations

from cxbridge.blackboard import Observer
from tests.blackboard.contract import Contract
from tests.blackboard.contract.recorder import Recorder
from tests.blackboard.samples import SampleInterface

A = "SampleInterface::a"


class ObserversContract(Contract):
    def test_observer_gets_events_of_matching_interfaces(self, pair):
        everything, some = Recorder(), Recorder()
        pair.near.register_observer(everything)
        pair.near.register_observer(some, "Sample*", "x?")
        for interface_id in ("x1", "x22"):
            pair.far.open_for_reading(SampleInterface, interface_id).close()
        pair.settle()
        assert some.log == [("created", "SampleInterface::x1"), ("destroyed", "SampleInterface::x1")]
        assert len(everything.log) == 4

    def test_observer_with_several_patterns_is_called_once(self, pair):
        recorder = Recorder()
        pair.near.register_observer(recorder, "Sample*")
        pair.near.register_observer(recorder, "*Interface")
        pair.far.open_for_reading(SampleInterface, "a")
        pair.settle()
        assert recorder.log == [("created", A)]

    def test_interfaces_are_created_and_destroyed_once(self, pair, reader):
        recorder = Recorder()
        pair.near.register_observer(recorder)
        writer = pair.far.open_for_writing(SampleInterface, "a")
        reader.close()
        pair.settle()
        assert recorder.log == []
        writer.close()
        pair.settle()
        assert recorder.log == [("destroyed", A)]

    def test_unregistered_observer_is_not_called(self, pair):
        recorder = Recorder()
        pair.near.register_observer(recorder)
        pair.near.unregister_observer(recorder)
        pair.far.open_for_reading(SampleInterface, "a")
        pair.settle()
        assert recorder.log == []

    def test_observer_unregistered_by_another_observer_is_not_called(self, pair):
        victim = Recorder()

        class Unregisters(Observer):
            def interface_created(self, interface_type, interface_id):
                pair.near.unregister_observer(victim)

        pair.near.register_observer(Unregisters())
        pair.near.register_observer(victim)
        pair.far.open_for_reading(SampleInterface, "a")
        pair.settle()
        assert victim.log == []
