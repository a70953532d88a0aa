"""A bench for the tests of goals."""

import pytest

from tests.executive.core.core_bench import Bench
from tests.executive.core.goal_bench import make_bench


@pytest.fixture
def bench() -> Bench:
    """Goals of all sub-types, and an agent that only runs leaves."""
    return make_bench()
