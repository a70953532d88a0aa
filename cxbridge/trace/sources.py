"""Reading of the sources of a recorded run, the files and definitions that the run read.

The content of a source is read when :attr:`RunSource.data` is used. docs/formats.md, section "Files of the
run", lists the sources.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from fnmatch import fnmatchcase
from pathlib import Path, PurePosixPath

from cxbridge.errors import TraceError
from cxbridge.events import SourceRead
from cxbridge.numbers import parse_decimal
from cxbridge.trace.formats.base import Run, StoredFile
from cxbridge.trace.formats.files import writing

# The keys of records that `RunSource` has as separate attributes.
_COMMON_KEYS = frozenset({"role", "owner", "name", "attachment", "time_us"})


@dataclass(frozen=True, slots=True)
class RunSource:
    """A source of a recorded run.

    :param role: ``clips``, ``config``, ``feature`` ...; docs/formats.md lists them.
    :param owner: the name of the CLIPS environment; empty if the source belongs to no environment.
    :param name: the requested path, or a name for a source without a file.
    :param time_us: the time of reading in microseconds since the epoch, 0 if unknown.
    :param details: the further keys of the record, which depend on the role.
    :param file: the content; None if the source has no content, or the recording ends before the content.
    """

    role: str
    owner: str
    name: str
    time_us: int
    details: Mapping[str, str]
    file: StoredFile | None

    @property
    def data(self) -> bytes | None:
        """The content, read from the recording; None without content.

        :raises TraceError: if the content is damaged.
        """
        return None if self.file is None else self.file.read()

    def to_event(self) -> SourceRead:
        """Return the event that the run recorded."""
        return SourceRead(self.time_us, self.role, self.owner, self.name, self.data, self.details)


def run_sources(run: Run, *roles: str, owner: str | None = None) -> Iterator[RunSource]:
    """Yield the sources of a run in the order of reading.

    :param roles: the roles of the sources; empty: all roles.
    :param owner: the CLIPS environment of the sources; None: all environments.
    :raises TraceError: if the recording cannot be read.
    """
    files = {file.name: file for file in run.files()}
    for record in run.source_records():
        role, source_owner = record.get("role", ""), record.get("owner", "")
        if (roles and role not in roles) or owner not in (None, source_owner):
            continue
        yield RunSource(
            role,
            source_owner,
            record.get("name", ""),
            parse_decimal(record.get("time_us", "")) or 0,
            {key: value for key, value in record.items() if key not in _COMMON_KEYS},
            files.get(record.get("attachment", "")),
        )


def extract_files(run: Run, folder: Path, pattern: str = "*") -> list[Path]:
    """Write the files of a run to a folder, which is created if necessary.

    :param pattern: a pattern for the names of the files, with ``*``, ``?`` and ``[]``.
    :returns: the files.
    :raises TraceError: if a name leads out of the folder, or a file exists, is damaged or cannot be written.
        The files written so far are then removed.
    """
    files = [
        (folder / _make_relative_path(run, file.name), file)
        for file in run.files()
        if fnmatchcase(file.name, pattern)
    ]
    for path, _ in files:
        if path.exists():
            raise TraceError("the file exists already", file=path, hint="name another folder")
    written_paths: list[Path] = []
    try:
        for path, file in files:
            data = file.read()  # before the file is created, because the data may be damaged
            with writing(path):
                path.parent.mkdir(parents=True, exist_ok=True)
                with path.open("xb") as target:
                    written_paths.append(path)
                    target.write(data)
    except BaseException:  # also after Ctrl-C, no part of the files remains
        for path in written_paths:
            path.unlink(missing_ok=True)
        raise
    return written_paths


def _make_relative_path(run: Run, name: str) -> PurePosixPath:
    """Return the name of an attachment as a relative path within its folder.

    :raises TraceError: if the name leads out of the folder.
    """
    path = PurePosixPath(name)
    has_unsafe_part = any(part in ("", ".", "..") for part in name.split("/"))
    if path.is_absolute() or has_unsafe_part or "\\" in name or "\0" in name:
        raise TraceError(
            f"an attachment is called {name!r}: it is not extracted",
            file=run.path,
            hint="the recording is damaged or malicious",
        )
    return path
