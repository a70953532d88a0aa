"""The objects of a problem by type."""

from __future__ import annotations

from cxbridge.executive.pddl.ast import ROOT_TYPE, Domain, Problem, TypedList, pairs_of


class ObjectTable:
    """The objects of a problem and the constants of its domain, by type.

    An object belongs to its type and all supertypes. ``object`` includes all.
    """

    def __init__(self, domain: Domain, problem: Problem) -> None:
        supers: dict[str, set[str]] = {}
        for name, super_type in pairs_of(domain.types):
            supers.setdefault(name, set()).add(super_type or ROOT_TYPE)
        self._of: dict[str, dict[str, None]] = {}
        for name, type_ in (*pairs_of(domain.constants), *pairs_of(problem.objects)):
            for each in _with_supers(type_ or ROOT_TYPE, supers):
                self._of.setdefault(each, {})[name] = None

    def of(self, types: tuple[str, ...]) -> dict[str, None]:
        """Return the objects of any of these types, in order of declaration; without types all objects."""
        if len(types) == 1:
            return self._of.get(types[0], {})
        found: dict[str, None] = {}
        for type_ in types or (ROOT_TYPE,):
            found |= self._of.get(type_, {})
        return found


def _with_supers(type_: str, supers: dict[str, set[str]]) -> set[str]:
    found = {ROOT_TYPE}
    queue = [type_]
    while queue:
        each = queue.pop()
        if each not in found:
            found.add(each)
            queue += supers.get(each, ())
    return found


def domains_of(parameters: TypedList, objects: ObjectTable) -> list[tuple[str, dict[str, None]]]:
    """Return each variable of a typed list with its possible objects."""
    return [(name, objects.of(group.types)) for group in parameters for name in group.names]
