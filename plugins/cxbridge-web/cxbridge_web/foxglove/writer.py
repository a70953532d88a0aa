"""Conversion of a run to mcap with additional messages for Foxglove's panels."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from functools import cache
from pathlib import Path

from cxbridge.events import Event
from cxbridge.interfaces.registry import InterfaceRegistry
from cxbridge.trace.codec import dump_json
from cxbridge.trace.formats.base import CopyFormat
from cxbridge.trace.formats.mcap.writer import McapWriter
from cxbridge_web.foxglove.messages import make_foxglove_messages
from cxbridge_web.foxglove.schemas import make_json_schema


class FoxgloveWriter(McapWriter):
    """Writes an mcap file with the channels of :class:`McapWriter` and channels for panels.

    :param path: the file; an existing file is replaced.
    :param _registry: unused; each :class:`CopyFormat` passes the registry to its writer.
    """

    def __init__(self, path: Path, _registry: InterfaceRegistry) -> None:
        super().__init__(path)
        self._get_panel_channel = cache(self._add_panel_channel)
        self._get_panel_schema = cache(self._add_panel_schema)

    def _make_messages(self, events: Iterable[Event]) -> Iterator[tuple[int, int, bytes]]:
        """Yield events as messages, each followed by its messages for panels."""
        for event in events:
            yield from super()._make_messages((event,))
            for message in make_foxglove_messages(event):
                channel = self._get_panel_channel(message.topic, message.schema_name)
                yield channel, event.time_us * 1000, message.encode()

    def _add_panel_channel(self, topic: str, schema_name: str) -> int:
        """Add the channel of a topic, and return its number."""
        return self._mcap.add_channel(topic, "json", self._get_panel_schema(schema_name))

    def _add_panel_schema(self, schema_name: str) -> int:
        """Add the schema of a name such as ``Log``, and return its number."""
        json_schema = make_json_schema(schema_name)
        return self._mcap.add_schema(json_schema["title"], "jsonschema", dump_json(json_schema).encode())


# rank 40: after the formats of cxbridge itself
COPIES = (CopyFormat("foxglove", 40, f"{__name__}:FoxgloveWriter"),)
