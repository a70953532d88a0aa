"""Mistakes on the command line."""

from __future__ import annotations

from typing import Final

from tests.mistakes.table.mistake import RUN, Mistake

MISTAKES: Final[tuple[Mistake, ...]] = (
    Mistake("the scenario is not there", "there is no such scenario", at="agnet", command=("run", "agnet")),
    Mistake(
        "the folder is not a scenario",
        "has no scenario.yaml",
        at="agent/skills",
        command=("run", "agent/skills"),
    ),
    Mistake("an option is misspelt", "No such option", command=(*RUN, "--timout", "5")),
    Mistake("a command is misspelt", "No such command", command=("rnu", "agent")),
    Mistake(
        "a value is none of those allowed", "--skiller cannot be 'luaa'", command=(*RUN, "--skiller", "luaa")
    ),
    Mistake("a number is none", "Invalid value for '--timeout'", command=(*RUN, "--timeout", "long")),
    Mistake("the spec is misspelt", "has no spec 'helo'", command=(*RUN, "--spec", "helo")),
    Mistake(
        "a folder is not there",
        "there is no such folder",
        at="skils",
        command=("run", "agent", "--skill-dir", "skils"),
    ),
    Mistake("an overlay is not there", "more.yaml", command=(*RUN, "--config", "more.yaml")),
    Mistake("no scenario is named", "no scenario given", command=("run",)),
    Mistake(
        "the folder of skills is forgotten",
        "skill space 'hello'",
        at="scenario.yaml:21",
        command=("run", "agent", "--interface-dir", "agent"),
    ),
    Mistake(
        "the recording overwrites the agent",
        "would overwrite this file",
        at="agent/hello-goals.clp",
        command=(*RUN, "--log", "agent/hello-goals.clp"),
    ),
    Mistake(
        "the URL of the Skiller is misspelt",
        "'tpc://127.0.0.1:1911'",
        command=(*RUN, "--skiller", "tpc://127.0.0.1:1911"),
    ),
)
