"""Planners that are programs: FF, Fast Downward, POPF and OPTIC, found on the PATH, as Fawkes calls them."""

from __future__ import annotations

import re
import shlex
import shutil
import subprocess
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Final, NamedTuple

from cxbridge.executive.pddl import Domain, Problem, format_domain, format_problem
from cxbridge.executive.planning.engines.names import PlanNames
from cxbridge.executive.planning.engines.needs import CLASSICAL, Need
from cxbridge.executive.planning.errors import PlanningError
from cxbridge.executive.planning.planner import PlannedAction, Planner

_STEP: Final = re.compile(r"^\s*(?:step\s+)?\d+:\s+(?P<step>[^\s(].*?)\s*$", re.MULTILINE)
_FD_STEP: Final = re.compile(r"^(?P<step>[a-z0-9][^\n]*?) \(\d+\)\s*$", re.MULTILINE)
_TIMED: Final = re.compile(
    r"^\s*(?P<start>[\d.]+):\s*\((?P<step>[^)]+)\)\s*\[(?P<duration>[\d.]+)\]", re.MULTILINE
)


class PlannerCommand(NamedTuple):
    """How to call a program and read its answer.

    :param arguments: its arguments; ``{domain}`` and ``{problem}`` are files.
    :param solved: what it prints when there is a plan.
    :param unsolvable: what it prints when it knows that there is none.
    :param step: a step of the plan: ``step``, perhaps ``start`` and ``duration``.
    """

    program: str
    arguments: tuple[str, ...]
    solved: str
    unsolvable: re.Pattern[str]
    step: re.Pattern[str]
    understands: frozenset[Need]


_POPF_NEEDS: Final = frozenset({Need.TIME, Need.NUMBERS, Need.COSTS, Need.EQUALITY})

COMMANDS: Final = {
    "ff": PlannerCommand(
        "ff",
        ("-o", "{domain}", "-f", "{problem}"),
        "found legal plan as follows",
        re.compile("simplified to FALSE|unsolvable|No plan will solve it"),
        _STEP,
        CLASSICAL - {Need.COSTS},
    ),
    "fd": PlannerCommand(
        "fast-downward",
        ("{domain}", "{problem}"),
        "Solution found",
        re.compile("without finding a solution|unsolvable"),
        _FD_STEP,
        CLASSICAL,
    ),
    "popf": PlannerCommand(
        "popf", ("{domain}", "{problem}"), "Solution Found", re.compile("unsolvable"), _TIMED, _POPF_NEEDS
    ),
    "optic": PlannerCommand(
        "optic-clp",
        ("{domain}", "{problem}"),
        "Solution Found",
        re.compile("unsolvable"),
        _TIMED,
        _POPF_NEEDS,
    ),
}
"""The programs by the names that Fawkes' configuration has for them."""

_FD_SEARCH: Final = '--search "lazy_greedy([ff()], preferred=[ff()])"'


class CommandPlanner(Planner):
    """A planner that is a program.

    :param name: one of :data:`COMMANDS`.
    :param options: further options, as on a command line.
    :param program: the program, when it is not the one of that name on the PATH.
    """

    def __init__(self, name: str, options: str = "", program: str = "") -> None:
        self.name = name
        self._command = COMMANDS[name]
        self._options = shlex.split(options or (_FD_SEARCH if name == "fd" else ""))
        self._program = program or self._command.program
        self.understands = self._command.understands

    @property
    def not_installed(self) -> str:
        """Why the program cannot be called; empty when it can."""
        if shutil.which(self._program) is None:
            return f"{self.name} is not installed: there is no program '{self._program}' on the PATH"
        return ""

    def solve(self, domain: Domain, problem: Problem) -> tuple[PlannedAction, ...] | None:
        """Return a plan; None when the program says that there is none."""
        with tempfile.TemporaryDirectory(prefix="cxbridge-plan-") as folder:
            files = {"domain": Path(folder, "domain.pddl"), "problem": Path(folder, "problem.pddl")}
            files["domain"].write_text(format_domain(domain))
            files["problem"].write_text(format_problem(problem))
            arguments = [each.format(**files) for each in self._command.arguments]
            try:
                done = subprocess.run(  # noqa: S603  no shell, the user's own program
                    [self._program, *arguments, *self._options],
                    cwd=folder,
                    capture_output=True,
                    check=False,
                    stdin=subprocess.DEVNULL,
                )
            except OSError as error:
                raise PlanningError(f"cannot start {self._program}: {error.strerror}") from error
        output = done.stdout.decode(errors="replace")
        if self._command.solved in output:
            return tuple(self._steps(output.split(self._command.solved, 1)[1], PlanNames(domain, problem)))
        if self._command.unsolvable.search(output):
            return None
        last = (output + done.stderr.decode(errors="replace")).strip()[-300:]
        raise PlanningError(
            f"{self._program} ended with exit status {done.returncode} and without a plan: {last}"
        )

    def _steps(self, output: str, names: PlanNames) -> Iterator[PlannedAction]:
        for match in self._command.step.finditer(output):
            name, *arguments = match["step"].split()
            if name.upper() == "REACH-GOAL":
                continue  # FF's own last step
            times = {key: float(value) for key, value in match.groupdict().items() if key != "step"}
            yield names.step(name, arguments, **times)
