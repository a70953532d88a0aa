from tests.blackboard.contract.data import DataContract
from tests.blackboard.contract.events import EventsContract
from tests.blackboard.contract.messages import MessagesContract
from tests.blackboard.contract.observers import ObserversContract
from tests.blackboard.contract.opening import OpeningContract
from tests.blackboard.fawkesnet.pairs import ClientPair

class TestOpening(ClientPair, OpeningContract): pass
class TestData(ClientPair, DataContract): pass
class TestMessages(ClientPair, MessagesContract): pass
class TestEvents(ClientPair, EventsContract): pass
class TestObservers(ClientPair, ObserversContract): pass
