"""The fixtures of the executive's tests."""

from tests.executive.conftest import bus, clp, env, log

__all__ = ["bus", "clp", "env", "log"]
