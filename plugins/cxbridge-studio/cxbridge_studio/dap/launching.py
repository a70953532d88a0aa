"""Makes a debugged run from the launch configuration that an editor sends."""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Final

from cxbridge.errors import CxbridgeError
from cxbridge.run.program.plain_options import options_from_json
from cxbridge_studio.dap.live import LiveRun

# the keys of a launch configuration that are for the editors themselves
_EDITOR_KEYS: Final = frozenset(
    {
        *("type", "request", "name", "console", "debugServer", "internalConsoleOptions", "noDebug"),
        *("order", "postDebugTask", "preLaunchTask", "presentation", "serverReadyAction"),
        *("linux", "osx", "windows", "suppressMultipleSessionWarning"),
    }
)


def make_live_run(arguments: Mapping[str, Any]) -> LiveRun:
    """Change to the folder ``cwd`` of a launch configuration, and return the run.

    :param arguments: ``scenario`` and the options of ``cxbridge run``, as ``skillDirs`` or ``skill-dirs``;
        also ``stopOnEntry``, ``stopInRules`` and ``cwd``.
    :raises CxbridgeError: if the arguments are invalid.
    """
    # VS Code adds keys for itself that begin with `__`, such as `__sessionId`.
    run_arguments = {
        name: value
        for name, value in arguments.items()
        if name not in _EDITOR_KEYS and not name.startswith("__") and value is not None
    }
    _enter_folder(_take_text(run_arguments, "cwd"))
    # from a copy: the client's arguments stay unchanged, and `run_arguments` lacks the keys of editors
    without_stops = _take_flag(dict(arguments), "noDebug", default=False)
    stop_on_entry = _take_flag(run_arguments, "stopOnEntry", default=False) and not without_stops
    stops_at_actions = _take_flag(run_arguments, "stopInRules", default=True) and not without_stops
    if "replay" in run_arguments:
        raise CxbridgeError("a replay cannot be debugged")
    return LiveRun(
        options_from_json(run_arguments), stop_on_entry=stop_on_entry, stops_at_actions=stops_at_actions
    )


def _take_text(arguments: dict[str, Any], name: str) -> str:
    value = arguments.pop(name, "")
    if not isinstance(value, str):
        raise CxbridgeError(f"'{name}' must be a string")
    return value


def _take_flag(arguments: dict[str, Any], name: str, *, default: bool) -> bool:
    value = arguments.pop(name, default)
    if not isinstance(value, bool):
        raise CxbridgeError(f"'{name}' must be true or false")
    return value


def _enter_folder(folder: str) -> None:
    """Change the working directory, to which the paths of a launch configuration are relative."""
    if folder:
        try:
            os.chdir(Path(folder))
        except OSError as error:
            raise CxbridgeError(f"'cwd' cannot be {folder}: {error.strerror}") from error
