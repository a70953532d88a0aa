"""Skills and skill strings in Lua cannot read secrets of the configuration and the environment."""

from __future__ import annotations

from typing import Any

import pytest

from cxbridge.config import Configuration
from cxbridge.events import Level
from tests.skiller.rig import Rig

SECRET = "5ec2e7-0f-the-daemon"


@pytest.fixture(scope="module")
def rig() -> Rig:
    config = Configuration()
    config.set("/cxbridge/web/token", SECRET)
    config.set("/url", f"https://me:{SECRET}@host/")
    config.set("/other", "plain")
    rig = Rig()
    rig.lua(space="mobile", config=config)
    return rig


@pytest.fixture(scope="module")
def engine(rig: Rig) -> Any:
    return rig.backends[0].engine


KINDS = ["string", "int", "uint", "float", "bool"]
ACCESSORS = ["exists", *(f"{how}_{kind}" for how in ("get", "is") for kind in KINDS)]
ACCESSORS += [f"get_{kind}_or_default" for kind in KINDS]


@pytest.mark.parametrize(
    "path", ["/cxbridge/web/token", "cxbridge//web/token", "/cxbridge/web/token/", "/cxbridge/web", "/url"]
)
@pytest.mark.parametrize("accessor", ACCESSORS)
def test_accessors_hide_secrets_of_configuration(rig: Rig, engine: Any, accessor: str, path: str):
    rig.forget()
    engine.compile(f"print_info(tostring(config:{accessor}('{path}', 'x')))")
    output = engine.run()[0] + "".join(rig.logged(Level.INFO))
    assert output
    assert SECRET not in output


@pytest.mark.parametrize("name", ["SOME_TOKEN", "SOME_URL"])
def test_getenv_hides_secrets(rig: Rig, engine: Any, name: str, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setenv("SOME_TOKEN", SECRET)
    monkeypatch.setenv("SOME_URL", f"https://me:{SECRET}@host/")
    monkeypatch.setenv("SOME_PLACE", "kitchen")
    rig.forget()
    engine.compile(f"print_info(os.getenv('SOME_PLACE')); print_info(os.getenv('{name}'))")
    output = engine.run()[0] + "".join(rig.logged(Level.INFO))
    assert "kitchen" in output
    assert SECRET not in output


def test_plain_values_are_readable(rig: Rig, engine: Any):
    rig.forget()
    engine.compile("print_info(config:get_string('/other'))")
    assert engine.run()[0] == ""
    assert rig.logged(Level.INFO) == ["plain"]
