"""PDDL executed as its definition says, object by object: slow, plain, and not the code under test."""

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
    """A problem, and what can be done in it."""

    def __init__(self, domain, problem):
        self.domain, self.problem = domain, problem
        supers: dict[str, set[str]] = {}
        for name, above in pairs_of(domain.types):
            supers.setdefault(name, set()).add(above or "object")
        self.types: dict[str, set[str]] = {}
        for name, type_ in (*pairs_of(domain.constants), *pairs_of(problem.objects)):
            seen, queue = {"object"}, [type_ or "object"]
            while queue:
                each = queue.pop()
                if each not in seen:
                    seen.add(each)
                    queue += supers.get(each, ())
            self.types.setdefault(name, set()).update(seen)
        self.initial = frozenset((a.predicate, tuple(t.name for t in a.arguments)) for a in problem.init)

    def objects(self, types):
        return [name for name, has in self.types.items() if not types or has & set(types)]

    def choices(self, variables):
        names = names_of(variables)
        pools = [self.objects(group.types) for group in variables for _ in group.names]
        return [dict(zip(names, choice, strict=True)) for choice in product(*pools)]

    def holds(self, formula, state, binding):  # noqa: PLR0911  a case for each kind of formula
        match formula:
            case None:
                return True
            case Atom():
                return self.fact(formula, binding) in state
            case And(parts=parts):
                return all(self.holds(part, state, binding) for part in parts)
            case Or(parts=parts):
                return any(self.holds(part, state, binding) for part in parts)
            case Not(part=part):
                return not self.holds(part, state, binding)
            case Imply(condition=first, consequence=second):
                return not self.holds(first, state, binding) or self.holds(second, state, binding)
            case TermComparison(left=left, right=right):
                return self.object(left, binding) == self.object(right, binding)
            case Quantified(quantifier=quantifier, variables=variables, part=part):
                each = (self.holds(part, state, {**binding, **more}) for more in self.choices(variables))
                return all(each) if quantifier == "forall" else any(each)
        raise AssertionError(formula)

    @staticmethod
    def object(term, binding):
        return binding[term.name] if isinstance(term, Variable) else term.name

    def fact(self, atom, binding):
        return atom.predicate, tuple(self.object(term, binding) for term in atom.arguments)

    def changes(self, effect, state, binding):
        """Yield fact and truth of each change."""
        match effect:
            case Atom():
                yield self.fact(effect, binding), True
            case Not(part=part):
                yield self.fact(part, binding), False
            case And(parts=parts):
                for part in parts:
                    yield from self.changes(part, state, binding)
            case When(condition=condition, effect=part):
                if self.holds(condition, state, binding):
                    yield from self.changes(part, state, binding)
            case Quantified(variables=variables, part=part):
                for more in self.choices(variables):
                    yield from self.changes(part, state, {**binding, **more})

    def after(self, state, action, binding):
        """The state after an action; None when it cannot be done."""
        if not self.holds(action.condition, state, binding):
            return None
        changes = list(self.changes(action.effect, state, binding))
        adds = {fact for fact, true in changes if true}
        return (state - {fact for fact, true in changes if not true}) | adds

    def is_solution(self, plan):
        """Whether a plan can be done and ends in the goal."""
        state = self.initial
        for step in plan:
            (action,) = (each for each in self.domain.actions if each.name == step.name)
            binding = dict(zip(names_of(action.parameters), step.arguments, strict=True))
            assert binding in self.choices(action.parameters)
            state = self.after(state, action, binding)
            if state is None:
                return False
        return self.holds(self.problem.goal, state, {})

    def solvable(self):
        """Whether some state that can be reached is a goal: all of them are looked at."""
        seen, queue = {self.initial}, [self.initial]
        while queue:
            state = queue.pop()
            if self.holds(self.problem.goal, state, {}):
                return True
            for action in self.domain.actions:
                for binding in self.choices(action.parameters):
                    then = self.after(state, action, binding)
                    if then is not None and then not in seen:
                        seen.add(then)
                        queue.append(then)
        return False
