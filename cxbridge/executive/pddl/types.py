"""The hierarchy of types, and the choices of objects for variables."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator
from itertools import product

from cxbridge.executive.pddl.ast import ROOT_TYPE, Binding, TypedList, names_of, pairs_of

ObjectsOf = Callable[[tuple[str, ...]], Collection[str]]
"""Returns the objects that belong to one of the types; without types all objects."""


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
        supertypes = {ROOT_TYPE}
        pending = [type_]
        while pending:
            name = pending.pop()
            if name not in supertypes:
                supertypes.add(name)
                pending += self.parents.get(name, ())
        return supertypes


def extended_bindings(variables: TypedList, binding: Binding, objects_of: ObjectsOf) -> Iterator[Binding]:
    """Yield ``binding`` extended by each choice of objects for the variables."""
    object_choices = [objects_of(group.types) for group in variables for _ in group.names]
    for choice in product(*object_choices):
        yield {**binding, **dict(zip(names_of(variables), choice, strict=True))}
