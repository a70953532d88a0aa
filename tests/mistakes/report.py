"""Prints what a new user sees of each mistake, and how long it takes: ``python -m tests.mistakes.report``."""

from __future__ import annotations

import sys
import tempfile
import time
from pathlib import Path

from cxbridge.cli.console import say_text as say
from tests.forked import Nursery
from tests.mistakes.making import tell
from tests.mistakes.table import MISTAKES

_PATIENCE_S = 60.0


def main(kinds: list[str]) -> None:
    """Print it for these kinds of mistakes, or for all."""
    slowest, count = 0.0, 0
    with Nursery() as nursery:
        for kind, mistakes in MISTAKES.items():
            for mistake in mistakes if not kinds or kind in kinds else ():
                with tempfile.TemporaryDirectory(prefix="cxbridge-mistakes-") as folder:
                    begun = time.perf_counter()
                    try:
                        done = tell(mistake, Path(folder), nursery, _PATIENCE_S)
                    except TimeoutError:
                        say(f"\n### {kind}: {mistake.name}\nNO END")
                        continue
                    seconds = time.perf_counter() - begun
                slowest, count = max(slowest, seconds), count + 1
                text = (done.stdout + done.stderr).decode().replace(f"{folder}/", "").rstrip()
                mark = "" if done.returncode == mistake.status else f" (not {mistake.status})"
                say(f"\n### {kind}: {mistake.name}; status {done.returncode}{mark}, {seconds:.2f} s\n{text}")
    say(f"\n{count} mistakes, the slowest took {slowest:.2f} s")


if __name__ == "__main__":
    main(sys.argv[1:])
