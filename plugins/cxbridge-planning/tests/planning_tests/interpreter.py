"""A slow and plain interpreter of PDDL, independent of the code under test."""

from __future__ import annotations

from itertools import product

from cxbridge.executive.pddl.ast import (
    And,
    Atom,
    Imply,
    Not,
    Or,
    Quantified,
    TermComparison,
    Variable,
    When,
    names_of,
    pairs_of,
)


class World:
    """A problem with its states and actions."""

    def __init__(self, domain, problem):
        self.domain, self.problem = domain, problem
        supertypes: dict[str, set[str]] = {}
        for name, supertype in pairs_of(domain.types):
            supertypes.setdefault(name, set()).add(supertype or "object")
        self.types: dict[str, set[str]] = {}
        for name, type_ in (*pairs_of(domain.constants), *pairs_of(problem.objects)):
            seen, queue = {"object"}, [type_ or "object"]
            while queue:
                each = queue.pop()
                if each not in seen:
                    seen.add(each)
                    queue += supertypes.get(each, ())
            self.types.setdefault(name, set()).update(seen)
        self.initial = frozenset((a.predicate, tuple(t.name for t in a.arguments)) for a in problem.init)

    def objects(self, types):
        return [
            name for name, types_of_object in self.types.items() if not types or types_of_object & set(types)
        ]

    def choices(self, variables):
        names = names_of(variables)
        pools = [self.objects(group.types) for group in variables for _ in group.names]
        return [dict(zip(names, choice, strict=True)) for choice in product(*pools)]

    def is_true(self, formula, state, binding):  # noqa: PLR0911  a case for each kind of formula
        match formula:
            case None:
                return True
            case Atom():
                return self.fact(formula, binding) in state
            case And(parts=parts):
                return all(self.is_true(part, state, binding) for part in parts)
            case Or(parts=parts):
                return any(self.is_true(part, state, binding) for part in parts)
            case Not(part=part):
                return not self.is_true(part, state, binding)
            case Imply(condition=first, consequence=second):
                return not self.is_true(first, state, binding) or self.is_true(second, state, binding)
            case TermComparison(left=left, right=right):
                return self.object(left, binding) == self.object(right, binding)
            case Quantified(quantifier=quantifier, variables=variables, part=part):
                each = (self.is_true(part, state, {**binding, **more}) for more in self.choices(variables))
                return all(each) if quantifier == "forall" else any(each)
        raise AssertionError(formula)

    @staticmethod
    def object(term, binding):
        return binding[term.name] if isinstance(term, Variable) else term.name

    def fact(self, atom, binding):
        return atom.predicate, tuple(self.object(term, binding) for term in atom.arguments)

    def changes(self, effect, state, binding):
        """Yield the fact of each change, and whether the change adds the fact."""
        match effect:
            case Atom():
                yield self.fact(effect, binding), True
            case Not(part=part):
                yield self.fact(part, binding), False
            case And(parts=parts):
                for part in parts:
                    yield from self.changes(part, state, binding)
            case When(condition=condition, effect=part):
                if self.is_true(condition, state, binding):
                    yield from self.changes(part, state, binding)
            case Quantified(variables=variables, part=part):
                for more in self.choices(variables):
                    yield from self.changes(part, state, {**binding, **more})

    def apply(self, state, action, binding):
        """Return the state after an action, or None if the action is impossible."""
        if not self.is_true(action.condition, state, binding):
            return None
        changes = list(self.changes(action.effect, state, binding))
        adds = {fact for fact, is_added in changes if is_added}
        return (state - {fact for fact, is_added in changes if not is_added}) | adds

    def is_solution(self, plan):
        """Whether a plan is possible and reaches the goal."""
        state = self.initial
        for step in plan:
            (action,) = (each for each in self.domain.actions if each.name == step.name)
            binding = dict(zip(names_of(action.parameters), step.arguments, strict=True))
            assert binding in self.choices(action.parameters)
            state = self.apply(state, action, binding)
            if state is None:
                return False
        return self.is_true(self.problem.goal, state, {})

    def is_solvable(self):
        """Whether any reachable state fulfils the goal, by a search of all states."""
        seen, queue = {self.initial}, [self.initial]
        while queue:
            state = queue.pop()
            if self.is_true(self.problem.goal, state, {}):
                return True
            for action in self.domain.actions:
                for binding in self.choices(action.parameters):
                    next_state = self.apply(state, action, binding)
                    if next_state is not None and next_state not in seen:
                        seen.add(next_state)
                        queue.append(next_state)
        return False
