"""The plugin manager component: lists the components of this process as Fawkes' plugins."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from enum import IntEnum
from typing import ClassVar, Final

from cxbridge.errors import BlackBoardError
from cxbridge_fawkes.network.errors import MalformedMessageError
from cxbridge_fawkes.network.messages.fields import MAX_ELEMENT_BYTES, pack_list
from cxbridge_fawkes.network.messages.frames import ComponentId, FawkesFrame
from cxbridge_fawkes.network.session import FawkesSession, NetworkHandler


class PluginKind(IntEnum):
    """The kinds of messages that the component handles or sends."""

    LOAD = 1
    LOAD_FAILED = 3
    UNLOAD = 4
    UNLOAD_FAILED = 6
    LIST_AVAIL = 7
    AVAIL_LIST = 8
    LIST_LOADED = 10
    LOADED_LIST = 11


# the kind of the reply to a refused request
_REFUSAL_KINDS: Final = {
    PluginKind.LOAD: PluginKind.LOAD_FAILED,
    PluginKind.UNLOAD: PluginKind.UNLOAD_FAILED,
}


class PluginManager(NetworkHandler):
    """Lists plugins, and refuses to load and unload them.

    :param list_plugins: returns a tuple for each plugin, in the order of loading: its name, its description,
        and whether it is loaded. Called in the server's thread.
    """

    COMPONENT: ClassVar[ComponentId] = ComponentId.PLUGIN_MANAGER

    def __init__(self, list_plugins: Callable[[], Iterable[tuple[str, str, bool]]]) -> None:
        self._list_plugins: Final = list_plugins

    def handle(self, session: FawkesSession, frame: FawkesFrame) -> None:
        plugins = self._list_plugins()
        match frame.kind:
            case PluginKind.LIST_AVAIL:
                # in the list, names and descriptions alternate
                texts = [text for name, description, _ in plugins for text in (name, description)]
                _send_list(session, PluginKind.AVAIL_LIST, texts)
            case PluginKind.LIST_LOADED:
                names = [name for name, _, is_loaded in plugins if is_loaded]
                _send_list(session, PluginKind.LOADED_LIST, names)
            case PluginKind.LOAD | PluginKind.UNLOAD as kind:
                # the client waits for a reply with the plugin's name, as in its request
                session.send(frame._replace(kind=_REFUSAL_KINDS[PluginKind(kind)]).to_bytes())
                raise BlackBoardError(
                    "Fawkes' tools may not load or unload plugins", hint="use 'cxbridge daemon component'"
                )
            case _:
                raise MalformedMessageError(f"the plugin manager has no requests of kind {frame.kind}")


def _send_list(session: FawkesSession, kind: PluginKind, texts: Iterable[str]) -> None:
    elements = (text.encode(errors="replace")[:MAX_ELEMENT_BYTES] for text in texts)
    session.send(FawkesFrame(ComponentId.PLUGIN_MANAGER, kind, pack_list(elements)).to_bytes())
