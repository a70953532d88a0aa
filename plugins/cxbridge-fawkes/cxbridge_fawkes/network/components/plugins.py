"""The plugin manager component: components of this process as Fawkes plugins."""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterable, Sequence
from functools import partial
from itertools import chain
from typing import ClassVar, Final, Protocol

from cxbridge.blackboard.kit.complaints import Complaints
from cxbridge.blackboard.kit.dispatcher import Dispatcher
from cxbridge.errors import BlackBoardError, CxbridgeError
from cxbridge_fawkes.network.messages.frames import ComponentId, FawkesFrame
from cxbridge_fawkes.network.messages.plugins import PluginKind, PluginMessage
from cxbridge_fawkes.network.session import FawkesSession, NetworkHandler

_STOP_TIMEOUT_S: Final = 5.0  # a plugin that does not finish loading must not block the end of the process


class PluginHost(Protocol):
    """The owner of the plugins, called in threads of the server."""

    def list_available(self) -> Iterable[tuple[str, str]]:
        """Return name and description, a line of text, of each loadable plugin."""

    def list_loaded(self) -> Sequence[str]:
        """Return the loaded plugins in order of loading."""

    def load(self, name: str) -> None:
        """Load plugins, except those that are loaded already.

        :param name: a plugin, or several separated by commas.
        :raises CxbridgeError: if loading fails.
        """

    def unload(self, name: str) -> None:
        """Unload a plugin if it is loaded.

        :raises CxbridgeError: if unloading fails.
        """


class PluginManager(NetworkHandler):
    """Lists, loads and unloads plugins, and notifies the watching clients.

    A separate thread loads and unloads plugins one by one, because loading may take long.
    """

    COMPONENT: ClassVar[ComponentId] = ComponentId.PLUGIN_MANAGER

    def __init__(self, host: PluginHost, log: Callable[[str], None]) -> None:
        self._host: Final = host
        self._complaints = Complaints(log)
        self._watchers: frozenset[FawkesSession] = frozenset()
        self._worker: Dispatcher | None = None
        self._lock = threading.Lock()

    def handle(self, session: FawkesSession, frame: FawkesFrame) -> None:
        message = PluginMessage.unpack(frame.kind, frame.payload)
        match message.kind:
            case PluginKind.LIST_AVAIL:
                texts = tuple(chain.from_iterable(self._host.list_available()))
                _send(session, PluginMessage(PluginKind.AVAIL_LIST, items=texts))
            case PluginKind.LIST_LOADED:
                _send(session, PluginMessage(PluginKind.LOADED_LIST, items=tuple(self._host.list_loaded())))
            case PluginKind.LOAD | PluginKind.UNLOAD:
                self._run_in_worker(partial(self._load_or_unload, session, message))
            case PluginKind.SUBSCRIBE_WATCH:
                self._watchers |= {session}
            case PluginKind.UNSUBSCRIBE_WATCH:
                self._watchers -= {session}
            case _:
                raise BlackBoardError(f"a client sent {message.kind.name}, which only servers do")

    def disconnected(self, session: FawkesSession) -> None:
        self._watchers -= {session}

    def stop(self) -> None:
        """End the thread after its present work."""
        with self._lock:
            worker, self._worker = self._worker, None
        if worker is not None:
            worker.stop(_STOP_TIMEOUT_S)

    def notify_loaded(self, name: str) -> None:
        """Notify all watchers of a loaded plugin."""
        self._notify(PluginMessage(PluginKind.LOADED, name))

    def notify_unloaded(self, name: str) -> None:
        """Notify watchers of an unloaded plugin."""
        self._notify(PluginMessage(PluginKind.UNLOADED, name))

    def _notify(self, message: PluginMessage) -> None:
        for session in self._watchers:
            _send(session, message)

    def _run_in_worker(self, call: Callable[[], None]) -> None:
        with self._lock:
            if self._worker is None:
                self._worker = Dispatcher("FawkesNetPlugins", self._report_failure)
            self._worker.put(call)

    def _report_failure(self, kind: str, error: Exception) -> None:
        self._complaints.add(kind, f"loading or unloading failed: {type(error).__name__}: {error}")

    def _load_or_unload(self, session: FawkesSession, message: PluginMessage) -> None:
        """Load or unload a plugin, in the worker thread, and send the outcome to the client."""
        if message.kind == PluginKind.LOAD:
            apply_change, success, failure = self._host.load, PluginKind.LOADED, PluginKind.LOAD_FAILED
        else:
            apply_change, success, failure = self._host.unload, PluginKind.UNLOADED, PluginKind.UNLOAD_FAILED
        try:
            apply_change(message.name)
        except Exception as error:
            _send(session, PluginMessage(failure, message.name))  # the client waits for a reply
            if not isinstance(error, CxbridgeError):
                raise  # to `_report_failure`, with the class of the error
            self._complaints.add(f"{message.kind.name} {message.name}", error.message)
        else:
            _send(session, PluginMessage(success, message.name))


def _send(session: FawkesSession, message: PluginMessage) -> None:
    session.send(message.to_bytes())
