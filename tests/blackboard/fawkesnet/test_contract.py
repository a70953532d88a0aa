"""The contract of all blackboards, over Fawkes' protocol: both ends remote, or one."""

from __future__ import annotations

from tests.blackboard.contract.events import RegistrationContract
from tests.blackboard.contract.observers import ObserversContract
from tests.blackboard.fawkesnet.differences import (
    WireDataContract,
    WireEventsContract,
    WireMessagesContract,
    WireOpeningContract,
)
from tests.blackboard.fawkesnet.pairs import ClientPair, RemoteReaderPair, RemoteWriterPair


class TestOpening(ClientPair, WireOpeningContract):
    pass


class TestData(ClientPair, WireDataContract):
    pass


class TestMessages(ClientPair, WireMessagesContract):
    pass


class TestRegistration(ClientPair, RegistrationContract):
    pass


class TestEvents(ClientPair, WireEventsContract):
    pass


class TestObservers(ClientPair, ObserversContract):
    pass


class TestDataForRemoteReader(RemoteReaderPair, WireDataContract):
    pass


class TestDataFromRemoteWriter(RemoteWriterPair, WireDataContract):
    pass


class TestMessagesFromRemoteReader(RemoteReaderPair, WireMessagesContract):
    pass


class TestMessagesForRemoteWriter(RemoteWriterPair, WireMessagesContract):
    pass


class TestRegistrationForRemoteReader(RemoteReaderPair, RegistrationContract):
    pass


class TestEventsForRemoteReader(RemoteReaderPair, WireEventsContract):
    pass


class TestRegistrationFromRemoteWriter(RemoteWriterPair, RegistrationContract):
    pass


class TestEventsFromRemoteWriter(RemoteWriterPair, WireEventsContract):
    pass
