"""Makes a debugged run from the launch configuration that an editor sends."""

from __future__ import annotations

import os
from collections.abc import Mapping
from typing import Any, Final

import msgspec

from cxbridge.errors import CxbridgeError
from cxbridge.run.program.plain_options import options_from_json
from cxbridge_studio.dap.debugged_run import DebuggedRun
from cxbridge_studio.dap.protocol import LaunchRequestArguments

# the keys of a launch configuration that are for the editors themselves
_EDITOR_KEYS: Final = frozenset(
    {
        *("type", "request", "name", "console", "debugServer", "internalConsoleOptions"),
        *("order", "postDebugTask", "preLaunchTask", "presentation", "serverReadyAction"),
        *("linux", "osx", "windows", "suppressMultipleSessionWarning"),
    }
)


def make_debugged_run(arguments: Mapping[str, Any]) -> DebuggedRun:
    """Change to the folder ``cwd`` of a launch configuration, and return the run.

    :param arguments: ``scenario`` and the options of ``cxbridge run``, as ``skillDirs`` or ``skill-dirs``,
        and :class:`LaunchRequestArguments`.
    :raises CxbridgeError: if the options are invalid, or there is no such folder.
    :raises msgspec.ValidationError: if a setting has a wrong type.
    """
    settings = msgspec.convert(arguments, LaunchRequestArguments)
    # VS Code adds keys for itself that begin with `__`, such as `__sessionId`.
    run_arguments = {
        name: value
        for name, value in arguments.items()
        if not name.startswith("__")
        and name not in _EDITOR_KEYS.union(LaunchRequestArguments.__struct_encode_fields__)
    }
    if "replay" in run_arguments:
        raise CxbridgeError("a replay cannot be debugged", hint="debug the scenario that was recorded")
    try:
        os.chdir(settings.cwd or ".")
    except OSError as error:
        raise CxbridgeError(f"'cwd' cannot be {settings.cwd}: {error.strerror}") from error
    return DebuggedRun(
        options_from_json(run_arguments),
        stop_on_entry=settings.stop_on_entry and not settings.no_debug,
        can_stop_at_actions=settings.stop_in_rules and not settings.no_debug,
    )
