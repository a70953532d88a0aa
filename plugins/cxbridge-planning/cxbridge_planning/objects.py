"""The objects of each type.

An object belongs to its declared type and to all supertypes of that type, so ``(?x - object)`` accepts
every object.
"""

from __future__ import annotations

from cxbridge.executive.pddl.ast import ROOT_TYPE, Domain, Problem, pairs_of
from cxbridge.executive.pddl.types import TypeHierarchy


class ObjectTable:
    """The objects of a problem and the constants of its domain, by type."""

    def __init__(self, domain: Domain, problem: Problem) -> None:
        hierarchy = TypeHierarchy(domain.types)
        # dictionaries in place of sets: the order of declaration makes plans reproducible
        self._objects_by_type: dict[str, dict[str, None]] = {}
        for name, declared_type in (*pairs_of(domain.constants), *pairs_of(problem.objects)):
            for type_ in hierarchy.supertypes(declared_type or ROOT_TYPE):
                self._objects_by_type.setdefault(type_, {})[name] = None

    def of_types(self, types: tuple[str, ...]) -> dict[str, None]:
        """Return the objects of any of these types; without types all objects.

        The objects of a type have the order of their declaration; the types have the given order.
        """
        objects: dict[str, None] = {}
        for type_ in types or (ROOT_TYPE,):
            objects |= self._objects_by_type.get(type_, {})
        return objects
