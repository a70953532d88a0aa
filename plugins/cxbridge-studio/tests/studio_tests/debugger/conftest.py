"""The fixtures of the tests of the executive."""

from tests.executive.conftest import bus, clp, env, log

__all__ = ["bus", "clp", "env", "log"]
