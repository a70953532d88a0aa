"""Conversion of a run to mcap with additional messages for Foxglove's panels."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from pathlib import Path

from cxbridge.events import Event
from cxbridge.interfaces.registry import InterfaceRegistry
from cxbridge.trace.codec import dump_json
from cxbridge.trace.formats.base import CopyFormat
from cxbridge.trace.formats.mcap.writer import McapWriter
from cxbridge_web.foxglove.messages import make_foxglove_messages
from cxbridge_web.foxglove.schemas import make_json_schema


class FoxgloveWriter(McapWriter):
    """An mcap file with the channels of :class:`McapWriter` and the channels for panels.

    :param path: the file; an existing file is replaced.
    """

    def __init__(self, path: Path, _registry: InterfaceRegistry) -> None:
        super().__init__(path)
        self._panel_channels: dict[str, int] = {}
        self._panel_schemas: dict[str, int] = {}

    def _make_messages(self, events: Iterable[Event]) -> Iterator[tuple[int, int, bytes]]:
        """Yield events as messages, each followed by its messages for panels."""
        for event in events:
            yield from super()._make_messages((event,))
            for message in make_foxglove_messages(event):
                channel = self._get_channel(message.topic, message.schema)
                yield channel, event.time_us * 1000, message.encode()

    def _get_channel(self, topic: str, schema: str) -> int:
        """Return the channel of a topic. A missing channel is added with its schema."""
        if topic not in self._panel_channels:
            if schema not in self._panel_schemas:
                json_schema = make_json_schema(schema)
                self._panel_schemas[schema] = self._mcap.add_schema(
                    json_schema["title"], "jsonschema", dump_json(json_schema).encode()
                )
            self._panel_channels[topic] = self._mcap.add_channel(topic, "json", self._panel_schemas[schema])
        return self._panel_channels[topic]


COPIES = (CopyFormat("foxglove", 40, f"{__name__}:FoxgloveWriter"),)  # rank 40: after the formats of cxbridge
