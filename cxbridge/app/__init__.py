"""A run put together: configuration, clock, blackboard, skiller, executive, recorders.

:func:`run_scenario` is what ``cxbridge run`` calls; :class:`Assembly` is the parts, for those who drive the
loop themselves.
"""

from cxbridge.app.assembly import Assembly
from cxbridge.app.options import RunOptions
from cxbridge.app.result import RunResult
from cxbridge.app.run import run_scenario

__all__ = ["Assembly", "RunOptions", "RunResult", "run_scenario"]
