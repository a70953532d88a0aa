"""Evidence that is copied between loops and explained while the run continues."""

from __future__ import annotations

from collections.abc import Mapping

from cxbridge.errors import ClipsError
from cxbridge_studio.explain.evidence import Evidence, History
from cxbridge_studio.explain.rules.rewritten import as_written
from cxbridge_studio.explain.rules.snapshot import Rulebook, Snapshot


class CopiedEvidence(Evidence):
    """A copy of the evidence.

    :param times_us: start of the run, and the moment.
    :param snapshots: the rules in question, or the errors when copying them.
    :param facts: slots of facts by deftemplate.
    :param texts: defrules by name, as the environment prints them.
    """

    def __init__(
        self,
        where: str,
        times_us: tuple[int, int],
        history: History,
        book: Rulebook,
        snapshots: Mapping[str, Snapshot | ClipsError],
        facts: Mapping[str, list[Mapping[str, str]]],
        texts: Mapping[str, str],
    ) -> None:
        super().__init__(where, *times_us, history)
        self._book = book
        self._snapshots = snapshots
        self._facts = facts
        self._texts = texts
        self._written: Mapping[str, str] | None = None

    def rulebook(self) -> Rulebook:
        return self._book

    def snapshot(self, rule: str) -> Snapshot:
        copy = self._snapshots.get(rule)
        if isinstance(copy, Snapshot):
            return copy
        raise copy or ClipsError(f"the rule '{rule}' was not copied")

    def slots_of(self, template: str) -> list[Mapping[str, str]]:
        return self._facts.get(template, [])

    def rule_texts(self) -> Mapping[str, str]:
        if self._written is None:
            self._written = as_written(self._texts)
        return self._written
