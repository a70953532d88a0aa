"""The components of a daemon as plugins for Fawkes' ffplugin.

Components start and stop in the thread of the main loop. Therefore the server's threads put their requests
into a queue and wait until the main loop has processed them.
"""

from __future__ import annotations

import threading
from collections import deque
from collections.abc import Sequence
from typing import TYPE_CHECKING

from cxbridge.errors import CxbridgeError
from cxbridge.run.components.manager import ComponentManager, LifecycleError, State

if TYPE_CHECKING:
    from cxbridge_fawkes.network.components.plugins import PluginManager

REPLY_TIMEOUT_S = 30.0
"""The time limit of loading or unloading in seconds: an executive loads all files of an agent."""


class _Request:
    """A client's request to load or unload a component."""

    def __init__(self, name: str, *, is_load: bool) -> None:
        self.name = name
        self.is_load = is_load
        self.processed = threading.Event()
        self.error: CxbridgeError | None = None
        self._claimed = threading.Lock()  # never released: Python has no other atomic test-and-set

    def claim(self) -> bool:
        """Claim the request; only the first claim succeeds.

        The main loop claims a request to process it, and a client claims it to withdraw it after a timeout.
        """
        return self._claimed.acquire(blocking=False)


class DaemonPlugins:
    """Starts and stops components for other threads, in the thread of the main loop.

    :param manager: the manager of the components. Steady components serve the clients and are not plugins.
    :param may_change: whether clients may load and unload plugins.
    """

    def __init__(self, manager: ComponentManager, *, may_change: bool) -> None:
        self._manager = manager
        self._may_change = may_change
        self._requests: deque[_Request] = deque()
        self._is_closed = False
        self._notified_names: list[str] = []
        self.watchers: PluginManager | None = None
        """Notifies the connected tools of loaded and unloaded plugins."""

    def list_available(self) -> list[tuple[str, str]]:
        """Return name and description of the components that can be loaded and unloaded."""
        return [(node.name, node.description) for node in self._manager.nodes if not node.steady]

    def list_loaded(self) -> Sequence[str]:
        """Return the names of the active components in the order of the start."""
        return [node.name for node in self._manager.nodes if not node.steady and node.state is State.ACTIVE]

    def load(self, name: str) -> None:
        """Start components, separated by commas, and wait until they are active.

        :raises CxbridgeError: if a component cannot be started.
        """
        for component in name.split(","):
            self._submit(_Request(component.strip(), is_load=True))

    def unload(self, name: str) -> None:
        """Stop a component.

        :raises CxbridgeError: if the component cannot be stopped.
        """
        self._submit(_Request(name.strip(), is_load=False))

    def _submit(self, request: _Request) -> None:
        if not self._may_change:
            raise LifecycleError("clients may not load or unload anything: cxbridge/remote-control is off")
        # appended before the check: a concurrent close() either refuses the request or is noticed here
        self._requests.append(request)
        if self._is_closed:
            raise LifecycleError("the daemon is stopping")
        if not request.processed.wait(REPLY_TIMEOUT_S):
            state = "the request is withdrawn" if request.claim() else "the request is being processed"
            raise LifecycleError(f"{request.name}: no answer within {REPLY_TIMEOUT_S:g} s, {state}")
        if request.error is not None:
            raise request.error

    def poll(self) -> bool:
        """Process the requests; return whether there were any."""
        has_processed = False
        while self._requests:
            request = self._requests.popleft()
            if not request.claim():
                continue
            has_processed = True
            try:
                (self._manager.start_component if request.is_load else self._manager.stop_component)(
                    request.name
                )
            except CxbridgeError as error:
                request.error = error
            request.processed.set()
        return has_processed

    def notify_watchers(self) -> None:
        """Notify the watchers of plugins that were loaded or unloaded since the last call."""
        previous_names, names = self._notified_names, list(self.list_loaded())
        self._notified_names = names
        if self.watchers is not None:
            for name in previous_names:
                if name not in names:
                    self.watchers.notify_unloaded(name)
            for name in names:
                if name not in previous_names:
                    self.watchers.notify_loaded(name)

    def close(self) -> None:
        """Refuse the waiting and all further requests."""
        self._is_closed = True
        while self._requests:
            request = self._requests.popleft()
            request.error = LifecycleError("the daemon is stopping")
            request.processed.set()
