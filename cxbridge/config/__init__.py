"""Fawkes' YAML configuration: typed values by path, read from files and their includes.

Each value from a file records the file and the line of its definition. docs/configuration.md describes the
dialect.
"""

from __future__ import annotations

from cxbridge.config.checkouts import PLACEHOLDERS, substitute_path
from cxbridge.config.configuration import Configuration
from cxbridge.config.documents import Mark
from cxbridge.config.scalars import ConfigType
from cxbridge.config.tree import ConfigValue

__all__ = [
    "PLACEHOLDERS",
    "ConfigType",
    "ConfigValue",
    "Configuration",
    "Mark",
    "substitute_path",
]
