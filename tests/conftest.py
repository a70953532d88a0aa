"""Settings for all tests."""

from __future__ import annotations

from hypothesis import HealthCheck, settings

# other work on the machine must not fail a property
settings.register_profile("cxbridge", deadline=None, suppress_health_check=[HealthCheck.too_slow])
settings.load_profile("cxbridge")
