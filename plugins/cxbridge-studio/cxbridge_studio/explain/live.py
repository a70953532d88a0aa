"""Evidence that was copied while the run stood still, to be looked into while it continues."""

from __future__ import annotations

from collections.abc import Mapping

from cxbridge.errors import ClipsError
from cxbridge_studio.explain.evidence import Evidence, History
from cxbridge_studio.explain.rules.rewritten import as_written
from cxbridge_studio.explain.rules.snapshot import Rulebook, Snapshot


class CopiedEvidence(Evidence):
    """The copied evidence.

    :param times_us: when the run began, and the moment.
    :param snapshots: the rules in the question, each with its state or why it could not be copied.
    :param facts: the facts of some deftemplates.
    :param texts: the defrules by name, as the environment has them.
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
        """Return which rules there are."""
        return self._book

    def snapshot(self, rule: str) -> Snapshot:
        """Return the snapshot of the rule."""
        found = self._snapshots.get(rule)
        if isinstance(found, Snapshot):
            return found
        raise found or ClipsError(f"the rule '{rule}' was not copied")

    def slots_of(self, template: str) -> list[Mapping[str, str]]:
        """Return the facts of a deftemplate."""
        return self._facts.get(template, [])

    def rule_texts(self) -> Mapping[str, str]:
        """Return all defrules by name."""
        if self._written is None:
            self._written = as_written(self._texts)
        return self._written
