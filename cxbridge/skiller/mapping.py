"""Mapping of actions to skill strings by the templates of ``action-mapping``.

Fawkes pastes values unchanged, so a quote in a value ends the string early and the rest runs as Lua code.
``mode='strict'``, the default, preserves values: it escapes quotes, backslashes, line ends and NUL, and
refuses values outside of quotes that are not a single word or number. See ``docs/skiller.md``.
"""

from __future__ import annotations

from collections.abc import Mapping

from msgspec import Struct

from cxbridge.events import Level
from cxbridge.skiller import numbers, quoting, replacing
from cxbridge.skiller.backend import Mode
from cxbridge.skiller.templates import (
    PLACEHOLDER_FORM,
    IgnoredStep,
    Placeholder,
    Replacement,
    find_suspected_placeholders,
    parse_template,
)

Message = tuple[Level, str]
"""A log line about a mapping."""


class MappedSkill(Struct, frozen=True):
    """The result of mapping an action.

    :param text: the skill string; empty after an error.
    :param messages: errors, then warnings.
    """

    text: str
    messages: tuple[Message, ...] = ()


class _CannotMapError(Exception):
    """An action cannot be mapped. Never leaves this module."""


class ActionSkillMapping:
    """Maps actions to skill strings.

    :param mapping: the templates by the names of the actions.
    :param mode: ``strict`` or ``fawkes``.
    """

    def __init__(self, mapping: Mapping[str, str], *, mode: Mode = "strict") -> None:
        self.mode: Mode = mode
        self._templates = dict(mapping)

    @property
    def actions(self) -> tuple[str, ...]:
        """The actions with a template."""
        return tuple(self._templates)

    def has_template(self, action: str) -> bool:
        return action in self._templates

    def map(self, action: str, params: Mapping[str, str]) -> MappedSkill:
        """Return the skill string of an action; empty and without messages if the action has no template."""
        # as in Fawkes, a missing template is not an error: callers check has_template()
        template = self._templates.get(action)
        if template is None:
            return MappedSkill("")
        messages: list[Message] = []
        skill_string = ""
        try:
            for part in parse_template(template):
                if isinstance(part, str):
                    skill_string = self._concatenate(action, skill_string, part)
                else:
                    value = _look_up(part, action, params)
                    value_text = self._format_value(part, _apply_steps(part, value, messages), skill_string)
                    skill_string = self._concatenate(action, skill_string, value_text)
        except _CannotMapError as error:
            messages.insert(0, (Level.ERROR, str(error)))
            return MappedSkill("", tuple(messages))
        return MappedSkill(skill_string, tuple(messages))

    def check(self) -> list[Message]:
        """Return warnings about texts that resemble placeholders, and about invalid expressions."""
        # such a text stays in the skill string, where the skill would get it
        warnings: list[Message] = []
        for action, template in self._templates.items():
            warnings.extend(
                (
                    Level.WARN,
                    f"action-mapping/{action}: '{text}' is kept as text: write {PLACEHOLDER_FORM}",
                )
                for text in find_suspected_placeholders(template)
            )
            for part in parse_template(template):
                if isinstance(part, Placeholder):
                    warnings.extend(
                        (Level.WARN, f"action-mapping/{action}: ?({part.name}...): {mistake}")
                        for mistake in map(_find_step_mistake, part.steps)
                        if mistake
                    )
        return warnings

    def _format_value(self, placeholder: Placeholder, value: str, prefix: str) -> str:
        """Return the text of a value to append to ``prefix``, the skill string so far.

        :raises _CannotMapError: if the value is not a number although the placeholder needs one, or cannot
            be escaped.
        """
        try:
            if placeholder.kind == "i":
                return numbers.parse_leading_integer(value)
            if placeholder.kind == "f":
                return numbers.parse_leading_float(value)
        except numbers.NumberError as error:
            type_name = "integer" if placeholder.kind == "i" else "float"
            raise _CannotMapError(f"Failed to convert '{value}' to {type_name}: {error}") from None
        # s and S quote the value, y and Y do not; S and Y convert the value to upper case
        if placeholder.kind in "SY":
            value = _to_upper(value)
        if placeholder.kind in "sS":
            escaped_value = self._escape_value(placeholder, value, f'{prefix}"')
            return f'"{escaped_value}"'
        return self._escape_value(placeholder, value, prefix)

    def _concatenate(self, action: str, prefix: str, suffix: str) -> str:
        """Return the concatenation of two parts of a skill string.

        :raises _CannotMapError: if the parts make a comment, in the mode ``strict``.
        """
        if self.mode == "strict" and quoting.makes_comment(prefix, suffix):
            raise _CannotMapError(
                f"'{prefix}' and '{suffix}' make the comment '--': leave a space between them in the "
                f"action mapping of '{action}'"
            )
        return prefix + suffix

    def _escape_value(self, placeholder: Placeholder, value: str, prefix: str) -> str:
        """Return the text of a value to append to ``prefix``, escaped unless the mode is ``fawkes``.

        :raises _CannotMapError: if the value cannot be escaped.
        """
        return _escape_for_lua(placeholder, value, prefix) if self.mode == "strict" else value


def _look_up(placeholder: Placeholder, action: str, params: Mapping[str, str]) -> str:
    """Return the value of a placeholder.

    :raises _CannotMapError: if the action has no such parameter.
    """
    try:
        return params[placeholder.name]
    except KeyError:
        raise _CannotMapError(
            f"No value for parameter '{placeholder.name}' of action '{action}' given"
        ) from None


def _apply_steps(placeholder: Placeholder, value: str, messages: list[Message]) -> str:
    """Return a value after the replacements of a placeholder; add warnings to the messages.

    :raises _CannotMapError: if the pattern of a replacement is invalid.
    """
    for step in placeholder.steps:
        if isinstance(step, IgnoredStep):
            messages.append((Level.WARN, step.warning))
            continue
        try:
            value = replacing.replace_all(step.pattern, step.replacement, value)
        except replacing.PatternError as error:
            # Fawkes does not catch the exception of std::regex here
            raise _CannotMapError(f"Invalid regex '{step.pattern}': {error}") from None
    return value


def _find_step_mistake(step: Replacement | IgnoredStep) -> str:
    """Return the mistake in a step, or an empty text."""
    if isinstance(step, IgnoredStep):
        return step.warning.strip()
    try:
        replacing.compile_pattern(step.pattern)
    except replacing.PatternError as error:
        return f"invalid regex '{step.pattern}': {error}"
    return ""


def _escape_for_lua(placeholder: Placeholder, value: str, prefix: str) -> str:
    """Return the text of a value to append to ``prefix``, escaped so that Lua cannot run it.

    :raises _CannotMapError: if the value follows a backslash in quotes, or is not in quotes and is not
        a single word or number.
    """
    context = quoting.context_at_end(prefix)
    if context in (quoting.QuotingContext.DOUBLE_QUOTES, quoting.QuotingContext.SINGLE_QUOTES):
        return quoting.escape(value, context.value)
    if context is quoting.QuotingContext.ESCAPE:
        raise _CannotMapError(
            f"Value '{value}' of parameter '{placeholder.name}' follows a backslash, which would escape the "
            "first character of the value: remove the backslash from the action mapping"
        )
    if not quoting.is_word(value):
        raise _CannotMapError(
            f"Value '{value}' of parameter '{placeholder.name}' is not a single word or number and stands "
            f"unquoted in the skill string: use ?({placeholder.name})s (docs/skiller.md)"
        )
    return value


def _to_upper(value: str) -> str:
    """Upper-case only ASCII letters, as C's ``toupper`` does in its default locale."""
    return "".join(char.upper() if char.isascii() else char for char in value)
