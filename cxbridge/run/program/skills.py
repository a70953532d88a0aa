"""Skill executors made of plain functions."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Mapping, Sequence
from typing import Any, TypeAlias

from cxbridge.errors import SkillError
from cxbridge.skiller.board.executor import Progress, SkillExecutor, SkillFailedError, Steps, check_executor
from cxbridge.skiller.board.protocol import SkillCall

SkillFunction: TypeAlias = Callable[..., Any]
"""A function that implements a skill, with the skill's parameters.

A generator function takes one step per loop and yields its progress, 0 to 1. A plain function is called in
the loop after the skill's start, and must not block. An exception fails the skill. A returned text is the
skill's final message.
"""

Skills: TypeAlias = Sequence[type[SkillExecutor] | SkillFunction] | Mapping[str, SkillFunction]
"""Skills as classes and functions, or as functions by skill name."""


def make_executor_classes(skills: Skills) -> tuple[type[SkillExecutor], ...]:
    """Return an executor class for each skill.

    :raises SkillError: unless each object is a skill with a name.
    """
    if isinstance(skills, Mapping):
        return tuple(make_function_skill(function, name) for name, function in skills.items())
    return tuple(
        check_executor(skill)
        if isinstance(skill, type) and issubclass(skill, SkillExecutor)
        else make_function_skill(skill)
        for skill in skills
    )


def make_function_skill(function: SkillFunction, name: str = "") -> type[SkillExecutor]:
    """Return an executor class that calls a function.

    :param function: a function, or another callable object except a class.
    :param name: the name of the skill, by default the function's.
    :raises SkillError: if the object is not callable, is a class, or has no name.
    """
    if not callable(function) or isinstance(function, type):
        raise SkillError(
            f"{function!r} is not a skill",
            hint="give a subclass of cx.Skill, or a function with the skill's parameters",
        )
    skill = name or getattr(function, "__name__", "")
    # a lambda is called <lambda>, a functools.partial has no name
    if not skill.strip("<>") or skill.startswith("<"):
        raise SkillError("this function has no name", hint="give skills by name: skills={'say': function}")
    signature = inspect.signature(function)

    class FunctionSkill(SkillExecutor):
        skills = (skill,)

        def execute(self, call: SkillCall) -> Steps:
            arguments = _bind_arguments(signature, call)
            if not inspect.isgeneratorfunction(function):
                yield None  # one loop as RUNNING: the rules must see this state of each skill
            result = function(*arguments.args, **arguments.kwargs)
            result = (yield from result) if inspect.isgenerator(result) else result
            return Progress(1.0, result) if isinstance(result, str) else result

    FunctionSkill.__name__ = FunctionSkill.__qualname__ = skill
    FunctionSkill.__doc__ = inspect.getdoc(function)
    return FunctionSkill


def _bind_arguments(signature: inspect.Signature, call: SkillCall) -> inspect.BoundArguments:
    """Return the arguments of a call, bound to the function's parameters.

    :raises SkillFailedError: if the arguments do not fit the parameters.
    """
    # unnamed arguments of a skill string have their positions as names: 1, 2, ... 10
    positions = sorted(filter(str.isdigit, call.parameters), key=int)
    keywords = {name: value for name, value in call.parameters.items() if not name.isdigit()}
    try:
        return signature.bind(*(call.parameters[key] for key in positions), **keywords)
    except TypeError as error:
        raise SkillFailedError(
            f"{call.skill}{signature}: {error}; given: {', '.join(call.parameters) or 'none'}"
        ) from None
