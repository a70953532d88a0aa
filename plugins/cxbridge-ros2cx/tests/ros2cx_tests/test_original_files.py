"""The constructs of the thesis' files, compared with those that CLIPS 6.30 defines."""

from __future__ import annotations

import re
from collections.abc import Iterable
from pathlib import Path

from cxbridge.clock import VirtualClock
from cxbridge.events import EventBus
from cxbridge.executive.host.environment import ClipsEnvironment
from cxbridge.executive.host.values import FALSE
from ros2cx_tests.loaded_agent import KINDS, LoadedAgent, find_names, load_agent
from tests.executive.clips630.engines import execute, needs_clips630
from tests.support import ROS2CX_DIR, needs_ros2cx

pytestmark = [needs_ros2cx, needs_clips630]

REFUSED = {
    # an unclosed parenthesis in the first rule
    "skills.clp": {"skill-start-timeout", "skill-status-update-nochange"},
    # functions of Fawkes' robot memory, which the original lacks
    "coordination-mutex.clp": {
        "mutex-create",
        "mutex-expire-locks-start",
        "mutex-finalize",
        "mutex-init",
        "mutex-init-register-trigger-failed",
        "mutex-lock-start",
        "mutex-register-trigger",
        "mutex-renew-lock-start",
        "mutex-trigger-delete",
        "mutex-trigger-event",
        "mutex-trigger-update",
        "mutex-unlock-start",
    },
    # a slot that plan-action lacks
    "exectest.clp": {"start"},
    # skiller-control is undefined
    "test-scenario/goal-reasoner.clp": {"goal-reasoner-parent-create"},
    # part-of in place of a slot
    "tests/blocksworld.clp": {"blocksworld"},
    "tests/conditional_say.clp": {"say"},
}
"""The constructs that CLIPS 6.30 and 6.4 refuse, by file."""

HOST_CONSTRUCTS = {"ff-features-available", "ff-features-loaded"}
"""The constructs that the host builds without a file."""

EXTENDED_KINDS = {"deffunction"}
"""The kinds with additional constructs here, which restore functions that CLIPS 6.4 lost."""

_NO_CODE = re.compile(r'"(?:\\.|[^"\\])*"|;[^\n]*')  # texts and comments
_CONSTRUCT = re.compile(r"\((defrule|deftemplate|deffunction|deffacts)\s+([^\s()\"]+)")


def make_stub(name: str, minimum: int, maximum: int) -> str:
    """Return a deffunction with the same numbers of arguments as a function of the host."""
    words = [f"?a{number}" for number in range(minimum)]
    return f"(deffunction {name} ({' '.join(words)}{' $?more' if maximum > minimum else ''}) FALSE)"


def find_original_constructs(agent: LoadedAgent, folder: Path) -> dict[str, frozenset[str]]:
    """Return the names of constructs in CLIPS 6.30 after the same load of the same files."""
    host = {"now": (0, 0), "now-systime": (0, 0), "ff-feature-request": (1, 1), **agent.functions}
    commands = [f'(build "{make_stub(name, *arity)}")' for name, arity in host.items()]
    commands += [f'({"batch*" if batch else "load*"} "{file}")' for file, batch in agent.files]
    commands += [
        f'(progn (printout t crlf "@{kind} ") (printout t (get-{kind}-list MAIN) crlf))' for kind in KINDS
    ]
    output = execute(commands, folder)
    constructs = {}
    for kind in KINDS:
        match = re.search(rf"^@{kind} \((.*)\)$", output, re.MULTILINE)
        assert match, output[-2000:]
        constructs[kind] = frozenset(match[1].split()) - host.keys() - {"initial-fact"}  # not in 6.4
    return constructs


def find_names_in_text(file: Path) -> Iterable[tuple[str, str]]:
    """Return kind and name of the constructs in the text of a file."""
    return _CONSTRUCT.findall(_NO_CODE.sub("", file.read_text("utf-8")))


def make_relative(file: Path) -> str:
    """Return the path of a file relative to its folder ``clips``."""
    return str(file).rpartition("/clips/")[2]


def check_constructs(agent: LoadedAgent, folder: Path) -> None:
    original = find_original_constructs(agent, folder)
    for kind in KINDS:
        ours = agent.constructs[kind]
        assert original[kind] - ours == frozenset(), kind
        if kind not in EXTENDED_KINDS:
            assert ours - original[kind] <= HOST_CONSTRUCTS, kind
    refused = {
        make_relative(file): names
        for file, _ in agent.files
        if (names := {name for kind, name in find_names_in_text(file) if name not in original[kind]})
    }
    assert refused == {
        file: REFUSED[file] for file in map(make_relative, dict(agent.files)) if file in REFUSED
    }
    functions = {name for names in refused.values() for name in names} - original["deffunction"]
    assert functions & agent.constructs["deffunction"] == frozenset()


def test_all_original_files_define_same_constructs(tmp_path: Path) -> None:
    """The environment loads the files of specs and all remaining files, without facts."""
    assert ROS2CX_DIR is not None
    agent = load_agent("test")
    agent.functions |= load_agent("test-nav2").functions
    loaded = {file.resolve() for file, _ in agent.files}
    unloaded = [file for file in sorted(ROS2CX_DIR.rglob("src/**/*.clp")) if file.resolve() not in loaded]
    assert len(unloaded) > 20
    agent.files += [(file, False) for file in unloaded]
    env = ClipsEnvironment("executive", EventBus(VirtualClock()))
    for name, arity in (("ff-feature-request", (1, 1)), *agent.functions.items()):
        env.define(name, lambda *_arguments: FALSE, *arity)
    for file, batch in agent.files:
        (env.batch if batch else env.load)(file)
    agent.constructs = {kind: find_names(env, kind) for kind in KINDS}
    env.destroy()
    check_constructs(agent, tmp_path)
