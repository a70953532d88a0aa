"""Writes a run as mcap (https://mcap.dev/spec): JSON messages, one topic a kind; see docs/formats.md.

Chunks are not compressed: that keeps recording cheap, and ``mcap compress`` does it later when wanted.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from types import ModuleType
from typing import IO, TYPE_CHECKING

from cxbridge import __version__
from cxbridge.errors import TraceError
from cxbridge.events import Event, InterfaceMessage, InterfaceWrite, SourceRead
from cxbridge.trace.codec import NAMES, dump, schema_of, to_plain
from cxbridge.trace.formats.base import Attachment, RunWriter
from cxbridge.trace.formats.mcap_topics import INTERFACE_TOPICS, METADATA, PROFILE, SOURCE, TOPICS
from cxbridge.trace.levels import RecordLevel
from cxbridge.trace.sourcing import SourceNamer

if TYPE_CHECKING:
    from mcap.writer import Writer

_CHUNK_SIZE = 256 * 1024
_FLUSH_SECONDS = 0.5


class McapWriter(RunWriter):
    """An mcap file.

    Whatever was written more than half a second of real time before the last event is safe in the file: a run
    that is killed can be read up to there.

    :param path: the file; it is made anew.
    :param definition: returns the definition of an interface type, to be attached before its first event.
    :param files: whether to attach what the run is made of.
    :raises TraceError: when the file cannot be made.
    """

    def __init__(
        self,
        path: str | Path,
        *,
        definition: Callable[[str, int], SourceRead | None] = lambda _type, _time_us: None,
        files: bool = True,
    ) -> None:
        self.path = Path(path)
        self._definition = definition
        self._files = files
        self._sources = SourceNamer()
        self._types: set[str] = set()
        self._channels: dict[tuple[str, str], int] = {}
        self._schemas: dict[type[Event], int] = {}
        try:
            self._file = self.path.open("wb")
        except OSError as error:
            raise TraceError(f"cannot be written: {error.strerror}", file=path) from error
        self._writer = _make_writer(self._file)
        self._flushed = time.monotonic()
        with self._writing():
            self._writer.start(profile=PROFILE, library=f"cxbridge {__version__}")
            self._file.flush()

    def event_types(self, level: RecordLevel) -> frozenset[type[Event]]:
        """Return the types of events of the level, all of them, and what the run is made of."""
        return level.event_types | {SourceRead} if self._files else level.event_types

    def write(self, event: Event) -> None:
        """Write one event as a message, or the files that it tells of as attachments."""
        kind = type(event)
        if isinstance(event, SourceRead):
            self._write_source(event)
            return
        uid = event.uid if isinstance(event, InterfaceWrite | InterfaceMessage) else ""
        channel = self._channels.get((NAMES[kind], uid))
        data = dump(to_plain(event)).encode("utf-8", "backslashreplace")
        log_time = event.time_us * 1000
        try:
            if channel is None:
                self._define(uid.partition("::")[0], event.time_us)
                channel = self._add_channel(kind, uid)
            self._writer.add_message(channel, log_time, data, log_time)
        except OSError as error:
            raise self._failed(error) from error
        if time.monotonic() - self._flushed > _FLUSH_SECONDS:
            self.flush()

    def describe(self, metadata: Mapping[str, str]) -> None:
        """Write a metadata record."""
        with self._writing():
            self._writer.add_metadata(METADATA, dict(metadata))
            self._file.flush()

    def attach(self, attachment: Attachment) -> None:
        """Write an attachment record."""
        with self._writing():
            time_ns = attachment.time_us * 1000
            self._writer.add_attachment(
                time_ns, time_ns, attachment.name, attachment.media_type, attachment.data
            )

    def _write_source(self, event: SourceRead) -> None:
        """Write the record of something that the run is made of, and attach it when it is new."""
        record, attachment = self._sources.record(event)
        if attachment is not None:
            self.attach(attachment)
        with self._writing():
            self._writer.add_metadata(SOURCE, record)

    def _define(self, interface_type: str, time_us: int) -> None:
        """Attach the definition of an interface type, once."""
        if interface_type and interface_type not in self._types and self._files:
            self._types.add(interface_type)
            source = self._definition(interface_type, time_us)
            if source is not None:
                self._write_source(source)

    def flush(self) -> None:
        """Finish the chunk, and bring it into the file."""
        self._flushed = time.monotonic()
        with self._writing():
            self._writer.flush()  # type: ignore[no-untyped-call]

    def close(self) -> None:
        """Write the index and close the file."""
        if self._file.closed:
            return
        try:
            with self._writing():
                self._writer.finish()  # type: ignore[no-untyped-call]
        finally:
            with self._writing():
                self._file.close()

    def _add_channel(self, kind: type[Event], uid: str) -> int:
        """Register the channel of this kind of event, or of this interface, and its schema."""
        schema = self._schemas.get(kind)
        if schema is None:
            data = dump(schema_of(kind)).encode()
            schema = self._writer.register_schema(f"cxbridge.{kind.__name__}", "jsonschema", data)
            self._schemas[kind] = schema
        name = NAMES[kind]
        topic = INTERFACE_TOPICS[name] + uid.replace("::", "/", 1) if uid else TOPICS[name]
        channel = self._writer.register_channel(topic, "json", schema)
        self._channels[name, uid] = channel
        return channel

    @contextmanager
    def _writing(self) -> Iterator[None]:
        """Turn errors of the operating system into ours."""
        try:
            yield
        except OSError as error:
            raise self._failed(error) from error

    def _failed(self, error: OSError) -> TraceError:
        """Return our error for one of the operating system."""
        return TraceError(f"cannot be written: {error.strerror}", file=self.path)


def _make_writer(file: IO[bytes]) -> Writer:
    """Make the library's writer, and load no more for it than it needs.

    ``mcap.writer`` imports lz4 and zstandard when they are there, and ``importlib.metadata`` with all that it
    needs for its own version number. Both together take longer than recording a run of the test scenario. It
    copes with absent compressors, so they look absent while it is imported; a stand-in tells the version.
    """
    if "mcap.writer" not in sys.modules:
        with _modules({"lz4": None, "lz4.frame": None, "zstandard": None, "importlib.metadata": _metadata()}):
            import mcap.writer  # noqa: F401, PLC0415 - see above
    from mcap.writer import CompressionType, Writer  # noqa: PLC0415 - see above

    return Writer(file, chunk_size=_CHUNK_SIZE, compression=CompressionType.NONE)


def _metadata() -> ModuleType:
    """Return a stand-in for importlib.metadata that knows no version of anything."""
    module = ModuleType("importlib.metadata")
    vars(module).update(PackageNotFoundError=ImportError, version=lambda _: "0.0.0")
    return module


@contextmanager
def _modules(substitutes: Mapping[str, ModuleType | None]) -> Iterator[None]:
    """Put modules in the place of those that are not loaded yet; None makes an import fail."""
    absent = {name: module for name, module in substitutes.items() if name not in sys.modules}
    sys.modules.update(absent)  # type: ignore[arg-type]  # None is what the import system checks for
    try:
        yield
    finally:
        for name in absent:
            del sys.modules[name]
