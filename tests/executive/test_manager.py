"""Environments and features."""

from __future__ import annotations

import pytest

from cxbridge.errors import ClipsError
from cxbridge.executive.feature import Feature, LazyFeature
from cxbridge.executive.host.values import Symbol
from cxbridge.executive.manager import EnvironmentManager


class Answer(Feature):
    """A user's own feature."""

    name = "answer"

    def __init__(self):
        self.destroyed = []

    def init_context(self, env):
        env.define("answer", lambda: 42)

    def context_destroyed(self, env):
        self.destroyed.append(env.name)


@pytest.fixture
def feature():
    return Answer()


@pytest.fixture
def manager(bus, feature):
    manager = EnvironmentManager(bus, [feature])
    yield manager
    manager.close()


def test_environment_has_library_and_known_features(manager):
    env = manager.create("agent")
    assert env.eval("(time-diff-sec (create$ 2 500000) (create$ 1 0))") == 1.5
    assert [values["implied"] for _, _, values in env.facts("ff-feature")] == [("answer",)]


def test_requested_feature_is_available(manager):
    env = manager.create("agent")
    with pytest.raises(ClipsError):
        env.eval("(answer)")
    assert env.eval('(ff-feature-request "answer")') == "TRUE"
    assert env.eval("(answer)") == 42
    assert [values["implied"] for _, _, values in env.facts("ff-feature-loaded")] == [("answer",)]


def test_features_survive_reset(manager):
    env = manager.create("agent")
    env.eval('(ff-feature-request "answer")')
    env.eval("(reset)")
    assert [template for _, template, _ in env.facts()] == ["ff-feature", "ff-feature-loaded"]


def test_environments_are_separate(manager):
    one, two = manager.create("one"), manager.create("two")
    one.eval('(ff-feature-request "answer")')
    one.assert_string("(only one)")
    assert list(two.facts("only")) == []
    assert list(two.facts("ff-feature-loaded")) == []
    assert set(manager.environments) == {"one", "two"}


def test_name_is_free_after_destruction(manager, feature):
    manager.create("agent").eval('(ff-feature-request "answer")')
    with pytest.raises(ClipsError, match="already exists"):
        manager.create("agent")
    manager.destroy("agent")
    assert feature.destroyed == ["agent"]
    manager.create("agent")
    with pytest.raises(ClipsError, match="no CLIPS environment 'other'"):
        manager.destroy("other")


def test_lazy_feature_is_created_once_at_first_request(bus):
    made = []

    def load():
        made.append(Answer())
        return made[0]

    manager = EnvironmentManager(bus, [LazyFeature("answer", load)])
    first, second = manager.create("first"), manager.create("second")
    assert made == []
    assert manager.features == ("answer",)
    first.call("ff-feature-request", Symbol("answer"))
    second.call("ff-feature-request", Symbol("answer"))
    assert len(made) == 1
    assert first.call("answer") == second.call("answer") == 42
    manager.close()
    assert sorted(made[0].destroyed) == ["first", "second"]
    with pytest.raises(ClipsError, match="already"):
        manager.add_feature(Answer())


class Waiting(Feature):
    """A feature with facts that arrive between two runs."""

    name = "waiting"

    def __init__(self):
        self.came = []

    def init_context(self, env):
        env.build("(deftemplate came (slot what))")

    def before_run(self, env):
        while self.came:
            env.assert_fact("came", {"what": self.came.pop(0)})


def test_feature_asserts_pending_facts_before_run(manager):
    feature = Waiting()
    manager.add_feature(feature)
    env = manager.create("test")
    feature.came = [Symbol("early")]
    manager.before_run("test")
    assert feature.came  # not yet requested
    manager.request("test", "waiting")
    manager.before_run("test")
    assert [slots["what"] for _, _, slots in env.facts("came")] == ["early"]
