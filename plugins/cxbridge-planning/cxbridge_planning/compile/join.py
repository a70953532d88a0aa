"""A join, as in databases, over the reached facts: the objects for which an action's atoms are facts."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import product

from cxbridge.executive.pddl.ast import ActionSchema, And, Atom, Constant, Formula, Term, Variable
from cxbridge_planning.compile.conditions import Fact
from cxbridge_planning.objects import ObjectTable


class FactIndex:
    """Facts indexed by predicate, and by argument and position."""

    def __init__(self) -> None:
        self._by_predicate: dict[str, list[tuple[str, ...]]] = {}
        self._by_argument: dict[tuple[str, int, str], list[tuple[str, ...]]] = {}

    def add(self, fact: Fact) -> None:
        """Add a fact that is not in the index yet."""
        self._by_predicate.setdefault(fact.predicate, []).append(fact.arguments)
        for position, argument in enumerate(fact.arguments):
            self._by_argument.setdefault((fact.predicate, position, argument), []).append(fact.arguments)

    def find_candidates(self, atom: Atom, binding: dict[str, str]) -> Sequence[tuple[str, ...]]:
        """Return the arguments of facts: the shortest indexed list that contains all matches of an atom."""
        shortest: Sequence[tuple[str, ...]] = self._by_predicate.get(atom.predicate, ())
        for position, term in enumerate(atom.arguments):
            object_name = binding.get(term.name) if isinstance(term, Variable) else constant_name(term)
            if object_name is not None:
                arguments_with_object = self._by_argument.get((atom.predicate, position, object_name), ())
                shortest = min(shortest, arguments_with_object, key=len)
        return shortest


class SchemaToGround:
    """An action to ground: parameters and required atoms.

    :ivar action: the action.
    :ivar parameters: the permitted objects by parameter.
    :ivar atoms: the atoms that the condition always requires: those within no connective except ``and``.
    """

    def __init__(self, action: ActionSchema, objects: ObjectTable) -> None:
        self.action = action
        self.parameters = {
            name: objects.of_types(group.types) for group in action.parameters for name in group.names
        }
        self.atoms = list(_find_required_atoms(action.condition))

    def find_matches(
        self, index: FactIndex, trigger: tuple[int, Fact] | None = None
    ) -> Iterator[tuple[str, ...]]:
        """Yield the objects of the parameters for each way to satisfy the atoms.

        :param trigger: the position of an atom, and the fact that the atom must match. None: every
            atom may match any fact.
        """
        binding: dict[str, str] = {}
        atoms = list(self.atoms)
        if trigger is not None:
            position, fact = trigger
            if not self._unify(atoms.pop(position), fact.arguments, binding):
                return
        for full_binding in self._extend_binding(atoms, binding, index):
            # parameters that no atom mentions take every permitted object
            choices = [
                (full_binding[name],) if name in full_binding else objects
                for name, objects in self.parameters.items()
            ]
            yield from product(*choices)

    def _extend_binding(
        self, atoms: list[Atom], binding: dict[str, str], index: FactIndex
    ) -> Iterator[dict[str, str]]:
        """Yield the extensions of a binding that satisfy further atoms."""
        if not atoms:
            yield binding
            return
        # the atom with the fewest candidates first, which keeps the number of partial bindings low
        candidates_by_atom = [index.find_candidates(atom, binding) for atom in atoms]
        position = min(range(len(atoms)), key=lambda position: len(candidates_by_atom[position]))
        remaining_atoms = atoms[:position] + atoms[position + 1 :]
        for arguments in candidates_by_atom[position]:
            extended_binding = dict(binding)
            if self._unify(atoms[position], arguments, extended_binding):
                yield from self._extend_binding(remaining_atoms, extended_binding, index)

    def _unify(self, atom: Atom, arguments: tuple[str, ...], binding: dict[str, str]) -> bool:
        """Extend the binding so that an atom matches the arguments; return whether that is possible.

        If it is not, the binding may have some of the atom's variables.
        """
        for term, object_name in zip(atom.arguments, arguments, strict=True):
            if not isinstance(term, Variable):
                if constant_name(term) != object_name:
                    return False
            elif (
                binding.setdefault(term.name, object_name) != object_name
                or object_name not in self.parameters[term.name]
            ):
                return False
        return True


def constant_name(term: Term) -> str:
    """Return the name of a constant; empty for another term, which equals no object."""
    return term.name if isinstance(term, Constant) else ""


def _find_required_atoms(condition: Formula | None) -> Iterator[Atom]:
    """Yield the atoms that a condition requires in any case."""
    if isinstance(condition, Atom):
        yield condition
    elif isinstance(condition, And):
        for part in condition.parts:
            yield from _find_required_atoms(part)
