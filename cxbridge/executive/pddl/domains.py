"""Items to domains: the sections and the actions."""

from __future__ import annotations

from typing import Any, Final

from cxbridge.executive.pddl.ast import ActionSchema, Domain, Function, Position, Predicate
from cxbridge.executive.pddl.brackets import BracketWord, Group, Item
from cxbridge.executive.pddl.formulas import FormulaParser

_SECTIONS: Final = (":requirements", ":types", ":constants", ":predicates", ":functions")
_ACTIONS: Final = frozenset({":action", ":durative-action"})
_ACTION_KEYS: Final = {
    ":parameters": "parameters",
    ":duration": "duration",
    ":precondition": "condition",
    ":condition": "condition",
    ":effect": "effect",
    ":conditional-breakup": "conditional_breakup",
    ":temporal-breakup": "temporal_breakup",
}
_ACTION_ORDER: Final = tuple(dict.fromkeys(_ACTION_KEYS.values()))


class DomainParser(FormulaParser):
    """Makes domains of items."""

    def domain(self, items: tuple[Item, ...]) -> Domain:
        """Return the domain that a text holds.

        :raises PddlSyntaxError: when it holds no domain, or an odd one.
        """
        if not items:
            raise self.error(
                "there is no domain in this text", Position(), "write (define (domain NAME) ...)"
            )
        define = items[0]
        if not isinstance(define, Group) or define.head != "define":
            raise self.error("a domain must start with (define (domain NAME)", define.position)
        if len(items) > 1 and not self.fawkes_compat:
            raise self.error("there is text after the end of the domain", items[1].position)
        name = define.items[1] if len(define.items) > 1 else define
        if not isinstance(name, Group) or name.head != "domain" or len(name.items) != 2:  # noqa: PLR2004
            raise self.error("(domain NAME) is expected after 'define'", name.position)
        word = name.items[1]
        if not isinstance(word, BracketWord):
            raise self.error("the name of the domain is expected", word.position)
        fields = self._sections(define.items[2:])
        if self.fawkes_compat:
            self._need_sections(fields, define.position)
        return Domain(word.text, **fields, file=self.file)

    def _sections(self, items: tuple[Item, ...]) -> dict[str, Any]:
        fields: dict[str, Any] = {}
        actions: list[ActionSchema] = []
        for item in items:
            if not isinstance(item, Group) or not item.head.startswith(":"):
                if actions and self.fawkes_compat:
                    break
                raise self.error("a section such as (:action ...) is expected", item.position)
            if item.head in _ACTIONS:
                actions.append(self.action(item))
            elif item.head in _SECTIONS:
                if actions and self.fawkes_compat:
                    break
                self._section(item, fields)
            elif actions and self.fawkes_compat:
                break
            else:
                raise self.error(
                    f"unknown section {item.head}",
                    item.position,
                    f"the sections are {', '.join(_SECTIONS)} and {', '.join(sorted(_ACTIONS))}",
                )
        return {**fields, "actions": tuple(actions)}

    def _section(self, section: Group, fields: dict[str, Any]) -> None:
        key = section.head[1:]
        if key in fields:
            raise self.error(f"there is a second section {section.head}", section.position, "join them")
        if self.fawkes_compat and any(
            _SECTIONS.index(f":{done}") > _SECTIONS.index(section.head) for done in fields
        ):
            raise self.error(f"Fawkes' parser refuses this: {section.head} comes too late", section.position)
        rest = section.items[1:]
        if key == "requirements":
            fields[key] = tuple(self._requirement(item) for item in rest)
        elif key == "types":
            fields[key] = self.typed_list(rest, "a type", variables=False)
        elif key == "constants":
            fields[key] = self.typed_list(rest, "a constant", variables=False)
        elif key == "predicates":
            fields[key] = tuple(Predicate(*self._declaration(item, "predicate")) for item in rest)
        else:
            fields[key] = self._functions(rest)

    def _requirement(self, item: Item) -> str:
        if isinstance(item, BracketWord) and item.text.startswith(":") and len(item.text) > 1:
            return item.text[1:]
        raise self.error("a requirement is expected", item.position, "such as :strips or :typing")

    def _declaration(self, item: Item, what: str) -> tuple[str, Any, Position]:
        if not isinstance(item, Group) or not item.items:
            raise self.error(f"a {what} is expected", item.position, "write it in brackets: (NAME ?x - TYPE)")
        name = self.name(item.items[0], f"the name of a {what}")
        return name, self.typed_list(item.items[1:], "a parameter", variables=True), item.position

    def _functions(self, items: tuple[Item, ...]) -> tuple[Function, ...]:
        """Read functions; the type of their value may follow, and can only be ``number``."""
        functions: list[Function] = []
        rest = iter(items)
        for item in rest:
            if isinstance(item, BracketWord) and item.text == "-" and functions:
                value = next(rest, item)
                if not isinstance(value, BracketWord) or value.text != "number":
                    raise self.error(
                        "the value of a function can only be a number", value.position, "write - number"
                    )
                continue
            functions.append(Function(*self._declaration(item, "function")))
        return tuple(functions)

    def _need_sections(self, fields: dict[str, Any], position: Position) -> None:
        for key, filled in (("requirements", False), ("predicates", True), ("actions", True)):
            if key not in fields or (filled and not fields[key]):
                raise self.error(f"Fawkes' parser refuses this: there are no {key}", position)

    # ---- actions

    def action(self, section: Group) -> ActionSchema:
        """Return the action that a section holds."""
        if len(section.items) < 2:  # noqa: PLR2004
            raise self.error("this action has no name", section.position)
        name = self.name(section.items[1], "the name of an action")
        fields: dict[str, Any] = {}
        rest = iter(section.items[2:])
        for key_item in rest:
            text, key = self._action_key(key_item, name, fields)
            value = next(rest, None)
            if value is None or (isinstance(value, BracketWord) and value.text in _ACTION_KEYS):
                raise self.error(f"{text} of action {name} is missing its value", key_item.position)
            fields[key] = self._action_value(key, value)
        if self.fawkes_compat:
            self._need_keys(name, fields, section.position)
        return ActionSchema(
            name, **fields, durative=section.head == ":durative-action", position=section.position
        )

    def _action_key(self, item: Item, action: str, fields: dict[str, Any]) -> tuple[str, str]:
        """Return the keyword of a part of an action, and the field it belongs to."""
        text = item.text if isinstance(item, BracketWord) else f"({item.head} ...)"
        key = _ACTION_KEYS.get(text)
        if key is None:
            raise self.error(
                f"unexpected '{text}' in action {action}",
                item.position,
                "a ')' may be missing before it"
                if text.startswith("(:")
                else f"expected: {', '.join(_ACTION_KEYS)}",
            )
        if key in fields:
            raise self.error(f"action {action} has {text} twice", item.position, "join them with (and ...)")
        order = [_ACTION_ORDER.index(done) for done in fields]
        if self.fawkes_compat and any(index > _ACTION_ORDER.index(key) for index in order):
            raise self.error(f"Fawkes' parser refuses this: {text} comes too late", item.position)
        return text, key

    def _action_value(self, key: str, value: Item) -> Any:
        if key == "parameters":
            if not isinstance(value, Group):
                raise self.error("the parameters must be in brackets", value.position, "(?x - TYPE ...)")
            return self.typed_list(value.items, "a parameter", variables=True)
        return self.effect(value) if key == "effect" else self.condition(value)

    def _need_keys(self, action: str, fields: dict[str, Any], position: Position) -> None:
        for key in ("parameters", "condition", "effect"):
            if key not in fields:
                raise self.error(f"Fawkes' parser refuses this: action {action} has no {key}", position)
