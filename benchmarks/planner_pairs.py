"""Plans public pairs of domain and problem with `auto`, and with each engine after failures of `auto`.

``python -m benchmarks.planner_pairs FOLDER... [--most 1] [--draw 80] [--engines] [--validate PROGRAM]``

A pair is a problem and the file of its domain. That file defines the domain that the problem names, and is in
the folder of the problem, in the folder above, or in the folder ``domains`` there. PROGRAM is VAL's
``Validate``. The output is a line of JSON for each pair, then the table of docs/planning.md. The table has a
row for each kind of needs: the number of pairs, how many of the pairs are read, how many get a plan, the
engines and the median time.
With ``--draw`` the pairs are drawn at random; the same folders give the same pairs.
"""

from __future__ import annotations

import argparse
import json
import random
import re
import statistics
import subprocess
import tempfile
import time
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from cxbridge.errors import CxbridgeError
from cxbridge.executive.pddl import load_domain, load_problem
from cxbridge_planning import PlanningService, PlanRequest, PlanStatus
from cxbridge_planning.needs import Need, problem_needs
from cxbridge_planning.registry import AUTO, choose_planners

_SEED = 33  # chosen freely
_HEAD = 5000
"""The number of characters at the start of a file, without comments, among which its names are looked for."""
_DIGITS = re.compile(r"\d+")
_NAME = re.compile(r"\(\s*(domain|problem|:domain)\s+([^\s()]+)", re.IGNORECASE)


def find_pairs(folders: list[Path], most: int) -> Iterator[tuple[Path, Path]]:
    """Yield the files of domain and problem of each pair, at most ``most`` pairs of a folder."""
    for folder in folders:
        pair_counts: Counter[Path] = Counter()
        for path in sorted(folder.rglob("*.pddl"), key=_number_key):
            names = _read_names(path)
            domain = _domain_of(path, names.get(":domain", "")) if "problem" in names else None
            if domain is not None and pair_counts[path.parent] < most:
                pair_counts[path.parent] += 1
                yield domain, path


def _number_key(path: Path) -> tuple[str, list[int], str]:
    """Return a key that sorts the files of a folder by their numbers."""
    return str(path.parent), list(map(int, _DIGITS.findall(path.name))), path.name


def _read_names(path: Path) -> dict[str, str]:
    """Return the names in a PDDL file by keyword: ``domain``, ``problem``, ``:domain``."""
    text = path.read_text(errors="replace")
    return {key.lower(): name.lower() for key, name in _NAME.findall(re.sub(r";.*", "", text)[:_HEAD])}


def _domain_of(problem: Path, name: str) -> Path | None:
    """Return the file of the domain with this name for a problem; None without such a file.

    Of several files, one with the problem's number is preferred, then ``domain.pddl``.
    """
    number = _DIGITS.findall(problem.stem)
    folders = [problem.parent, problem.parent.parent, problem.parent.parent / "domains"]
    candidates = [path for folder in folders if folder.is_dir() for path in sorted(folder.glob("*.pddl"))]
    fitting = [path for path in candidates if _read_names(path).get("domain") == name and path != problem]
    # instance-5 of domain-5, p05-airport2-p1 of p05-domain
    numbered = [path for path in fitting if (own := _DIGITS.findall(path.stem)) and number[: len(own)] == own]
    plain = [path for path in fitting if path.name == "domain.pddl"]
    return next(iter(numbered or plain or fitting), None)


def classify(needs: dict[Need, str]) -> str:
    """Return the kind of a problem, which is its row in the table."""
    if Need.TIME in needs:
        return "durative actions, numbers" if Need.NUMBERS in needs else "durative actions"
    if Need.NUMBERS in needs:
        return "numbers"
    if Need.COSTS in needs:
        return "costs"
    # in this table, STRIPS includes subtypes, negative conditions and equality
    return "ADL" if needs.keys() - {Need.HIERARCHY, Need.NEGATION, Need.EQUALITY} else "STRIPS"


def measure(
    domain_file: Path, problem_file: Path, timeout: float, validate: str, *, tries_engines: bool
) -> dict[str, Any]:
    """Return the result of a pair, as the fields of its line of JSON.

    :param timeout: the time for each plan in seconds.
    :param validate: the program Validate; empty without validation.
    :param tries_engines: whether each engine plans alone if ``auto`` fails or takes too long.
    """
    row: dict[str, Any] = {"domain": str(domain_file), "problem": str(problem_file)}
    try:
        domain = load_domain(domain_file)
        problem = load_problem(problem_file, domain)
        row["kind"] = classify(problem_needs(domain, problem))
        names = [planner.name for planner in choose_planners(AUTO, domain, problem).planners]
    except (CxbridgeError, RecursionError) as error:
        return {**row, "error": str(error)}
    for name in (AUTO, *(names if tries_engines else ())):
        begin = time.monotonic()
        with PlanningService(at_once=1) as service:
            result = service.plan(PlanRequest(domain, problem, name, timeout=timeout))
        row[name] = result.status.value
        if result.status is PlanStatus.PLANNED:
            row |= {"engine": result.planner, "seconds": round(time.monotonic() - begin, 2)}
            row |= {"steps": len(result.actions), "why": result.why}
            if validate:
                text = "".join(f"{step}\n" for step in result.actions)
                row["valid"] = _validate(validate, domain_file, problem_file, text)
        else:
            row[f"{name} says"] = result.message[:400]
        if name == AUTO and result.status not in (PlanStatus.TIMEOUT, PlanStatus.FAILED):
            break  # a plan, or the proof that there is none
    return row


def _validate(program: str, domain: Path, problem: Path, plan: str) -> bool | None:
    """Return True if VAL accepts a plan, False if not, None if VAL cannot read domain or problem."""
    with tempfile.NamedTemporaryFile("w", suffix=".plan") as file:
        file.write(plan)
        file.flush()
        command = [program, "-t", "0.001", str(domain), str(problem), file.name]
        process = subprocess.run(command, capture_output=True, text=True, errors="replace", check=False)
    if "Problem in domain" in process.stdout or "Bad problem" in process.stdout:
        return None
    return "Plan valid" in process.stdout


def table_lines(rows: list[dict[str, Any]]) -> Iterator[str]:
    """Yield the lines of the table, in Markdown, for the results of pairs."""
    yield "| needs | pairs | read | planned | by `auto` | no plan | engines of `auto` | median | VAL: valid |"
    yield "| --- | --- | --- | --- | --- | --- | --- | --- | --- |"
    for kind in sorted({row.get("kind", "not read") for row in rows}):
        of_kind = [row for row in rows if row.get("kind", "not read") == kind]
        read = [row for row in of_kind if "error" not in row]
        by_auto = [row for row in read if row.get(AUTO) == "PLANNED"]
        by_any = [row for row in read if "engine" in row]
        without_plan = [row for row in read if row.get(AUTO) == "NO-PLAN"]
        engines = ", ".join(
            f"{name} {n}" for name, n in Counter(row["engine"] for row in by_auto).most_common()
        )
        median = f"{statistics.median(row['seconds'] for row in by_auto):.1f} s" if by_auto else ""
        valid = f"{sum(row.get('valid') is True for row in by_any)}"
        # a row without a plan or without validation has no `valid`
        unread = sum(row.get("valid", False) is None for row in by_any)
        valid += f", {unread} not read" if unread else ""
        cells = (
            kind,
            len(of_kind),
            len(read),
            len(by_any),
            len(by_auto),
            len(without_plan),
            engines,
            median,
            valid,
        )
        yield f"| {' | '.join(map(str, cells))} |"


def main() -> None:
    """Print the result of each pair, then the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("folders", nargs="+", type=Path)
    parser.add_argument("--most", type=int, default=1, help="pairs of a folder")
    parser.add_argument("--draw", type=int, default=0, help="the number of pairs to draw; 0: all pairs")
    parser.add_argument("--timeout", type=float, default=30.0)
    parser.add_argument("--engines", action="store_true", help="try each engine when auto has no plan")
    parser.add_argument("--validate", default="", help="VAL's program Validate")
    parser.add_argument("-o", "--output", type=Path)
    options = parser.parse_args()
    rows = []
    chosen = list(find_pairs(options.folders, options.most))
    if 0 < options.draw < len(chosen):
        chosen = random.Random(_SEED).sample(chosen, options.draw)
    for domain, problem in chosen:
        rows.append(
            measure(domain, problem, options.timeout, options.validate, tries_engines=options.engines)
        )
        print(json.dumps(rows[-1]), flush=True)
        if options.output:
            options.output.write_text("\n".join(map(json.dumps, rows)) + "\n")
    print("\n".join(table_lines(rows)))


if __name__ == "__main__":
    main()
