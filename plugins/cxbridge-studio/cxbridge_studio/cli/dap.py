"""``cxbridge dap``: the debug adapter for editors."""

from __future__ import annotations

import os
import sys

from cxbridge.cli.console import complain
from cxbridge.cli.entry import handle_signals


@handle_signals()
def dap() -> int:
    """Speak the Debug Adapter Protocol on stdin and stdout: editors start this to debug an agent.

    The editor's launch configuration names the scenario; see docs/editors.md.

    Exit status: 0 the editor ended the session; 2 the editor sent an invalid message.

    Example: cxbridge dap
    """
    from cxbridge.interrupt import Interrupt
    from cxbridge_studio.dap.adapter import Adapter
    from cxbridge_studio.dap.wire import Wire

    # printed text goes to standard error from here on, so that it does not mix with the protocol; the source
    # is unbuffered as Wire requires
    source = os.fdopen(os.dup(sys.stdin.fileno()), "rb", buffering=0)
    with os.fdopen(os.dup(sys.stdout.fileno()), "wb") as sink:
        os.dup2(sys.stderr.fileno(), sys.stdout.fileno())
        adapter = Adapter(Wire(source, sink))
        with Interrupt(adapter.end):
            adapter.serve()
    if adapter.problem:
        complain(adapter.problem)
        return 2
    return 0
