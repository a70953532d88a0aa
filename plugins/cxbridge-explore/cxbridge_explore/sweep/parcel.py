"""Packs a job for machines without the agent and without cxbridge."""

from __future__ import annotations

import io
import pickle
import zipfile
from collections.abc import Iterator
from dataclasses import fields, replace
from pathlib import Path
from typing import Any, Final

import cxbridge
from cxbridge.errors import CxbridgeError
from cxbridge.run.source import source_of
from cxbridge_explore.sweep.remote import AGENT, CODE, JOB
from cxbridge_explore.sweep.rows import SweepJob

MOST_BYTES: Final = 64 * 1024 * 1024  # limit of an agent's files before compression

_SKIPPED: Final = frozenset({"__pycache__", ".git", ".venv", "node_modules"})
_SHARED: Final = ("interfaces", "luaskills", "share")
# Options whose folders are too large to pack: they must exist at the same path everywhere.
_ELSEWHERE: Final = frozenset({"fawkes_dir", "overlays"})


def pack(job: SweepJob) -> bytes:
    """Return a job with its agent and the code of cxbridge, for ``play_remotely``.

    :raises CxbridgeError: if the agent is too large, or a file cannot be read.
    """
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w", zipfile.ZIP_DEFLATED) as parcel:
        _add_code(parcel)
        _add_job(parcel, job)
    return buffer.getvalue()


def _add_code(parcel: zipfile.ZipFile) -> None:
    package = Path(cxbridge.__file__).parent
    for file in _files(package):
        _write(parcel, f"{CODE}/cxbridge/{file.relative_to(package).as_posix()}", file)
    for name in _SHARED:
        folder = package.parent / name
        if folder.is_dir():  # in a checkout, these folders are next to the package
            for file in _files(folder):
                _write(parcel, f"{CODE}/{name}/{file.relative_to(folder).as_posix()}", file)


def _add_job(parcel: zipfile.ZipFile, job: SweepJob) -> None:
    """Add the files named by the options, and the job with their new paths."""
    moved: dict[str, Path] = {}
    size = 0
    options = job.options
    if options.scenario is not None:
        options = replace(options, scenario=source_of(options).config_file().parent)

    def move(path: Path) -> Path:
        nonlocal size
        source = path.resolve()
        known = moved.get(str(source))
        if known is not None:
            return known
        target = moved[str(source)] = Path(f"{len(moved)}") / source.name
        for file in _files(source) if source.is_dir() else [source]:
            size += file.stat().st_size
            if size > MOST_BYTES:
                raise CxbridgeError(
                    f"the agent has more than {MOST_BYTES >> 20} MiB of files; it cannot travel", file=source
                )
            inside = file.relative_to(source).as_posix() if file != source else ""
            _write(parcel, f"{AGENT}/{target.as_posix()}/{inside}".rstrip("/"), file)
        return target

    changes: dict[str, Any] = {}
    for field in fields(options):
        value = getattr(options, field.name)
        if field.name in _ELSEWHERE:
            continue
        if isinstance(value, Path):
            changes[field.name] = move(value)
        elif isinstance(value, tuple) and any(isinstance(each, Path) for each in value):
            changes[field.name] = tuple(move(each) for each in value)
    world = None if job.world is None else move(job.world)
    parcel.writestr(f"{AGENT}/.here", b"")
    parcel.writestr(JOB, pickle.dumps(replace(job, options=replace(options, **changes), world=world)))


def _files(folder: Path) -> Iterator[Path]:
    for path in sorted(folder.iterdir()):
        if path.name in _SKIPPED:
            continue
        if path.is_dir():
            yield from _files(path)
        elif path.is_file():
            yield path


def _write(parcel: zipfile.ZipFile, name: str, file: Path) -> None:
    """Add a file without its time, so that equal files give equal parcels and workers unpack each once."""
    try:
        parcel.writestr(zipfile.ZipInfo(name), file.read_bytes(), zipfile.ZIP_DEFLATED)
    except OSError as error:
        raise CxbridgeError(f"cannot be read: {error.strerror}", file=file) from error
