"""The known planning programs: location, command line, and output format."""

from __future__ import annotations

import re
import shutil
from importlib.util import find_spec
from pathlib import Path
from typing import Final

from cxbridge.extras import pip_command
from cxbridge.spawning import python_command
from cxbridge_planning.engines.engine import Engine
from cxbridge_planning.needs import CLASSICAL, Need

# The steps of plans as FF, Fast Downward and temporal planners print them: ``0: MOVE R1 A B``,
# ``move r1 a b (1)`` and ``0.000: (move r1 a b) [4.000]``.
_FF_STEP: Final = re.compile(r"^\s*(?:step\s+)?\d+:\s+(?P<step>[^\s(].*?)\s*$", re.MULTILINE)
_FD_STEP: Final = re.compile(r"^(?P<step>[a-z0-9][^\n]*?) \(\d+\)\s*$", re.MULTILINE)
_TIMED_STEP: Final = re.compile(
    r"^\s*(?P<start>[\d.]+):\s*\((?P<step>[^)]+)\)\s*\[(?P<duration>[\d.]+)\]", re.MULTILINE
)
_PYTHON: Final = "python"
# Starts Fast Downward's driver with its folder on the import path: the option -P of python_command excludes
# the folder.
_DRIVER: Final = "import sys; sys.path.insert(0, sys.argv.pop(1)); from driver.main import main; main()"

_NO_OUTPUT: Final = re.compile(r"(?!)")  # matches nothing
# Fast Downward's texts, and its exit codes: 10 and 11 for problems that its translator or its search finds
# unsolvable, 12 for a search that has ended without a solution
_FD_UNSOLVABLE: Final = re.compile("without finding a solution|unsolvable|search exit code: 1[0-2]")


class PlannerProgram(Engine, frozen=True):
    """The command line and output format of a program.

    :param command_words: the command, program first; ``{folder}`` is the folder of its package,
        :data:`_PYTHON` the current Python.
    :param arguments: the arguments of the program; ``{domain}`` and ``{problem}`` are files, ``{plan}`` is
        the prefix of plan files.
    :param unsolvable_output: the output of a program that reports that no plan exists.
    :param step_pattern: the pattern of a printed step, with the groups ``step`` and optionally ``start`` and
        ``duration``; None if the program writes plan files.
    :param plan_heading: the text that the program prints before a plan.
    :param no_plan_text: a text in a plan file without a plan.
    :param improving_arguments: the arguments of a search for better plans for ``{improve}`` seconds; empty if
        unsupported.
    :param has_times: whether plans with durative actions have times.
    :param package: the package that contains the program; empty if it is on the PATH.
    :param module: the module of that package.
    :param default_options: the additional options unless the user gives options.
    """

    command_words: tuple[str, ...]
    arguments: tuple[str, ...]
    unsolvable_output: re.Pattern[str] = _NO_OUTPUT
    step_pattern: re.Pattern[str] | None = None
    plan_heading: str = ""
    no_plan_text: str = ""
    improving_arguments: tuple[str, ...] = ()
    has_times: bool = False
    package: str = ""
    module: str = ""
    default_options: str = ""

    def explain_missing(self, user_program: str) -> str:
        """Return the command that installs a missing package, or a sentence about a program not on the PATH.

        The text is empty if the program is installed.

        :param user_program: the program of the user's options; empty for the usual program.
        """
        if self.package and not user_program and find_spec(self.module) is None:
            return pip_command(self.package)
        program = self.command(user_program)[0]
        return "" if shutil.which(program) else f"there is no program '{program}' on the PATH"

    def command(self, user_program: str) -> list[str]:
        """Return the command without its arguments.

        :param user_program: the program of the user's options; empty for the usual program.
        """
        if user_program:
            return [user_program]
        spec = find_spec(self.module) if self.module else None
        folder = "" if spec is None or spec.origin is None else str(Path(spec.origin).parent)
        words = [word.format(folder=folder) for word in self.command_words if word != _PYTHON]
        return python_command(*words) if _PYTHON in self.command_words else words


_NUMERIC_NEEDS: Final = frozenset({Need.COSTS, Need.NUMERIC_CHANGES, Need.NUMBERS, Need.FRACTIONS})
_POPF_NEEDS: Final = _NUMERIC_NEEDS | {Need.HIERARCHY, Need.TIME, Need.EQUALITY}
_TASK_FILES: Final = ("{domain}", "{problem}")
_TASK_OPTIONS: Final = ("-o", "{domain}", "-f", "{problem}")
# as in the package up-enhsp: the first plan of a greedy search, and no makespan (-npm) between the steps
_ENHSP_ARGUMENTS: Final = (*_TASK_OPTIONS, "-sp", "{plan}", "-npm", "-h", "hadd", "-s", "gbfs")
# any fixed seed makes a local search repeatable
_LPG_ARGUMENTS: Final = (*_TASK_OPTIONS, "-seed", "2004", "-out", "{plan}")

# The programs by name; `ff`, `fd` and `popf` are names from Fawkes' configuration.
PROGRAMS: Final = {
    "fast-downward": PlannerProgram(
        (_PYTHON, "-c", _DRIVER, "{folder}/downward"),
        ("--plan-file", "{plan}", "--alias", "lama-first", *_TASK_FILES),  # the first iteration of LAMA
        understands=CLASSICAL | {Need.COSTS},
        unsolvable_output=_FD_UNSOLVABLE,
        improving_arguments=(
            *("--plan-file", "{plan}", "--search-time-limit", "{improve}"),
            *("--alias", "seq-sat-lama-2011", *_TASK_FILES),
        ),
        package="up-fast-downward",
        module="up_fast_downward",
    ),
    "enhsp": PlannerProgram(
        ("java", "-jar", "{folder}/ENHSP/enhsp.jar"),
        _ENHSP_ARGUMENTS,
        understands=CLASSICAL | _NUMERIC_NEEDS,
        unsolvable_output=re.compile(
            "Problem unsolvable|Problem Detected as Unsolvable|Unsolvable Problem", re.IGNORECASE
        ),
        improving_arguments=(*_ENHSP_ARGUMENTS, "-anytime", "-timeout", "{improve}"),
        # ENHSP wrongly reports settlers (IPC 2002) as unsolvable
        proves=False,
        package="up-enhsp",
        module="up_enhsp",
    ),
    "lpg": PlannerProgram(
        ("{folder}/lpg",),
        (*_LPG_ARGUMENTS, "-n", "1"),
        understands=(CLASSICAL - {Need.CONDITIONAL_EFFECTS}) | _NUMERIC_NEEDS | {Need.TIME},
        # a local search detects unreachable goals only, and proves nothing else
        unsolvable_output=re.compile(
            "goals of the problem are not reachable|Goals not reachable", re.IGNORECASE
        ),
        no_plan_text="no solution",
        # -n is the number of plans: far more than the time suffices for
        improving_arguments=(*_LPG_ARGUMENTS, "-n", "100", "-cputime", "{improve}"),
        has_times=True,
        proves=False,
        package="up-lpg",
        module="up_lpg",
    ),
    "ff": PlannerProgram(
        ("ff",),
        _TASK_OPTIONS,
        understands=CLASSICAL,
        unsolvable_output=re.compile("simplified to FALSE|unsolvable|No plan will solve it"),
        step_pattern=_FF_STEP,
        plan_heading="found legal plan as follows",
        ignores=frozenset({Need.COSTS}),
    ),
    "fd": PlannerProgram(
        ("fast-downward",),
        _TASK_FILES,
        understands=CLASSICAL | {Need.COSTS},
        unsolvable_output=_FD_UNSOLVABLE,
        step_pattern=_FD_STEP,
        plan_heading="Solution found",
        default_options='--search "lazy_greedy([ff()], preferred=[ff()])"',
    ),
    "popf": PlannerProgram(
        ("popf",),
        _TASK_FILES,
        understands=_POPF_NEEDS,
        unsolvable_output=re.compile("unsolvable"),
        step_pattern=_TIMED_STEP,
        plan_heading="Solution Found",
        has_times=True,
    ),
    "optic": PlannerProgram(
        ("optic-clp",),
        _TASK_FILES,
        understands=_POPF_NEEDS,
        unsolvable_output=re.compile("unsolvable"),
        step_pattern=_TIMED_STEP,
        plan_heading="Solution Found",
        has_times=True,
    ),
}
