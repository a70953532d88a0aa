"""Settings for all tests."""

from __future__ import annotations

import signal
from contextlib import suppress

from hypothesis import HealthCheck, settings

# other work on the machine must not fail a property
settings.register_profile("cxbridge", deadline=None, suppress_health_check=[HealthCheck.too_slow])
settings.load_profile("cxbridge")

# a shell's background jobs ignore some signals and hand that on: what the tests start shall hear them
for _number in (signal.SIGINT, signal.SIGHUP):
    if signal.getsignal(_number) is signal.SIG_IGN:
        with suppress(ValueError):  # not in the main thread
            signal.signal(_number, signal.default_int_handler if _number == signal.SIGINT else signal.SIG_DFL)
