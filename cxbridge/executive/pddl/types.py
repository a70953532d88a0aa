"""The hierarchy of types, and the objects of each type.

An object belongs to its declared type and to all supertypes, so ``(?x - object)`` accepts every object.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator
from itertools import product

from cxbridge.executive.pddl.ast import ROOT_TYPE, Binding, Domain, Problem, TypedList, pairs_of

ObjectsOf = Callable[[tuple[str, ...]], Collection[str]]
"""Returns the objects of any of some types; without types all objects."""


class TypeHierarchy:
    """The declared types with their supertypes. Cycles are permitted; :mod:`.semantics` refuses them."""

    def __init__(self, types: TypedList) -> None:
        self.parents: dict[str, set[str]] = {}
        """The direct supertypes of each declared type; several supertypes if the type is declared several
        times."""
        for name, parent in pairs_of(types):
            self.parents.setdefault(name, set()).add(parent or ROOT_TYPE)

    def supertypes(self, type_: str) -> set[str]:
        """Return a type and all its supertypes, including ``object``."""
        ancestors = {ROOT_TYPE}
        queue = [type_]
        while queue:
            name = queue.pop()
            if name not in ancestors:
                ancestors.add(name)
                queue += self.parents.get(name, ())
        return ancestors


class ObjectTable:
    """The objects of a problem and the constants of its domain, by type."""

    def __init__(self, domain: Domain, problem: Problem) -> None:
        hierarchy = TypeHierarchy(domain.types)
        # dictionaries in place of sets: the order of declaration makes plans reproducible
        self._objects: dict[str, dict[str, None]] = {}
        for name, declared in (*pairs_of(domain.constants), *pairs_of(problem.objects)):
            for type_ in hierarchy.supertypes(declared or ROOT_TYPE):
                self._objects.setdefault(type_, {})[name] = None

    def of_types(self, types: tuple[str, ...]) -> dict[str, None]:
        """Return the objects of any of these types, in order of declaration; without types all objects."""
        objects: dict[str, None] = {}
        for type_ in types or (ROOT_TYPE,):
            objects |= self._objects.get(type_, {})
        return objects


def extended_bindings(variables: TypedList, binding: Binding, objects_of: ObjectsOf) -> Iterator[Binding]:
    """Yield ``binding`` extended by each choice of objects for the variables."""
    names = [name for group in variables for name in group.names]
    domains = [objects_of(group.types) for group in variables for _ in group.names]
    for choice in product(*domains):
        yield {**binding, **dict(zip(names, choice, strict=True))}
