"""Policies of a skill board that deviate from the tables in docs/skill-board.md."""

from __future__ import annotations

from dataclasses import dataclass

from cxbridge.skiller.board.master import Master


@dataclass(frozen=True, slots=True)
class BoardPolicy:
    """The policy of a board.

    :param ask_all: send REQUEST to all suitable executors at once. Answers after the first are rejected.
    :param ask_later: also ask executors that become idle later.
    :param answer_late: answer late messages about a finished master with REJECT or CANCEL.
    :param verbatim: local executors send exactly the yielded values as FEEDBACK.
    :param master: the class of the masters.
    """

    ask_all: bool = False
    ask_later: bool = True
    answer_late: bool = True
    verbatim: bool = False
    master: type[Master] = Master
