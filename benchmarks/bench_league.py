"""A simulated RCLL game of 20 minutes: its processor time against the game's time.

Needs the checkouts of `cxbridge game` in FAWKES_DIR, ROBOTINO_DIR and REFBOX_DIR. PROTO_DIR names the folder
of the messages if the checkouts in ROBOTINO_DIR and REFBOX_DIR both lack their submodules.
"""

from __future__ import annotations

import os
import sys

from benchmarks.bench_cold import processor_seconds
from benchmarks.harness import report

MINUTES = 20


def main() -> None:
    """Measure and print."""
    options = {
        "--fawkes-dir": "FAWKES_DIR",
        "--overlay": "ROBOTINO_DIR",
        "--refbox-dir": "REFBOX_DIR",
        "--proto-dir": "PROTO_DIR",
    }
    checkouts = {option: os.environ[name] for option, name in options.items() if name in os.environ}
    if not checkouts.keys() >= options.keys() - {"--proto-dir"}:
        print("  not measured: FAWKES_DIR, ROBOTINO_DIR and REFBOX_DIR must name checkouts")
        return
    command = [sys.executable, "-m", "cxbridge", "game", "--spec", "rcll-central", "--seed", "1", "--json"]
    command += [word for item in checkouts.items() for word in item] + ["--minutes", str(MINUTES)]
    busy_seconds = processor_seconds(command, dict(os.environ))
    print(f"  {busy_seconds:.0f} s of processor time for {MINUTES} minutes")
    report("processor time of a game / its time", busy_seconds / (60 * MINUTES), limit=0.25)


if __name__ == "__main__":
    main()
