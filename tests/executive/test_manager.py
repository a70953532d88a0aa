"""Environments and features."""

from __future__ import annotations

import pytest

from cxbridge.errors import ClipsError
from cxbridge.events import Level
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


def test_an_environment_has_the_library_and_knows_the_features(manager):
    env = manager.create("agent")
    assert env.eval("(time-diff-sec (create$ 2 500000) (create$ 1 0))") == 1.5
    assert [values["implied"] for _, _, values in env.facts("ff-feature")] == [("answer",)]


def test_log_lines_have_the_environments_component(manager, log):
    manager.create("agent").eval('(printout t "hello" crlf)')
    assert any((line.component, line.text) == ("CLIPS (agent)", "hello") for line in log.lines)


def test_a_feature_is_there_once_it_was_requested(manager):
    env = manager.create("agent")
    with pytest.raises(ClipsError):
        env.eval("(answer)")
    assert env.eval('(ff-feature-request "answer")') == "TRUE"
    assert env.eval("(answer)") == 42
    assert [values["implied"] for _, _, values in env.facts("ff-feature-loaded")] == [("answer",)]


def test_features_survive_a_reset(manager):
    env = manager.create("agent")
    env.eval('(ff-feature-request "answer")')
    env.eval("(reset)")
    assert [template for _, template, _ in env.facts()] == ["ff-feature", "ff-feature-loaded"]


def test_requesting_what_is_not_there(manager, log):
    assert manager.create("agent").eval('(ff-feature-request "nothing")') == "FALSE"
    assert "Environment requested unavailable feature nothing" in log.texts(Level.WARN)


def test_requesting_twice_is_told_and_harmless(manager, log):
    env = manager.create("agent")
    env.eval('(ff-feature-request "answer")')
    assert env.eval('(ff-feature-request "answer")') == "TRUE"
    assert "Environment agent requested feature answer *again*" in log.texts(Level.WARN)


def test_several_environments_do_not_know_of_each_other(manager):
    one, two = manager.create("one"), manager.create("two")
    one.eval('(ff-feature-request "answer")')
    one.assert_string("(only one)")
    assert list(two.facts("only")) == []
    assert list(two.facts("ff-feature-loaded")) == []
    assert set(manager.environments) == {"one", "two"}


def test_a_name_can_be_used_once_and_again_after_destruction(manager, feature):
    manager.create("agent").eval('(ff-feature-request "answer")')
    with pytest.raises(ClipsError, match="already exists"):
        manager.create("agent")
    manager.destroy("agent")
    assert feature.destroyed == ["agent"]
    manager.create("agent")
    with pytest.raises(ClipsError, match="no CLIPS environment 'other'"):
        manager.destroy("other")


def test_a_lazy_feature_is_made_once_and_only_when_requested(bus):
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


def test_two_features_of_one_name_are_refused(manager):
    with pytest.raises(ClipsError, match="'answer' already"):
        manager.add_feature(Answer())


class Waiting(Feature):
    """Something that comes in between two runs."""

    name = "waiting"

    def __init__(self):
        self.came = []

    def init_context(self, env):
        env.build("(deftemplate came (slot what))")

    def before_run(self, env):
        while self.came:
            env.assert_fact("came", {"what": self.came.pop(0)})


def test_a_feature_tells_what_came_in_before_a_run(manager):
    feature = Waiting()
    manager.add_feature(feature)
    env = manager.create("test")
    feature.came = [Symbol("early")]
    manager.before_run("test")
    assert feature.came  # nobody has requested it yet
    manager.request("test", "waiting")
    manager.before_run("test")
    assert [slots["what"] for _, _, slots in env.facts("came")] == ["early"]


def relation(env, name):
    return sorted(values["implied"][0] for _, _, values in env.facts(name))


def test_a_feature_is_offered_to_environments_that_there_are(manager):
    """The original's add_clips_features asserts ff-feature in each environment."""
    env = manager.create("agent")

    class Late(Feature):
        name = "late"

        def init_context(self, env):
            env.define("late", lambda: 1)

    manager.add_feature(Late())
    assert relation(env, "ff-feature") == ["answer", "late"]
    env.eval("(reset)")
    assert relation(env, "ff-feature") == ["answer", "late"]
    assert env.eval('(ff-feature-request "late")') == "TRUE"


def test_a_withdrawn_feature_cannot_be_requested_until_it_is_offered(manager, feature):
    env = manager.create("agent")
    manager.withdraw("answer")
    assert (manager.features, relation(env, "ff-feature")) == ((), [])
    assert env.eval('(ff-feature-request "answer")') == "FALSE"
    assert [(info.name, info.offered) for info in manager.catalogue] == [("answer", False)]
    assert relation(manager.create("another"), "ff-feature") == []
    with pytest.raises(ClipsError, match="already"):
        manager.add_feature(Answer())
    manager.offer("answer")
    assert env.eval('(ff-feature-request "answer")') == "TRUE"
    with pytest.raises(ClipsError, match="in use by agent"):
        manager.withdraw("answer")
    with pytest.raises(ClipsError, match="no CLIPS feature 'x'"):
        manager.check_unused("x")


def test_a_feature_that_was_taken_away_can_be_requested_again(manager, feature, log):
    env = manager.create("agent")
    env.eval('(ff-feature-request "answer")')
    env.build("(defrule ask (ask) => (bind ?x (answer)) (assert (answered ?x)))")
    manager.destroy_context("agent", "answer")
    assert feature.destroyed == ["agent"]
    assert (manager.loaded_features("agent"), relation(env, "ff-feature-loaded")) == ((), [])
    with pytest.raises(ClipsError, match="answer"):
        env.eval("(answer)")
    assert any("'answer' was removed from the environment 'agent'" in line.text for line in log.lines)
    env.assert_string("(ask)")
    env.run()
    assert (list(env.facts("answered")), env.faults) == ([], [])
    assert env.eval('(ff-feature-request "answer")') == "TRUE"
    assert env.eval("(answer)") == 42
    manager.destroy("agent")
    assert feature.destroyed == ["agent", "agent"]


def test_a_feature_keeps_its_functions_when_one_that_it_requested_goes(manager):
    class Outer(Feature):
        name = "outer"

        def init_context(self, env):
            env.eval('(ff-feature-request "answer")')
            env.define("outer", lambda: 7)

    manager.add_feature(Outer())
    env = manager.create("agent")
    env.eval('(ff-feature-request "outer")')
    manager.destroy_context("agent", "outer")
    assert env.eval("(answer)") == 42
    with pytest.raises(ClipsError):
        env.eval("(outer)")


def test_a_function_that_comes_back_with_other_arguments_is_refused(manager):
    class Other(Feature):
        name = "other"

        def init_context(self, env):
            env.define("answer", lambda x: x, 1)

    manager.add_feature(Other())
    env = manager.create("agent")
    env.eval('(ff-feature-request "answer")')
    manager.destroy_context("agent", "answer")
    with pytest.raises(ClipsError):
        env.eval('(ff-feature-request "other")')
    assert manager.loaded_features("agent") == ()
