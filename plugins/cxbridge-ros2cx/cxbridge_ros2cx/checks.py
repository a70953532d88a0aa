"""Checks of a parameter file of the thesis' executive before a run.

The thesis' executive, ros2-clips-executive (2021), ignores unknown keys, so a misspelt key has no effect
there. Here each unread key gets a warning with file and line.
"""

from __future__ import annotations

from collections.abc import Iterator

from cxbridge.config import Configuration, ConfigValue
from cxbridge.suggestions import did_you_mean
from cxbridge_ros2cx.parameters import EXECUTIVE_TREE

# the keys that the executive reads: of the executive, its debug settings, a spec, and the spec's world model
_EXECUTIVE_KEYS = (
    "assert-time-each-loop",
    "automatic-goal-retraction",
    "clips-dirs",
    "debug",
    "refresh-rate",
    "request-redefine-warning-feature",
    "spec",
    "specs",
    "steal-skiller-control",
)
_DEBUG_KEYS = ("enable", "level", "unwatch-facts", "unwatch-rules")
_SPEC_KEYS = ("action-mapping", "blackboard-preload", "init", "parameters", "wm-remap")
_REMAP_KEYS = ("facts", "objects")
_REMAP_TARGET_KEYS = ("id-prefix", "name-id")


def find_unknown_keys(config: Configuration, spec: str) -> Iterator[str]:
    """Yield a warning about each parameter of the executive and of a spec that is never read."""
    spec_path = f"{EXECUTIVE_TREE}/specs/{spec}"
    known_keys = {
        EXECUTIVE_TREE: _EXECUTIVE_KEYS,
        f"{EXECUTIVE_TREE}/debug": _DEBUG_KEYS,
        spec_path: _SPEC_KEYS,
        f"{spec_path}/wm-remap": _REMAP_KEYS,
        **{f"{spec_path}/wm-remap/{key}": _REMAP_TARGET_KEYS for key in _REMAP_KEYS},
    }
    for path, names in known_keys.items():
        for key in config.keys(path):
            if key not in names:
                hint = did_you_mean(key, names, f"the known keys are {', '.join(names)}")
                yield f"{_format_location(config, f'{path}/{key}')}'{key}' is never read; {hint}"


def _format_location(config: Configuration, path: str) -> str:
    """Return ``FILE:LINE: `` of a path, or of the first value below the path."""
    value: ConfigValue | None
    value = config.get(path) if config.exists(path) else next(config.search(path), None)
    return f"{value.file}:{value.line}: " if value is not None and value.file else ""
