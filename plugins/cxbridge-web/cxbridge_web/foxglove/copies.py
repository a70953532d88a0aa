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
from cxbridge_web.foxglove.schemas import make_json_schema, make_schema_name


class FoxgloveWriter(McapWriter):
    """An mcap file with the channels of :class:`McapWriter` and the channels for panels.

    :param path: the file; an existing file is replaced.
    """

    def __init__(self, path: Path) -> None:
        super().__init__(path)
        self._panel_channels: dict[str, int] = {}
        self._panel_schemas: dict[str, int] = {}

    def _make_messages(self, events: Iterable[Event]) -> Iterator[tuple[int, int, bytes]]:
        """Yield events as messages, each followed by its messages for panels."""
        for event in events:
            yield from super()._make_messages((event,))
            for message in make_foxglove_messages(event):
                data = dump_json(message.data).encode("utf-8", "backslashreplace")
                time_ns = event.time_us * 1000
                yield self._get_channel(message.topic, message.schema), time_ns, data

    def _get_channel(self, topic: str, schema: str) -> int:
        """Return the channel of a topic. A missing channel is added with its schema."""
        if topic not in self._panel_channels:
            if schema not in self._panel_schemas:
                text = dump_json(make_json_schema(schema)).encode()
                self._panel_schemas[schema] = self._mcap.add_schema(
                    make_schema_name(schema), "jsonschema", text
                )
            self._panel_channels[topic] = self._mcap.add_channel(topic, "json", self._panel_schemas[schema])
        return self._panel_channels[topic]


def open_copy(path: Path, _registry: InterfaceRegistry) -> FoxgloveWriter:
    return FoxgloveWriter(path)


COPIES = (CopyFormat("foxglove", 40, f"{__name__}:open_copy"),)  # rank 40: after the formats of cxbridge
