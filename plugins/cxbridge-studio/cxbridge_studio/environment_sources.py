"""The sources from which the CLIPS environment of a recorded run is built again."""

from __future__ import annotations

from cxbridge.trace.formats.base import Run
from cxbridge.trace.sources import RunSource, run_sources


def building_steps(run: Run, owner: str, until_us: int | None = None) -> list[RunSource]:
    """Return the sources of a CLIPS environment in an order for building it again.

    Load the files without executing the commands in them, because the results of these commands precede the
    files.

    :param owner: the environment's name; after a reset of a daemon, the last environment of that name.
    :param until_us: include sources up to this time, in microseconds since the epoch; None: all.
    :raises TraceError: if the recording cannot be read.
    """
    steps: list[RunSource] = []
    file_steps: dict[str, int] = {}
    for source in run_sources(run, "environment", "clips", "construct", "function", "feature", owner=owner):
        if until_us is not None and source.time_us > until_us:
            break
        if source.role == "environment":
            steps, file_steps = [], {}
            continue
        # a source that was loaded by a file precedes the file, because its constructs existed before those of
        # the file
        enclosing = source.details.get("within", "")
        index = file_steps.get(enclosing, len(steps)) if enclosing else len(steps)
        steps.insert(index, source)
        for file, file_index in file_steps.items():
            file_steps[file] = file_index + (file_index >= index)
        if source.role == "clips":
            file_steps[source.name] = index
    return steps
