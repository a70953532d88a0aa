"""Findings in Fawkes and fawkes-robotino, each judged by hand.

A judgement searches all files that the spec loads, texts and comments included, for the name of the finding.
A finding is right if only its own construct, or a comment, has the name in that role. judged.txt has the
judgements.

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
class Judgement:
    """The judgement of a finding.

    :param place: the file name and the line.
    :param reason: begins with the name in the finding, or is the mistake in the agent.
    """

    spec: str
    code: str
    place: str
    is_right: bool
    reason: str


def load_judgements() -> list[Judgement]:
    """Return the rows of the table."""
    rows = (line.split(maxsplit=4) for line in _TABLE.read_text().splitlines()[1:])
    return [Judgement(spec, code, place, word == RIGHT, reason) for spec, code, place, word, reason in rows]


SPECS: Final = tuple(dict.fromkeys(row.spec for row in load_judgements()))


def check_spec(spec: str) -> list[Finding]:
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


def list_places(findings: list[Finding]) -> Iterator[tuple[str, str]]:
    """Yield the code and the place of each finding, as in the table."""
    for finding in findings:
        yield finding.code.name, f"{Path(finding.place.file).name}:{finding.place.line}"


def main() -> None:
    """Print the numbers of findings and right findings of each agent; unjudged findings are wrong."""
    right = {
        (judgement.spec, judgement.code, judgement.place)
        for judgement in load_judgements()
        if judgement.is_right
    }
    total = right_count = 0
    for spec in SPECS:
        keys = [(spec, *key) for key in list_places(check_spec(spec))]
        total, right_count = total + len(keys), right_count + sum(key in right for key in keys)
        sys.stdout.write(f"{spec}: {len(keys)} findings, {sum(key in right for key in keys)} right\n")
    sys.stdout.write(f"all: {total} findings, {right_count} right\n")


if __name__ == "__main__":
    main()
