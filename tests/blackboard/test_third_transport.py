"""A transport of a plug-in: its package, its row, and its contract entry."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest

from cxbridge.blackboard import Listener
from cxbridge.blackboard.urls import BadUrlError, open_blackboard
from cxbridge.clock import VirtualClock
from tests.blackboard.samples import SampleInterface, SampleRegistry
from tests.forked import nursery
from tests.plugins import forget, install
from tests.support import share

PACKAGE = '''
"""A transport to boards of this process by name, with separate clients."""

from cxbridge.blackboard import BlackBoard, LocalBlackBoard
from cxbridge.blackboard.errors import BlackBoardGoneError
from cxbridge.blackboard.kit.transport import Transport

SERVED = {}


class ShelfTransport(Transport):
    def open(self, url, registry, clock, bus, **options):
        name = url.partition("://")[2]
        if name not in SERVED:
            SERVED[name] = LocalBlackBoard(registry, clock, bus)
        return ShelfBlackBoard(SERVED[name])


class ShelfBlackBoard(BlackBoard):
    def __init__(self, served):
        super().__init__(served.registry, served.clock, served.bus)
        self._served = served
        self._opened = []
        self._gone = False

    def _open(self, request):
        if self._gone:
            raise BlackBoardGoneError
        instance = self._served._open(request)
        self._opened.append(instance)
        return instance

    def close(self, instance):
        self._served.close(instance)

    def shutdown(self):
        self._gone = True
        for instance in self._opened:
            instance.close()

    def list(self, type_glob="*", id_glob="*"):
        return self._served.list(type_glob, id_glob)

    def register_observer(self, observer, type_glob="*", id_glob="*"):
        self._served.register_observer(observer, type_glob, id_glob)

    def unregister_observer(self, observer):
        self._served.unregister_observer(observer)

    def _listener_table(self, instance):
        return self._served._listener_table(instance)
'''

CONTRACT = """
from contextlib import contextmanager

from cxbridge.blackboard.urls import open_blackboard
from cxbridge.clock import VirtualClock
from cxbridge.events import EventBus
from tests.blackboard.contract import BoardPair
from tests.blackboard.contract.suite import ContractEntry, contract_tests
from tests.blackboard.samples import SampleRegistry

@contextmanager
def shelf_pair(folder):
    clock = VirtualClock()
    bus = EventBus(clock)
    near, far = (open_blackboard(f"shelf://{folder}", SampleRegistry(), clock, bus) for _ in "ab")
    with near, far:
        yield BoardPair(near=near, far=far, clock=clock, bus=bus)


globals().update(contract_tests(ContractEntry("Shelf", shelf_pair)))
"""


PLUGIN = """
from cxbridge.plugins import Row

API = 1
TRANSPORTS = (Row("shelf", "shelf_transport.transport:ShelfTransport"),)
"""


@pytest.fixture
def package(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """A folder with the transport as a plug-in."""
    install(tmp_path, monkeypatch, "shelf_transport", {"transport.py": PACKAGE, "plugin.py": PLUGIN})
    yield tmp_path
    forget("shelf_transport")


def test_plugin_adds_transport(package):
    near, far = (open_blackboard("shelf://one", SampleRegistry(), VirtualClock()) for _ in "ab")
    seen = []

    class Sees(Listener):
        def data_changed(self, interface):
            interface.read()
            seen.append(interface.count)

    with near, far:
        near.register_listener(Sees(), near.open_for_reading(SampleInterface, "a"))
        writer = far.open_for_writing(SampleInterface, "a")
        writer.count = 7
        writer.write()
    assert seen == [7]
    with pytest.raises(BadUrlError) as caught:
        open_blackboard("shelves://one", SampleRegistry(), VirtualClock())
    assert "shelf://" in str(caught.value.hint)


def test_contract_entry_tests_transport(package):
    test = package / "test_shelf.py"
    test.write_text(CONTRACT)
    plain = ("-q", "-p", "no:cacheprovider", "-p", "no:xdist", f"--rootdir={package}")
    chosen = " or ".join(f"TestShelf{part}" for part in share(("Opening", "Data", "Messages", "Events"), 2))
    options = [*plain, f"--override-ini=pythonpath={package}", "-k", chosen, str(test)]
    done = nursery().run(options, program="pytest")
    out = done.stdout.decode()
    assert done.returncode == 0, out[-3000:]
    assert int(out.rpartition(" passed")[0].split()[-1]) > 30
    assert "failed" not in out
