"""The policy of a skill board towards executors, where the tables in docs/skill-board.md differ."""

from __future__ import annotations

from dataclasses import dataclass

from cxbridge.skiller.board.master import Master


@dataclass(frozen=True, slots=True)
class BoardPolicy:
    """Which executors a board asks, and what its masters are.

    :param ask_all: REQUEST goes to all executors that seem able, not to the first of them. An answer after
        the confirmation of another executor is rejected.
    :param ask_later: executors that become idle later are asked, too.
    :param answer_late: answers for a finished master are answered, with REJECT or CANCEL.
    :param verbatim: executors of this process send the yielded values as FEEDBACK, and nothing else.
    :param master: the class of the masters.
    """

    ask_all: bool = False
    ask_later: bool = True
    answer_late: bool = True
    verbatim: bool = False
    master: type[Master] = Master
