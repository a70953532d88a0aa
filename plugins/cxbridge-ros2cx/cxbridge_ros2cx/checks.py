"""Checks of a checkout and its parameter files before a run.

The original ignores unknown keys, so a misspelt key has no effect there. Here each unread key is reported
with file and line.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path

from cxbridge.config import Configuration, ConfigValue
from cxbridge.suggestions import did_you_mean
from cxbridge_ros2cx.checkout import KNOWN_COMMIT, Ros2CxCheckout
from cxbridge_ros2cx.parameters import EXECUTIVE_TREE

_KEYS = (
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
_REMAP_KINDS = ("id-prefix", "name-id")
_PLACEHOLDER = re.compile(r"@\w+@")
# `@FEATURESTEST@` appears in the shipped file, but only the original's tests define it.
_SHIPPED_PLACEHOLDERS = ("@CONFDIR@", "@FEATURESTEST@")

_MAX_NAMES = 4  # number of files that a warning names per package


def check_parameters(config: Configuration, spec: str, checkout: Ros2CxCheckout) -> list[str]:
    """Return warnings about the parameters of a spec and about the checkout."""
    return [
        *_changed_files(checkout),
        *_unknown_keys(config, spec),
        *_invalid_folders(config, checkout),
        *_empty_sections(config, spec),
    ]


def _changed_files(checkout: Ros2CxCheckout) -> Iterator[str]:
    """Yield a warning if the files of a checkout differ from those of the known commit."""
    differences = checkout.compare()
    changed = "; ".join(f"{package} ({_shortened(files)})" for package, files in differences.items() if files)
    if changed:
        unchanged = ", ".join(package for package, files in differences.items() if not files) or "nothing"
        yield (
            f"{checkout.root}: this is not commit {KNOWN_COMMIT}, the one that was compared. "
            f"Other than there: {changed}. The same: {unchanged}"
        )


def _shortened(names: list[str]) -> str:
    omitted = len(names) - _MAX_NAMES
    return ", ".join(names[:_MAX_NAMES]) + (f" and {omitted} more" if omitted > 0 else "")


def _unknown_keys(config: Configuration, spec: str) -> Iterator[str]:
    base = f"{EXECUTIVE_TREE}/specs/{spec}"
    known_keys = {
        EXECUTIVE_TREE: _KEYS,
        f"{EXECUTIVE_TREE}/debug": _DEBUG_KEYS,
        base: _SPEC_KEYS,
        f"{base}/wm-remap": _REMAP_KEYS,
        **{f"{base}/wm-remap/{key}": _REMAP_KINDS for key in _REMAP_KEYS},
    }
    for path, names in known_keys.items():
        for key in config.keys(path):
            if key not in names:
                hint = did_you_mean(key, names, f"known are {', '.join(names)}")
                yield f"{_location(config, f'{path}/{key}')}'{key}' is never read; {hint}"


def _invalid_folders(config: Configuration, checkout: Ros2CxCheckout) -> Iterator[str]:
    path = f"{EXECUTIVE_TREE}/clips-dirs"
    for text in config.get_strings(path, default=[]):
        unknown = [name for name in _PLACEHOLDER.findall(text) if name not in _SHIPPED_PLACEHOLDERS]
        if unknown:
            hint = f"there is: {_SHIPPED_PLACEHOLDERS[0]}"
            yield f"{_location(config, path)}{unknown[0]} in clips-dirs stands for nothing; {hint}"
        elif "@FEATURESTEST@" not in text:
            folder = Path(text.replace("@CONFDIR@", str(checkout.bringup)))
            if not folder.is_dir():
                yield f"{_location(config, path)}clips-dirs names {folder}, which is not a folder"


def _empty_sections(config: Configuration, spec: str) -> Iterator[str]:
    base = f"{EXECUTIVE_TREE}/specs/{spec}"
    if not config.keys(f"{base}/init"):
        yield f"{_location(config, base)}the spec '{spec}' has no init: it loads nothing"
    if not config.keys(f"{base}/action-mapping"):
        place = _location(config, base)
        yield f"{place}the spec '{spec}' has no action-mapping: executors get no mapped_action"


def _location(config: Configuration, path: str) -> str:
    """Return ``FILE:LINE: `` of a path, or of the first value below the path."""
    value: ConfigValue | None
    value = config.get(path) if config.exists(path) else next(config.search(path), None)
    return f"{value.file}:{value.line}: " if value is not None and value.file else ""
