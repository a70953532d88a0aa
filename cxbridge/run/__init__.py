"""A run put together: configuration, clock, blackboard, skiller, executive, recorders.

:func:`run_scenario` is what ``cxbridge run`` calls; :class:`Assembly` is the parts, for those who drive the
loop themselves.
"""

from cxbridge.run.assembly import Assembly
from cxbridge.run.options import RunOptions
from cxbridge.run.result import RunResult
from cxbridge.run.run import run_scenario

__all__ = ["Assembly", "RunOptions", "RunResult", "run_scenario"]
