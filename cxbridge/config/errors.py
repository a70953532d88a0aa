"""The errors of reading a configuration value; every other mistake is a plain :class:`ConfigError`."""

from __future__ import annotations

from cxbridge.errors import ConfigError


class ConfigMissingError(ConfigError):
    """There is no value at the path that was asked for."""


class ConfigTypeError(ConfigError):
    """There is a value at the path, but of another type."""
