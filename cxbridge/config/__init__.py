"""Fawkes' YAML configuration: files and their includes to typed values by path.

Every value knows the file and the line that it came from. The dialect is described in docs/configuration.md.
"""

from __future__ import annotations

from cxbridge.config.checkouts import PLACEHOLDERS, substitute_path
from cxbridge.config.configuration import ConfigMissingError, ConfigTypeError, Configuration
from cxbridge.config.documents import Mark
from cxbridge.config.scalars import ConfigType
from cxbridge.config.values import ConfigValue

__all__ = [
    "PLACEHOLDERS",
    "ConfigMissingError",
    "ConfigType",
    "ConfigTypeError",
    "ConfigValue",
    "Configuration",
    "Mark",
    "substitute_path",
]
