"""Checks for missing files, and for files that the core hides."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Final

from cxbridge.file_access import ABSENT, why_unreadable
from cxbridge.suggestions import did_you_mean
from cxbridge_studio.check.agent import Agent
from cxbridge_studio.check.findings import Code, Finding, Severity

MISSING_FILE: Final = Code(
    "CX102",
    Severity.ERROR,
    "a file is missing",
    "The spec, or a CLIPS file, loads a file that none of the folders contains, or that you may not read. "
    "The executive continues without the file: its rules do not exist, and goals wait forever.",
)

SHADOWED_FILE: Final = Code(
    "CX103",
    Severity.WARNING,
    "a file of the core hides one of the agent",
    "The core's folder is searched first. A file of the agent that has the name of a core file is never "
    "loaded.",
)

CODES: Final = (MISSING_FILE, SHADOWED_FILE)


def check(agent: Agent) -> Iterator[Finding]:
    """Yield the missing files and the hidden files."""
    folders = agent.context.paths.rule_dirs
    for missing_file in agent.missing_files:
        paths = [folder / missing_file.name for folder in folders]
        problems = (f"{path} {reason}" for path in paths if (reason := why_unreadable(path)) != ABSENT)
        # The user more likely means an unreadable file of this name than a file of a similar name.
        hint = next(problems, "") or did_you_mean(
            missing_file.name, _find_clips_files(folders), f"searched: {', '.join(map(str, folders))}"
        )
        yield Finding(MISSING_FILE, missing_file.place, f"there is no file {missing_file.name}", hint)
    for requested_file in agent.requested_files:
        core_file = agent.context.paths.core_dir / requested_file.name
        candidates = (folder / requested_file.name for folder in agent.context.paths.clips_dirs)
        hidden_file = next((path for path in candidates if path.is_file()), None)
        if hidden_file is not None and core_file.is_file() and not hidden_file.samefile(core_file):
            yield Finding(
                SHADOWED_FILE,
                requested_file.place,
                f"{requested_file.name} is the core's file, not {hidden_file}",
                "give the file of the agent another name",
            )


def _find_clips_files(folders: tuple[Path, ...]) -> set[str]:
    """Return the names of the CLIPS files in the folders and their direct subfolders, as in specs."""
    return {
        str(path.relative_to(folder))
        for folder in folders
        if folder.is_dir()
        for pattern in ("*.clp", "*/*.clp")
        for path in folder.glob(pattern)
    }
