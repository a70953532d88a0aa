"""Misspells each name in the CLIPS files of shipped scenarios, one at a time: does the check find it?

``python -m studio_tests.check.mutations [-v] SCENARIO...`` prints how many of each kind are found, and
with ``-v`` the missed ones. A scenario has no finding, so any finding is right. The findings of a run are not
measured here.
"""

from __future__ import annotations

import shutil
import sys
import tempfile
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from cxbridge.clipstext.syntax import TOKEN
from cxbridge.run import RunOptions
from cxbridge_studio.agent.clips import read_clips
from cxbridge_studio.agent.names import NameKind, SourceFile, Use
from cxbridge_studio.check.run import check
from tests.support import ROOT

MODES: Final = frozenset(
    {
        *("FORMULATED", "SELECTED", "EXPANDED", "COMMITTED"),
        *("DISPATCHED", "FINISHED", "EVALUATED", "RETRACTED"),
    }
)
_KINDS: Final = {
    *(NameKind.TEMPLATE, NameKind.SLOT, NameKind.FUNCTION, NameKind.GLOBAL, NameKind.GOAL_CLASS),
    *(NameKind.ACTION, NameKind.PREDICATE, NameKind.OBJECT_TYPE, NameKind.PARAMETER, NameKind.FILE),
}
_STANDARD: Final = frozenset({"assert", "modify", "retract", "printout"})


@dataclass(frozen=True)
class Mutation:
    """A name that is misspelt.

    :param end: where a letter is put in.
    """

    kind: str
    end: int
    line: int
    text: str


def mutations(file: SourceFile) -> Iterator[Mutation]:
    """Yield a mutation for each name of a file."""
    for mention in file.mentions:
        kind = mention.name.kind
        if kind in _KINDS and mention.name.text not in _STANDARD and mention.end > mention.start:
            what = f"{kind}, {'defined' if mention.use is Use.DEFINED else 'used'}"
            end = mention.end - (file.text[mention.end - 1] == "*" and kind is NameKind.GLOBAL)
            yield Mutation(what, end, file.lines.at(mention.start), mention.name.text)
    for match in TOKEN.finditer(file.text):
        if match.group() in MODES:
            yield Mutation("goal mode", match.end(), file.lines.at(match.start()), match.group())


def is_found(scenario: Path, file: Path, mutation: Mutation) -> bool:
    """Whether the check has a finding for a scenario with a name misspelt."""
    with tempfile.TemporaryDirectory() as folder:
        copy = Path(folder, scenario.name)
        shutil.copytree(scenario, copy, ignore=shutil.ignore_patterns("__pycache__"))
        text = file.read_text()
        (copy / file.name).write_text(f"{text[: mutation.end]}x{text[mutation.end :]}")
        return bool(check(RunOptions(scenario=copy)))


def main() -> None:
    """Print the figures of the scenarios that the command line names."""
    verbose = "-v" in sys.argv
    total, found = Counter[str](), Counter[str]()
    for name in [word for word in sys.argv[1:] if word != "-v"]:
        scenario = ROOT / "scenarios" / name
        for file in sorted(scenario.glob("*.clp")):
            for mutation in mutations(read_clips(str(file), file.read_text())):
                total[mutation.kind] += 1
                if is_found(scenario, file, mutation):
                    found[mutation.kind] += 1
                elif verbose:
                    sys.stdout.write(f"{file.name}:{mutation.line}: {mutation.kind}: {mutation.text}\n")
    for kind, number in sorted(total.items()):
        sys.stdout.write(f"{kind}: {found[kind]} of {number}\n")
    sys.stdout.write(f"all: {found.total()} of {total.total()}\n")


if __name__ == "__main__":
    main()
