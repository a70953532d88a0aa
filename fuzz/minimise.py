"""Minimise a corpus: ``python -m fuzz.minimise TARGET FROM TO``, TARGET as for the fuzzer.

For each path between two lines and each magnitude of its count (1, 2 to 3, 4 to 7, ...), the shortest input
with the path is kept. The inputs in TO are candidates as well, and are deleted if they are not needed.
"""

from __future__ import annotations

import hashlib
import sys
from collections import Counter
from collections.abc import Callable
from pathlib import Path
from types import CodeType, FrameType
from typing import Any, Final

from fuzz.targets import TARGETS

_TRACED_MODULES: Final = "cxbridge"
"""The beginning of the names of traced modules, which are those of the core and of plug-ins."""

Feature = tuple[CodeType, int, int, int]
"""A piece of code, two successive lines in the code, and the magnitude of their count."""


def features_of(target: Callable[[bytes], None], data: bytes) -> set[Feature]:
    """Return the features that an input reaches."""
    paths: Counter[tuple[CodeType, int, int]] = Counter()

    def trace_call(frame: FrameType, event: str, _: Any) -> Any:
        code = frame.f_code
        if event != "call" or not frame.f_globals.get("__name__", "").startswith(_TRACED_MODULES):
            return None
        previous_line = 0

        def trace_line(frame: FrameType, event: str, _: Any) -> Any:
            nonlocal previous_line
            if event == "line":
                paths[code, previous_line, frame.f_lineno] += 1
                previous_line = frame.f_lineno
            return trace_line

        return trace_line

    sys.settrace(trace_call)
    try:
        target(data)
    finally:
        sys.settrace(None)
    # counts from 32 on have the same magnitude
    return {(*path, min(count.bit_length(), 6)) for path, count in paths.items()}


def main() -> None:
    """Write the needed inputs, and delete the rest."""
    if len(sys.argv) != 4 or sys.argv[1] not in TARGETS:  # noqa: PLR2004 - target, from, to
        sys.exit(__doc__)
    target, folder = TARGETS[sys.argv[1]], Path(sys.argv[3])
    inputs = {file.read_bytes() for source in (sys.argv[2], folder) for file in Path(source).iterdir()}
    reached: set[Feature] = set()
    needed = []
    for data in sorted(inputs, key=lambda data: (len(data), data)):
        features = features_of(target, data)
        if not features <= reached:
            reached |= features
            needed.append(data)
    for file in folder.iterdir():
        file.unlink()
    for data in needed:
        (folder / hashlib.sha1(data, usedforsecurity=False).hexdigest()).write_bytes(data)
    print(f"{len(needed)} of {len(inputs)} inputs reach all {len(reached)} features")  # noqa: T201


if __name__ == "__main__":
    main()
