"""Makes a mistake in a copy of the agent, and runs the command that has to tell it."""

from __future__ import annotations

import re
import shutil
from pathlib import Path
from subprocess import CompletedProcess
from typing import Final

from tests.forked import Nursery
from tests.mistakes.table.mistake import Mistake

AGENT: Final = Path(__file__).parent / "agent"

_RUN_SECONDS: Final = re.compile(r"; (\d+\.\d) s of the run's clock in ")


def make(mistake: Mistake, folder: Path) -> None:
    """Copy the agent to ``folder/agent``, and change it."""
    agent = folder / "agent"
    shutil.copytree(AGENT, agent)
    for edit in mistake.edits:
        file = agent / edit.file
        if edit.new is None:
            file.unlink()
            continue
        text = file.read_text()
        assert text.count(edit.old) == 1, f"{edit.file} has '{edit.old}' {text.count(edit.old)} times"
        file.write_text(text.replace(edit.old, edit.new))


def tell(mistake: Mistake, folder: Path, nursery: Nursery, timeout: float = 120) -> CompletedProcess[bytes]:
    """Make a mistake, and run its command."""
    make(mistake, folder)
    return nursery.run(mistake.command, folder=folder, timeout=timeout)


def run_seconds(output: str) -> float:
    """Return how long the clock of the run went on; 0 when there was no run."""
    match = _RUN_SECONDS.search(output)
    return float(match[1]) if match else 0.0
