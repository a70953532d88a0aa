"""Finds the recorded sources of a CLIPS environment, in the order in which it can be built again."""

from __future__ import annotations

from collections.abc import Collection
from pathlib import Path

from cxbridge.errors import TraceError
from cxbridge.suggestions import did_you_mean
from cxbridge.trace.formats.base import Run
from cxbridge.trace.sources import RunSource, run_sources


def find_build_sources(run: Run, owner: str, until_us: int | None = None) -> list[RunSource]:
    """Return the sources of a CLIPS environment in the order in which an environment is built from them.

    The caller must load each file without executing its commands: the results of the commands are sources,
    too, and precede the file.

    :param owner: the environment's name; after a reset of a daemon, the last environment of that name.
    :param until_us: the time of the last included source, in microseconds since the epoch; None for all.
    :raises TraceError: if the recording cannot be read.
    """
    build_sources: list[RunSource] = []
    file_indices: dict[str, int] = {}  # the indices of the files in `build_sources`, by name
    for source in run_sources(run, "environment", "clips", "construct", "function", "feature", owner=owner):
        if until_us is not None and source.time_us > until_us:
            break
        if source.role == "environment":
            build_sources, file_indices = [], {}
            continue
        # A source that a file has loaded precedes the file, because later constructs of the file may use its
        # constructs.
        enclosing_file = source.details.get("within", "")
        index = file_indices.get(enclosing_file, len(build_sources)) if enclosing_file else len(build_sources)
        build_sources.insert(index, source)
        # The insertion moves the files at and after this index by one.
        for file, file_index in file_indices.items():
            file_indices[file] = file_index + (file_index >= index)
        if source.role == "clips":
            file_indices[source.name] = index
    return build_sources


def make_unknown_environment_error(env: str, names: Collection[str], path: Path) -> TraceError:
    """Return the error about a CLIPS environment that a recording lacks.

    :param names: the names of the recording's environments.
    """
    hint = did_you_mean(env, names, f"there are: {', '.join(sorted(names)) or 'none'}")
    return TraceError(f"the recording has no CLIPS environment '{env}'", file=path, hint=hint)
