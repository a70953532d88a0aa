"""Prints the exit statuses of all errors of the program by name, in a process that has the program loaded."""

from __future__ import annotations

import importlib
import json
import pkgutil

import cxbridge
from cxbridge.errors import CxbridgeError


def main() -> None:
    for module in pkgutil.walk_packages(cxbridge.__path__, "cxbridge."):
        if not module.name.endswith("__main__"):
            importlib.import_module(module.name)
    kinds = [CxbridgeError]
    for kind in kinds:  # it grows
        kinds += kind.__subclasses__()
    ours = [kind for kind in kinds if kind.__module__.startswith("cxbridge.")]
    print(json.dumps([(kind.__name__, kind.exit_status) for kind in ours]))  # noqa: T201
