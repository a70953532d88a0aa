"""Coverage-guided fuzzing: ``python -m fuzz TARGET CORPUS [options]``; fuzz/targets.py has the targets.

The options are those of libFuzzer. The fuzzer needs atheris, which is no dependency of the project.
"""

from __future__ import annotations

import sys
from pathlib import Path

# users install atheris themselves, so mypy may find it or not
import atheris  # type: ignore[import-not-found, import-untyped, unused-ignore]


def main() -> None:
    """Fuzz until an interrupt or a failure."""
    with atheris.instrument_imports(include=["cxbridge", "cxbridge_fawkes", "rosbags"]):
        from fuzz.ros2 import ros2_cdr  # noqa: PLC0415 - atheris instruments these imports
        from fuzz.seeds import write_seeds  # noqa: PLC0415
        from fuzz.skills import timed_skill_strings  # noqa: PLC0415
        from fuzz.targets import TARGETS  # noqa: PLC0415
    targets = TARGETS | {"skill-strings": timed_skill_strings, "ros2-cdr": ros2_cdr}
    arguments = sys.argv[1:]
    if len(arguments) < 2 or arguments[0] not in targets:  # noqa: PLR2004 - target and corpus
        sys.exit(__doc__)
    name, corpus, *options = arguments
    if not Path(corpus).is_dir() or not any(Path(corpus).iterdir()):
        write_seeds(name, Path(corpus))
    atheris.Setup([sys.argv[0], *options, corpus], targets[name])
    atheris.Fuzz()


if __name__ == "__main__":
    main()
