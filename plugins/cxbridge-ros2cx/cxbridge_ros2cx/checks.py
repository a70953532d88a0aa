"""Checks of a checkout of the thesis' executive, and of its parameter files, before a run.

The thesis' executive, ros2-clips-executive (2021), ignores unknown keys, so a misspelt key has no effect
there. Here each unread key gets a warning with file and line.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path

from cxbridge.config import Configuration, ConfigValue
from cxbridge.suggestions import did_you_mean
from cxbridge_ros2cx.checkout import KNOWN_COMMIT, Ros2CxCheckout
from cxbridge_ros2cx.parameters import EXECUTIVE_TREE

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
_PLACEHOLDER = re.compile(r"@\w+@")
# `@FEATURESTEST@` is in the parameter file of the checkout, but only the tests of the executive define it
_SHIPPED_PLACEHOLDERS = ("@CONFDIR@", "@FEATURESTEST@")

_MAX_LISTED_FILES = 4  # files of a package that a warning names: more would fill the screen


def check_parameters(config: Configuration, spec: str, checkout: Ros2CxCheckout) -> list[str]:
    """Return warnings about the parameters of a spec and about the checkout."""
    return [
        *_find_changed_files(checkout),
        *_find_unknown_keys(config, spec),
        *_find_invalid_folders(config, checkout),
        *_find_empty_sections(config, spec),
    ]


def _find_changed_files(checkout: Ros2CxCheckout) -> Iterator[str]:
    """Yield a warning if the files of a checkout differ from the files of the known commit."""
    changed_files = checkout.find_changed_files()
    changed_text = "; ".join(
        f"{package} ({_shorten_list(files)})" for package, files in changed_files.items() if files
    )
    if changed_text:
        unchanged_text = (
            ", ".join(package for package, files in changed_files.items() if not files) or "nothing"
        )
        yield (
            f"{checkout.root}: this is not commit {KNOWN_COMMIT}, with which cxbridge was compared. "
            f"Different files: {changed_text}. Unchanged: {unchanged_text}"
        )


def _shorten_list(names: list[str]) -> str:
    omitted = len(names) - _MAX_LISTED_FILES
    return ", ".join(names[:_MAX_LISTED_FILES]) + (f" and {omitted} more" if omitted > 0 else "")


def _find_unknown_keys(config: Configuration, spec: str) -> Iterator[str]:
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


def _find_invalid_folders(config: Configuration, checkout: Ros2CxCheckout) -> Iterator[str]:
    path = f"{EXECUTIVE_TREE}/clips-dirs"
    for text in config.get_strings(path, default=[]):
        unknown_placeholders = [
            name for name in _PLACEHOLDER.findall(text) if name not in _SHIPPED_PLACEHOLDERS
        ]
        if unknown_placeholders:
            hint = f"use {_SHIPPED_PLACEHOLDERS[0]}"
            location = _format_location(config, path)
            yield f"{location}{unknown_placeholders[0]} in clips-dirs is not a known placeholder; {hint}"
        elif "@FEATURESTEST@" not in text:
            folder = Path(text.replace("@CONFDIR@", str(checkout.bringup_folder)))
            if not folder.is_dir():
                yield f"{_format_location(config, path)}clips-dirs names {folder}, which is not a folder"


def _find_empty_sections(config: Configuration, spec: str) -> Iterator[str]:
    spec_path = f"{EXECUTIVE_TREE}/specs/{spec}"
    if not config.keys(f"{spec_path}/init"):
        yield f"{_format_location(config, spec_path)}the spec '{spec}' has no init: it loads nothing"
    if not config.keys(f"{spec_path}/action-mapping"):
        location = _format_location(config, spec_path)
        yield f"{location}the spec '{spec}' has no action-mapping: executors get no mapped_action"


def _format_location(config: Configuration, path: str) -> str:
    """Return ``FILE:LINE: `` of a path, or of the first value below the path."""
    value: ConfigValue | None
    value = config.get(path) if config.exists(path) else next(config.search(path), None)
    return f"{value.file}:{value.line}: " if value is not None and value.file else ""
