"""CLIPS environments for tests."""

from __future__ import annotations

from tests.executive.conftest import bus, clp, env, log

__all__ = ["bus", "clp", "env", "log"]  # fixtures
