"""Making of the records of a run's sources, the files and definitions that the run reads.

:mod:`.sources` reads the records. The content of a source becomes an attachment of the recording.
docs/formats.md, section "Files of the run", lists the sources.
"""

from __future__ import annotations

import json
import re
from collections import Counter
from contextlib import suppress
from hashlib import sha256
from pathlib import Path
from typing import TYPE_CHECKING, Final

from cxbridge.config.secrets import has_secrets, mask_value
from cxbridge.events import Event, EventBus, SourceRead
from cxbridge.trace.formats.base import Attachment

if TYPE_CHECKING:
    from cxbridge.config import Configuration
    from cxbridge.interfaces.registry import InterfaceRegistry

_UNSAFE_CHARACTER: Final = re.compile(r"[^A-Za-z0-9._-]")
_MEDIA_TYPES: Final = {
    "clp": "text/x-clips",
    "yaml": "application/yaml",
    "json": "application/json",
    "pddl": "text/x-pddl",
    "xml": "application/xml",
    "lua": "text/x-lua",
}
# The order of reading matters for these roles: numbers in the names of the attachments keep the order.
_NUMBERED_ROLES: Final = frozenset({"config", "clips", "construct"})


class EarlySources:
    """Stores the events of sources that are read before the recorder exists."""

    def __init__(self, bus: EventBus) -> None:
        self._bus = bus
        self._events: list[Event] = []
        bus.subscribe(self._store, SourceRead)

    def _store(self, event: Event) -> None:
        self._events.append(event)

    def take_events(self) -> list[Event]:
        """Stop storing events; return the stored events."""
        self._bus.unsubscribe(self._store)
        events, self._events = self._events, []
        return events


class SourceRecordMaker:
    """Makes the metadata record of each source and, for new content, the attachment."""

    def __init__(self) -> None:
        self._counts_by_owner: Counter[str] = Counter()
        self._names_by_digest: dict[bytes, str] = {}
        self._used_names: set[str] = set()

    def make_record(self, event: SourceRead) -> tuple[dict[str, str], Attachment | None]:
        """Return the metadata record of a source, and the attachment to write before the record.

        The attachment is None for a source without content, and for content that has an attachment already.
        """
        record = {"role": event.role, "owner": event.owner, "name": event.name, **event.details}
        attachment = None
        if event.data is not None:
            if event.role in _NUMBERED_ROLES:
                self._counts_by_owner[event.owner] += 1
            number = self._counts_by_owner[event.owner]
            # equal files of one role share an attachment; those of different roles must not, because the
            # attachment's folder depends on the role
            digest = sha256(event.role.encode() + b"\0" + event.data).digest()
            attachment_name = self._names_by_digest.get(digest)
            if attachment_name is None:
                attachment_name = self._names_by_digest[digest] = self._choose_unique_name(
                    _make_attachment_name(event, number)
                )
                attachment = Attachment(
                    attachment_name,
                    _MEDIA_TYPES.get(attachment_name.rpartition(".")[2], "text/plain"),
                    event.data,
                    event.time_us,
                )
            record["attachment"] = attachment_name
        record["time_us"] = str(event.time_us)
        return {key: value for key, value in record.items() if value}, attachment

    def _choose_unique_name(self, name: str) -> str:
        """Return the name if it is unused; otherwise the name with a number before its ending."""
        unique_name, number = name, 1
        stem, dot, suffix = name.rpartition(".")
        while unique_name in self._used_names:
            number += 1
            unique_name = f"{stem}-{number}.{suffix}" if dot else f"{name}-{number}"
        self._used_names.add(unique_name)
        return unique_name


def _make_attachment_name(event: SourceRead, number: int) -> str:
    role, file_name = event.role, safe_name(event.name.rsplit("/", 1)[-1])
    if role in {"clips", "construct"}:
        # a construct has the name of a rule or function, which has no ending
        ending = "" if role == "clips" else ".clp"
        return f"clips/{safe_name(event.owner)}/{number:04d}-{file_name}{ending}"
    if role == "skill":
        return "/".join(["skills", *map(safe_name, event.name.removeprefix("skills/").split("/"))])
    names_by_role = {
        "config": f"config/{number:04d}-{file_name}",
        "config-tree": "config/tree.json",
        "interface": f"interfaces/{file_name}.xml",
    }
    return names_by_role.get(role) or f"{safe_name(role)}/{file_name}"


def safe_name(name: str) -> str:
    """Return a name with only ASCII letters, digits, ``_``, ``-`` and ``.``, but without dots at its start.

    Such a name is one part of a path, and neither hidden nor ``..``; characters in excess are cut off.
    """
    # file systems limit a name to 255 bytes, in which a number and an ending must fit, too
    return (_UNSAFE_CHARACTER.sub("_", name).lstrip(".") or "_")[:200]


def emit_configuration(bus: EventBus, config: Configuration) -> None:
    """Emit the existing files of a configuration and the resolved tree as sources, without secrets.

    A file with secrets is left out; the tree has its other values.
    """
    for file in config.files:
        with suppress(OSError):  # the file was deleted after its reading; the tree has its values
            content = Path(file).read_bytes()
            if not has_secrets(content):
                bus.emit_source("config", "", str(file), content)
    tree = {
        value.path: list(value.items) if value.is_list else value.text
        for value in map(mask_value, config.search("/"))
    }
    tree_json = json.dumps(tree, ensure_ascii=False, indent=1)
    bus.emit_source("config-tree", "", "tree.json", tree_json.encode("utf-8", "backslashreplace"))


def read_interface_source(
    registry: InterfaceRegistry, interface_type: str, time_us: int
) -> SourceRead | None:
    """Return the definition of an interface type as a source; None if the type has no readable file."""
    path = registry.path(interface_type)
    with suppress(OSError):
        if path is not None:
            return SourceRead(time_us, "interface", "", interface_type, path.read_bytes(), {})
    return None
