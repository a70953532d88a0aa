"""Every construct of the thesis' files that CLIPS 6.30 defines is defined here, and no other."""

from __future__ import annotations

import re
from collections.abc import Iterable
from pathlib import Path

from cxbridge.clock import VirtualClock
from cxbridge.events import EventBus
from cxbridge.executive.host.environment import ClipsEnvironment
from cxbridge.executive.host.values import FALSE
from ros2cx_tests.inside import KINDS, Inside, look_inside, names_of
from tests.executive.clips630.engines import execute, needs_clips630
from tests.support import ROS2CX_DIR, needs_ros2cx

pytestmark = [needs_ros2cx, needs_clips630]

REFUSED = {
    # a parenthesis that never closes, in the first of them
    "skills.clp": {"skill-start-timeout", "skill-status-update-nochange"},
    # functions of Fawkes' robot memory, which the original does not have
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
    # a slot that plan-action does not have
    "exectest.clp": {"start"},
    # skiller-control is undefined
    "test-scenario/goal-reasoner.clp": {"goal-reasoner-parent-create"},
    # part-of where a slot has to be
    "tests/blocksworld.clp": {"blocksworld"},
    "tests/conditional_say.clp": {"say"},
}
"""Constructs that CLIPS 6.30 refuses and 6.4 too, by file."""

HOST = {"ff-features-available", "ff-features-loaded"}
"""Constructs that the host builds, not a file."""

OURS = {"deffunction"}
"""Kinds of which our environment has more: what CLIPS 6.4 has lost of 6.30 is defined so."""

_NO_CODE = re.compile(r'"(?:\\.|[^"\\])*"|;[^\n]*')  # texts and comments
_CONSTRUCT = re.compile(r"\((defrule|deftemplate|deffunction|deffacts)\s+([^\s()\"]+)")


def stub(name: str, least: int, most: int) -> str:
    """A deffunction that takes as many arguments as one of the host's."""
    words = [f"?a{number}" for number in range(least)]
    return f"(deffunction {name} ({' '.join(words)}{' $?more' if most > least else ''}) FALSE)"


def there(inside: Inside, folder: Path) -> dict[str, frozenset[str]]:
    """The names of constructs that CLIPS 6.30 has after loading the same files in the same way."""
    host = {"now": (0, 0), "now-systime": (0, 0), "ff-feature-request": (1, 1), **inside.functions}
    commands = [f'(build "{stub(name, *arity)}")' for name, arity in host.items()]
    commands += [f'({"batch*" if batch else "load*"} "{file}")' for file, batch in inside.files]
    commands += [
        f'(progn (printout t crlf "@{kind} ") (printout t (get-{kind}-list MAIN) crlf))' for kind in KINDS
    ]
    output = execute(commands, folder)
    found = {}
    for kind in KINDS:
        match = re.search(rf"^@{kind} \((.*)\)$", output, re.MULTILINE)
        assert match, output[-2000:]
        found[kind] = frozenset(match[1].split()) - host.keys() - {"initial-fact"}  # 6.4 has none
    return found


def named(file: Path) -> Iterable[tuple[str, str]]:
    """Kind and name of the constructs that a file has by its text."""
    return _CONSTRUCT.findall(_NO_CODE.sub("", file.read_text("utf-8")))


def relative(file: Path) -> str:
    """A file as seen from the folder ``clips`` that it lies in."""
    return str(file).rpartition("/clips/")[2]


def check(inside: Inside, folder: Path) -> None:
    theirs = there(inside, folder)
    for kind in KINDS:
        ours = inside.constructs[kind]
        assert theirs[kind] - ours == frozenset(), kind
        if kind not in OURS:
            assert ours - theirs[kind] <= HOST, kind
    refused = {
        relative(file): names
        for file, _ in inside.files
        if (names := {name for kind, name in named(file) if name not in theirs[kind]})
    }
    assert refused == {file: REFUSED[file] for file in map(relative, dict(inside.files)) if file in REFUSED}
    functions = {name for names in refused.values() for name in names} - theirs["deffunction"]
    assert functions & inside.constructs["deffunction"] == frozenset()


def test_all_files_of_it_in_one_environment(tmp_path: Path) -> None:
    """What no spec loads, too: after the files of a spec, without facts."""
    assert ROS2CX_DIR is not None
    inside = look_inside("test")
    inside.functions |= look_inside("test-nav2").functions
    loaded = {file.resolve() for file, _ in inside.files}
    rest = [file for file in sorted(ROS2CX_DIR.rglob("src/**/*.clp")) if file.resolve() not in loaded]
    assert len(rest) > 20
    inside.files += [(file, False) for file in rest]
    env = ClipsEnvironment("executive", EventBus(VirtualClock()))
    for name, arity in (("ff-feature-request", (1, 1)), *inside.functions.items()):
        env.define(name, lambda *_arguments: FALSE, *arity)
    for file, batch in inside.files:
        (env.batch if batch else env.load)(file)
    inside.constructs = {kind: names_of(env, kind) for kind in KINDS}
    env.destroy()
    check(inside, tmp_path)
