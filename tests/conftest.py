"""Settings for all tests."""

from __future__ import annotations

import signal
from contextlib import suppress

import pytest
from hypothesis import HealthCheck, settings

from tests.support import ROOT

# other work on the machine must not fail a property
settings.register_profile("cxbridge", deadline=None, suppress_health_check=[HealthCheck.too_slow])
settings.load_profile("cxbridge")

# a shell's background jobs ignore some signals and hand that on: what the tests start shall hear them
for _number in (signal.SIGINT, signal.SIGHUP):
    if signal.getsignal(_number) is signal.SIG_IGN:
        with suppress(ValueError):  # not in the main thread
            signal.signal(_number, signal.default_int_handler if _number == signal.SIGINT else signal.SIG_DFL)

_OVER_A_NETWORK = ("zmq", "fawkesnet", "hosts", "gateway", "daemon", "remote", "test_bb", "test_skill.py")


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Give tests between processes a second chance: on a busy machine others may take the time they need."""
    for item in items:
        path = str(item.path.relative_to(ROOT))
        if any(part in path for part in _OVER_A_NETWORK) and not path.endswith("test_model.py"):
            item.add_marker(pytest.mark.flaky(reruns=2))
