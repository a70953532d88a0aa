"""A run put together: configuration, clock, blackboard, skiller, executive, recorders.

:func:`run_scenario` is the function of ``cxbridge run``; :class:`Run` is the parts, for programs that drive
    the
loop themselves. The package can be called, too: ``cxbridge.run("test-scenario")`` runs a scenario for a
program, see :func:`cxbridge.run.program.run.run`.
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

_MODULES = {"Run": "agent", "RunOptions": "options", "RunResult": "result", "run_scenario": "run"}


def __getattr__(name: str) -> Any:
    """Give a public name: the help of a command needs the options of runs, and nothing else of them."""
    from importlib import import_module  # noqa: PLC0415 - importing the package alone costs nothing

    if name not in _MODULES:
        raise AttributeError(f"module '{__name__}' has no attribute '{name}'")
    return getattr(import_module(f"{__name__}.{_MODULES[name]}"), name)


class _CallablePackage(ModuleType):
    """A package that programs call, and import from."""

    def __call__(self, *args: Any, **options: Any) -> Any:
        """Run a scenario; see :func:`cxbridge.run.program.run.run`."""
        from cxbridge.run.program.run import run  # noqa: PLC0415 - the command line has no need of it

        return run(*args, **options)


sys.modules[__name__].__class__ = _CallablePackage
