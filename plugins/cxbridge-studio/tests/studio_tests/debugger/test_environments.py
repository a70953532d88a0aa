"""Environments that clients create."""

from __future__ import annotations

import pytest

from cxbridge.errors import ClipsError
from cxbridge.events import Level
from cxbridge.executive.feature import Feature
from cxbridge.executive.manager import EnvironmentManager
from cxbridge_studio.debugger.environments import EnvironmentService


class Answer(Feature):
    name = "answer"
    run_count = 0

    def init_context(self, env):
        env.define("answer", lambda: 42)

    def before_run(self, env):
        self.run_count += 1


@pytest.fixture(name="feature")
def _feature():
    return Answer()


@pytest.fixture(name="service")
def _service(bus, feature):
    manager = EnvironmentManager(bus, [feature])
    manager.create("executive")
    yield EnvironmentService(manager)
    manager.close()


def test_rules_of_client_environment_run(service, clp, feature):
    env = service.create("mine")
    file = clp(
        "(defrule ping ?f <- (ping ?n) => (retract ?f) (assert (pong (+ ?n (answer)))))", 'a "b" c.clp'
    )
    service.request_feature("mine", "answer")
    service.request_feature("mine", "answer")
    assert list(service.load("mine", file)) == []
    env.assert_string("(ping 1)")
    info = service.list()[1]
    assert (info.agenda, info.features) == (1, ("answer",))
    service._manager.run_client_environments()
    assert [slots["implied"] for _, _, slots in env.facts("pong")] == [(43,)]
    assert feature.run_count == 1
    executive = service._manager.find("executive")
    executive.build("(defrule other (initial) => (assert (never)))")
    executive.assert_string("(initial)")
    service._manager.run_client_environments()
    assert not list(executive.facts("never"))  # the executive runs its own environment


def test_watch_and_log_level_are_set(service, log):
    env = service.create("mine")
    service.watch("mine", "rules")
    service.watch("mine", "facts", ["ff-feature"])
    assert service.list()[1].watch == ("facts", "rules")
    service.watch("mine", "all", on=False)
    assert service.list()[1].watch == ()
    env.build('(defrule say (say) => (printout t "low" crlf) (printout warn "high" crlf))')
    service.set_log_level("mine", "warn")
    for expected in ([], ["low"]):
        env.assert_string("(say)")
        service._manager.run_client_environments()
        assert [text for text in log.texts(Level.INFO) if text == "low"] == expected
        env.eval("(do-for-all-facts ((?f say)) TRUE (retract ?f))")
        service.set_log_level("mine", "debug")
    assert log.texts(Level.WARN).count("high") == 2
    assert service.list()[1].log_level == "debug"


def test_invalid_requests_are_errors(service, tmp_path):
    service.create("mine")
    for message, call in (
        ("is not a valid name for an environment", lambda: service.create("a b")),
        ("cannot be destroyed", lambda: service.destroy("executive")),
        ("cannot read this file", lambda: service.load("mine", tmp_path / "nothing.clp")),
        ("watching 'thoughts'", lambda: service.watch("mine", "thoughts")),
        ("Unable to find defrule 'x'", lambda: service.watch("mine", "rules", ["x"])),
    ):
        with pytest.raises(ClipsError, match=message):
            call()
