"""Reads public PDDL, and holds the answers against those of VAL's parser.

    python benchmarks/pddl_corpora.py FOLDER... [--val Parser] [--each 5]

A folder may hold checkouts of potassco/pddl-instances and AI-Planning/classical-domains, of planners, or
of agents: domains and problems are found by their contents, and by the numbers in their names. VAL's
program ``Parser`` is built by ``cmake`` and ``make Parser`` from KCL-Planning/VAL. Folders that are absent
are skipped.
"""

from __future__ import annotations

import argparse
import re
import subprocess
import sys
import time
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

from cxbridge.errors import PddlError
from cxbridge.executive.pddl import load_domain, load_problem

_DEFINED = re.compile(rb"^\s*\(\s*define\s*\(\s*(domain|problem)\b", re.IGNORECASE)
_COMMENT = re.compile(rb";[^\n]*")
_VAL_RESULT = re.compile(r"Errors: (\d+), warnings: (\d+)")
_UNSUPPORTED = "not supported"
_HEAD = 20_000


class Pair(NamedTuple):
    """A problem with its domain."""

    domain: Path
    problem: Path


def pairs_in(folder: Path, each: int) -> Iterator[Pair]:
    """Yield the pairs below a folder, at most ``each`` of those that lie together, from small to large."""
    kinds: dict[Path, dict[str, list[Path]]] = {}
    for path in sorted(folder.rglob("*.pddl")):
        found = _DEFINED.match(_COMMENT.sub(b"", path.read_bytes()[:_HEAD]))
        if found:
            home = path.parent.parent if path.parent.name in ("instances", "domains") else path.parent
            kinds.setdefault(home, {}).setdefault(found[1].decode().lower(), []).append(path)
    for home, files in kinds.items():
        domains = files.get("domain", []) or kinds.get(home.parent, {}).get("domain", [])
        found_pairs = [
            Pair(domain, problem)
            for problem in files.get("problem", [])
            for domain in _domain(problem, domains)
        ]
        found_pairs.sort(key=lambda pair: _numbers(pair.problem))
        step = max(1, len(found_pairs) // each) if each else 1
        yield from found_pairs[::step]


def _domain(problem: Path, domains: list[Path]) -> list[Path]:
    """Return the domain of a problem among those of its folder: the only one, or the one of its number."""
    if len(domains) == 1:
        return domains
    key = _numbers(problem)
    same = [each for each in domains if _numbers(each) and _numbers(each) == key[: len(_numbers(each))]]
    return same[:1] or [each for each in domains if each.name == "domain.pddl"][:1]


def _numbers(path: Path) -> tuple[int, ...]:
    return tuple(map(int, re.findall(r"\d+", path.stem)))


def val_accepts(parser: str, pair: Pair) -> bool:
    """Return whether VAL reads a pair without an error."""
    done = subprocess.run([parser, *pair], capture_output=True, check=False, timeout=300)
    found = _VAL_RESULT.search(done.stdout.decode(errors="replace"))
    return done.returncode == 0 and found is not None and found[1] == "0"


def main() -> int:
    """Print the pairs that VAL reads and we do not, then the numbers."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("folders", nargs="*", type=Path)
    parser.add_argument("--val", default="", help="VAL's program Parser")
    parser.add_argument("--each", type=int, default=5, help="pairs of a folder; 0: all")
    options = parser.parse_args()
    folders = [each for each in options.folders if each.is_dir()]
    if not folders:
        print("no folder with PDDL: nothing is read")
        return 0
    counts: Counter[tuple[str, bool]] = Counter()
    size = seconds = 0.0
    for pair in (pair for folder in folders for pair in pairs_in(folder, options.each)):
        start = time.process_time()
        try:
            load_problem(pair.problem, load_domain(pair.domain))
            reason = ""
        except PddlError as error:
            reason = str(error)
        seconds += time.process_time() - start
        size += sum(path.stat().st_size for path in pair)
        ours = "unsupported" if _UNSUPPORTED in reason else "refused" if reason else "read"
        accepted = val_accepts(options.val, pair) if options.val else True
        counts[ours, accepted] += 1
        if reason and (ours == "refused" or not options.val) and accepted:
            print(f"{pair.problem}: {reason.splitlines()[0]}")
    print(f"{sum(counts.values())} pairs, {size / 1e6:.1f} MB in {seconds:.1f} s of CPU")
    for (ours, accepted), number in sorted(counts.items()):
        verdict = "VAL reads" if accepted else "VAL refuses"
        print(f"{number:6} {ours:12} {verdict if options.val else ''}")
    return int(counts["refused", True] > 0)


if __name__ == "__main__":
    sys.exit(main())
