"""A join over known facts: the bindings that satisfy all atoms of a condition."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import product

from cxbridge.executive.pddl.ast import Atom, Variable
from cxbridge.executive.planning.compile.conditions import Fact


class FactIndex:
    """Facts indexed by predicate, and by argument and position."""

    def __init__(self) -> None:
        self._all: dict[str, list[tuple[str, ...]]] = {}
        self._by_argument: dict[tuple[str, int, str], list[tuple[str, ...]]] = {}

    def add(self, fact: Fact) -> None:
        """Add a new fact."""
        self._all.setdefault(fact.predicate, []).append(fact.arguments)
        for position, argument in enumerate(fact.arguments):
            self._by_argument.setdefault((fact.predicate, position, argument), []).append(fact.arguments)

    def candidates(self, atom: Atom, binding: dict[str, str]) -> Sequence[tuple[str, ...]]:
        """Return the shortest indexed list that contains all matches of an atom."""
        best: Sequence[tuple[str, ...]] = self._all.get(atom.predicate, ())
        for position, term in enumerate(atom.arguments):
            value = binding.get(term.name) if isinstance(term, Variable) else _name(term)
            if value is not None:
                found = self._by_argument.get((atom.predicate, position, value), ())
                if len(found) < len(best):
                    best = found
        return best


class Schema:
    """An action to ground: parameters and required atoms.

    :param parameters: names with their permitted objects.
    :param atoms: the atoms outside of ``or``, ``not`` ...
    """

    def __init__(self, parameters: list[tuple[str, dict[str, None]]], atoms: Sequence[Atom]) -> None:
        self.parameters = parameters
        self.atoms = atoms
        self._allowed = dict(parameters)

    def matches(
        self, index: FactIndex, first: int | None = None, fact: Fact | None = None
    ) -> Iterator[tuple[str, ...]]:
        """Yield the parameters' objects for each way to satisfy the atoms.

        :param first: the index of the atom that must match ``fact``.
        """
        binding: dict[str, str] = {}
        rest = list(self.atoms)
        if first is not None and fact is not None:
            atom = rest.pop(first)
            if self._unify(atom, fact.arguments, binding) is None:
                return
        for complete in self._extend(rest, binding, index):
            free = [((complete[name],) if name in complete else objects) for name, objects in self.parameters]
            yield from product(*free)

    def _extend(
        self, atoms: list[Atom], binding: dict[str, str], index: FactIndex
    ) -> Iterator[dict[str, str]]:
        if not atoms:
            yield binding
            return
        sized = [(index.candidates(atom, binding), number) for number, atom in enumerate(atoms)]
        candidates, number = min(sized, key=lambda each: len(each[0]))
        rest = atoms[:number] + atoms[number + 1 :]
        for arguments in candidates:
            inner = dict(binding)
            if self._unify(atoms[number], arguments, inner) is not None:
                yield from self._extend(rest, inner, index)

    def _unify(
        self, atom: Atom, arguments: tuple[str, ...], binding: dict[str, str]
    ) -> dict[str, str] | None:
        """Extend the binding so that an atom matches the arguments; None if impossible."""
        for term, value in zip(atom.arguments, arguments, strict=True):
            if not isinstance(term, Variable):
                if _name(term) != value:
                    return None
            elif binding.setdefault(term.name, value) != value or value not in self._allowed[term.name]:
                return None
        return binding


def _name(term: object) -> str:
    return str(getattr(term, "name", ""))
