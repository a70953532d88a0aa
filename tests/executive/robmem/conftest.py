"""Stores for tests: each test of a store runs on every kind of them that is to be had."""

from __future__ import annotations

import pytest

from cxbridge.clock import VirtualClock
from cxbridge.executive.robmem.embedded import EmbeddedStore


@pytest.fixture
def clock():
    return VirtualClock()


@pytest.fixture
def store(clock):
    store = EmbeddedStore(clock)
    yield store
    store.close()
