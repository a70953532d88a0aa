"""Findings on trees that we did not write, each judged by hand.

A finding is judged by a search for its name in all files that the spec loads, texts and comments
included. It is right when the agent is wrong there: nothing but its own construct, or a comment, has the name
in that role. The judgements are in judged.txt.

FAWKES_DIR and ROBOTINO_DIR name the trees: Fawkes at 649cec08, fawkes-robotino at c3c517ac.
"""

from __future__ import annotations

import sys
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from cxbridge.run import RunOptions
from cxbridge_studio.check.findings import Finding
from cxbridge_studio.check.run import check
from tests.support import FAWKES_DIR, ROBOTINO_DIR

RIGHT: Final = "right"

_TABLE: Final = Path(__file__).with_suffix(".txt")


@dataclass(frozen=True)
class Judged:
    """A finding that was judged.

    :param place: name of the file, and line.
    :param reason: a name first, where the finding has one; or the mistake in the agent.
    """

    spec: str
    code: str
    place: str
    is_right: bool
    reason: str


def judged() -> list[Judged]:
    """Return the table."""
    rows = (line.split(maxsplit=4) for line in _TABLE.read_text().splitlines()[1:])
    return [Judged(spec, code, place, word == RIGHT, why) for spec, code, place, word, why in rows]


SPECS: Final = tuple(dict.fromkeys(each.spec for each in judged()))


def found(spec: str) -> list[Finding]:
    """Return the findings of the check in an agent of Fawkes or of the RoboCup Logistics League."""
    assert FAWKES_DIR is not None
    if not spec.startswith("rcll"):
        return check(RunOptions(fawkes_dir=FAWKES_DIR, spec=spec))
    assert ROBOTINO_DIR is not None
    with tempfile.TemporaryDirectory() as folder:
        overlay = Path(folder, "overlay.yaml")
        overlay.write_text(f"clips-protobuf:\n  proto-dirs: ['{ROBOTINO_DIR}/src/agents/llsf2013/msgs']\n")
        return check(
            RunOptions(
                scenario=ROBOTINO_DIR / "cfg",
                fawkes_dir=FAWKES_DIR,
                spec=spec,
                config=overlay,
                clips_dirs=(ROBOTINO_DIR / "src/clips-specs",),
                interface_dirs=(
                    ROBOTINO_DIR / "src/libs/interfaces",
                    *sorted(ROBOTINO_DIR.glob("src/plugins/*/interfaces")),
                ),
                skiller="none",
            )
        )


def places(findings: list[Finding]) -> Iterator[tuple[str, str]]:
    """Yield code and place of findings, as the table has them."""
    for each in findings:
        yield each.code.name, f"{Path(each.place.file).name}:{each.place.line}"


def main() -> None:
    """Print the findings in each agent and the share of right ones; unjudged ones count as wrong."""
    right = {(each.spec, each.code, each.place) for each in judged() if each.is_right}
    total = good = 0
    for spec in SPECS:
        keys = [(spec, *key) for key in places(found(spec))]
        total, good = total + len(keys), good + sum(key in right for key in keys)
        sys.stdout.write(f"{spec}: {len(keys)} findings, {sum(key in right for key in keys)} right\n")
    sys.stdout.write(f"all: {total} findings, {good} right\n")


if __name__ == "__main__":
    main()
