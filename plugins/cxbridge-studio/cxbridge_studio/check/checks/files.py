"""Checks for missing files, and for files that the core hides."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Final

from cxbridge.file_access import ABSENT, why_unreadable
from cxbridge.suggestions import did_you_mean
from cxbridge_studio.check.agent import Agent
from cxbridge_studio.check.findings import Code, Finding, Severity

MISSING: Final = Code(
    "CX102",
    Severity.ERROR,
    "a file is missing",
    "The spec, or a CLIPS file, loads a file that none of the folders contains, or that you may not read. "
    "The executive continues without the file: its rules do not exist, and goals wait forever.",
)

SHADOWED: Final = Code(
    "CX103",
    Severity.WARNING,
    "a file of the core hides one of the agent",
    "The core's folder is searched first. A file of the agent that has the name of a core file is never "
    "loaded.",
)

CODES: Final = (MISSING, SHADOWED)


def check(agent: Agent) -> Iterator[Finding]:
    """Yield the missing files and the hidden files."""
    folders = (*agent.context.paths.before, agent.context.paths.cx, *agent.context.paths.clips_dirs)
    for missing in agent.missing_files:
        searched = ", ".join(map(str, folders))
        reasons = ((path, why_unreadable(path)) for path in (folder / missing.name for folder in folders))
        unreadable = next((f"{path} {why}" for path, why in reasons if why != ABSENT), "")
        # The user more likely means an unreadable file of this name than a file with a similar name.
        hint = unreadable or did_you_mean(missing.name, _files(folders), f"searched: {searched}")
        yield Finding(MISSING, missing.place, f"there is no file {missing.name}", hint)
    for requested in agent.requested_files:
        core_file = agent.context.paths.cx / requested.name
        candidates = (folder / requested.name for folder in agent.context.paths.clips_dirs)
        hidden_file = next((path for path in candidates if path.is_file()), None)
        if hidden_file is not None and core_file.is_file() and not hidden_file.samefile(core_file):
            message = f"{requested.name} is the core's file, not {hidden_file}"
            yield Finding(SHADOWED, requested.place, message, "give the file of the agent another name")


def _files(folders: tuple[Path, ...]) -> set[str]:
    """Return the names of the CLIPS files in the folders."""
    return {
        str(path.relative_to(folder))
        for folder in folders
        if folder.is_dir()
        for pattern in ("*.clp", "*/*.clp")
        for path in folder.glob(pattern)
    }
