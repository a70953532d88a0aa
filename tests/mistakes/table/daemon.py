"""Mistakes of who starts a daemon."""

from __future__ import annotations

from typing import Final

from tests.fawkes import NO_SERVER
from tests.mistakes.table.mistake import DAEMON, Mistake, mistake

MISTAKES: Final[tuple[Mistake, ...]] = (
    mistake(
        "a parenthesis is missing",
        "hello-goals.clp",
        "(mode SELECTED)))",
        "(mode SELECTED))",
        "hello-select never closes",
        "hello-goals.clp:23",
        command=DAEMON,
    ),
    mistake(
        "a file is misspelt",
        "scenario.yaml",
        "hello-goals.clp,",
        "hello-gaols.clp,",
        "hello-gaols.clp",
        "scenario.yaml:17",
        command=DAEMON,
    ),
    mistake(
        "the domain is broken",
        "domain.pddl",
        ":effect (greeted",
        ":effect (greted",
        "greted",
        "domain.pddl:10",
        command=DAEMON,
    ),
    mistake(
        "a skill is broken",
        "skills/skills/hello/greet.lua",
        "self.fsm.vars.name\nend",
        "self.fsm.vars.name\n",
        "'end' expected",
        "greet.lua:25",
        command=DAEMON,
    ),
    mistake(
        "a setting is misspelt",
        "scenario.yaml",
        "skiller:\n",
        "cxbridge: {excutive: true}\nskiller:\n",
        "excutive",
        "scenario.yaml:20",
        command=DAEMON,
    ),
    mistake(
        "a setting has the wrong type",
        "scenario.yaml",
        "skiller:\n",
        "cxbridge: {executive: perhaps}\nskiller:\n",
        "executive",
        "scenario.yaml:20",
        command=DAEMON,
    ),
    Mistake(
        "the endpoint is not an address",
        "tcp//:1911",
        command=("daemon", "--no-executive", *NO_SERVER, "--endpoint", "tcp//:1911"),
    ),
    Mistake("the configuration is not there", "agnet", command=("daemon", "agnet")),
    Mistake("a word is not a policy", "--on-failure|on-failure", command=(*DAEMON, "--on-failure", "go on")),
)
