"""Makes a target from the launch configuration that an editor sends."""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Final

from cxbridge.errors import CxbridgeError
from cxbridge_studio.dap.target import Target

# the keys of a launch configuration that are for the editors themselves
_EDITOR_KEYS: Final = frozenset(
    {
        *("type", "request", "name", "console", "debugServer", "internalConsoleOptions", "noDebug"),
        *("order", "postDebugTask", "preLaunchTask", "presentation", "serverReadyAction"),
        *("linux", "osx", "windows", "suppressMultipleSessionWarning"),
    }
)

_UNSUPPORTED_OPTIONS: Final = ("replay",)  # options of `cxbridge run` that the debugger does not support


def make_target(arguments: Mapping[str, Any]) -> Target:
    """Return the target of a launch configuration.

    :param arguments: ``scenario`` and the options of ``cxbridge run``, as ``skillDirs`` or ``skill-dirs``; or
        ``recording`` and ``env``. Both forms accept ``stopOnEntry``, ``stopInRules`` and ``cwd``.
    :raises CxbridgeError: if the arguments are invalid.
    """
    run_arguments = {
        name: value
        for name, value in arguments.items()
        if name not in _EDITOR_KEYS and not name.startswith("__") and value is not None
    }
    _enter_folder(_take_text(run_arguments, "cwd"))
    without_stops = _take_flag(dict(arguments), "noDebug", default=False)
    recording, env = _take_text(run_arguments, "recording"), _take_text(run_arguments, "env")
    stop_on_entry = _take_flag(run_arguments, "stopOnEntry", default=False) and not without_stops
    stops_at_actions = _take_flag(run_arguments, "stopInRules", default=True) and not without_stops
    if recording:
        if run_arguments:
            raise CxbridgeError(f"'{next(iter(run_arguments))}' cannot be used with a recording")
        # imported here, since a session with a run does not need these modules
        from cxbridge.trace.formats.registry import open_run  # noqa: PLC0415
        from cxbridge_studio.dap.recorded import RecordedRun  # noqa: PLC0415

        return RecordedRun(open_run(recording), env or None)
    if env:
        raise CxbridgeError("'env' can only be used with a recording")
    # imported here, since a session with a recording does not need these modules
    from cxbridge.run.program.plain_options import options_from_json  # noqa: PLC0415
    from cxbridge_studio.dap.live import LiveRun  # noqa: PLC0415

    if any(name in run_arguments for name in _UNSUPPORTED_OPTIONS):
        raise CxbridgeError("a replay cannot be debugged", hint="name the recording with 'recording'")
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
