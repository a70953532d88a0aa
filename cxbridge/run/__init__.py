"""Runs of agents.

:func:`run_scenario` implements ``cxbridge run``. :class:`Run` holds the parts of a run, for programs with
their own loop. The package is callable: ``cxbridge.run("test-scenario")`` calls
:func:`cxbridge.run.program.run.run`.
"""

import sys
from types import ModuleType
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from cxbridge.run.agent import Run
    from cxbridge.run.options import RunOptions
    from cxbridge.run.result import RunResult
    from cxbridge.run.run import run_scenario

__all__ = ["Run", "RunOptions", "RunResult", "run_scenario"]

_MODULES_BY_NAME = {"Run": "agent", "RunOptions": "options", "RunResult": "result", "run_scenario": "run"}


def __getattr__(name: str) -> Any:
    """Import a public name on first use."""
    if name not in _MODULES_BY_NAME:
        raise AttributeError(f"module '{__name__}' has no attribute '{name}'")
    return _import(_MODULES_BY_NAME[name], name)


def _import(module: str, name: str) -> Any:
    """Return an object of a module of this package."""
    # on first use, because the help of a command needs only the options of runs
    from importlib import import_module  # noqa: PLC0415 - importing the package alone costs nothing

    return getattr(import_module(f"{__name__}.{module}"), name)


class _CallablePackage(ModuleType):
    """The class of this package, so that ``cxbridge.run(...)`` runs a scenario."""

    def __call__(self, *args: Any, **options: Any) -> Any:
        """Run a scenario, see :func:`cxbridge.run.program.run.run`."""
        return _import("program.run", "run")(*args, **options)


sys.modules[__name__].__class__ = _CallablePackage
