"""The time that the model of an agent needs: for all its files, and when one of them changes.

The files are those of the RCLL agent and of the core of a Fawkes checkout. Each CLIPS file gets one more
condition in its last rule, as if somebody typed; three times, the fastest counts. A question is asked for
each template that is defined: where is it mentioned?

    FAWKES_DIR=/path/to/fawkes ROBOTINO_DIR=/path/to/fawkes-robotino python -m benchmarks.agent_model
"""

from __future__ import annotations

import os
import sys
import time
from collections.abc import Callable
from functools import partial
from pathlib import Path

from cxbridge_studio.agent.model import AgentModel
from cxbridge_studio.agent.names import Name, NameKind

ROUNDS = 3
_FOLDERS = {"ROBOTINO_DIR": "src/clips-specs/**/*.clp", "FAWKES_DIR": "src/plugins/**/*.clp"}


def milliseconds(work: Callable[[], object]) -> float:
    """Return how long some work takes."""
    begin = time.perf_counter()
    work()
    return (time.perf_counter() - begin) * 1000


def _count(model: AgentModel, name: Name) -> int:
    return sum(1 for _ in model.mentions(name))


def main() -> int:
    """Measure and print."""
    if any(name not in os.environ for name in _FOLDERS):
        print("FAWKES_DIR and ROBOTINO_DIR must name checkouts")
        return 2
    paths = [path for name, glob in _FOLDERS.items() for path in sorted(Path(os.environ[name]).glob(glob))]
    model = AgentModel()
    whole = milliseconds(lambda: [model.read(path) for path in paths])
    print(f"{len(paths)} files, all new: {whole:.0f} ms")
    changes = {}
    for file in model.files:
        head, rule, rest = file.text.rpartition("(defrule ")
        changed = head + rule + rest.replace("=>", "(typed ?here)\n  =>", 1)
        times = []
        for _ in range(ROUNDS):
            times.append(milliseconds(partial(model.update, file.path, changed)))
            model.update(file.path, file.text)
        changes[file.path] = min(times)
    slowest = max(changes, key=changes.__getitem__)
    print(f"a file changed: {sum(changes.values()) / len(changes):.1f} ms on average, ", end="")
    print(f"at most {changes[slowest]:.1f} ms ({Path(slowest).name})")
    names = {found.mention.name for found in model.defined(NameKind.TEMPLATE)}
    asked = [milliseconds(partial(_count, model, name)) for name in names]
    print(
        f"all mentions of a template: {sum(asked) / len(asked):.1f} ms on average, {max(asked):.1f} at most"
    )
    return 0


if __name__ == "__main__":
    sys.exit(main())
