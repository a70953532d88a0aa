"""The plug-in ``cx::ExecutivePlugin`` since pull request 33 of carologistics/clips_executive (June 2026).

A tick runs the rules in passes: each pass focuses on the CLIPS modules of a configured stack, one after
another, until no rule fires or a limit is reached. Services pause and resume the ticks, and evaluate CLIPS
commands.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from typing import TYPE_CHECKING, Any, Final

from clips._clips import ffi, lib

from cxbridge.errors import Ros2Error
from cxbridge.executive.host.capi import encode
from cxbridge.executive.host.values import Symbol
from cxbridge.rights import Right
from cxbridge_ros2cx.cx.plugins.executive import ExecutivePlugin
from cxbridge_ros2cx.cx.stock import StockEnvironment

if TYPE_CHECKING:
    from collections.abc import Callable

    from cxbridge_ros2.messages import Message

_MAIN_MODULE: Final = "MAIN"
# the texts of the ROS 2 CX for the error codes of CLIPS
_EVAL_ERRORS: Final = {
    "EE_PARSING_ERROR": "syntax error while parsing the expression.",
    "EE_PROCESSING_ERROR": "error occurred while executing the parsed expression.",
}
_BUILD_ERRORS: Final = {
    "BE_PARSING_ERROR": "syntax error while parsing the construct.",
    "BE_CONSTRUCT_NOT_FOUND_ERROR": "construct name not recognized.",
    "BE_COULD_NOT_BUILD_ERROR": "construct could not be added to the environment.",
}


class FocusStackExecutivePlugin(ExecutivePlugin):
    """Runs rules in passes until no rule fires.

    With the parameter ``assert_time``, there is a time fact in the first pass of a tick.
    """

    refresh_type = "std_msgs/msg/Int64"

    def initialize(self) -> None:
        """Read the parameters, start the timer and offer the services."""
        super().initialize()
        self._is_paused = not self.parameters.get(self.parameter("autostart"), default=True)
        if self.context.ros.has_peers:
            self._offer_services()

    @property
    def refresh_topic(self) -> str:
        return f"{self.parameters.name}/{self.name}/refresh_agenda"

    def _offer_services(self) -> None:
        node, prefix = self.context.ros.node, f"{self.parameters.name}/{self.name}"
        for name, trigger in (
            ("pause", partial(self._set_paused, is_paused=True, change="paused", state="paused")),
            ("resume", partial(self._set_paused, is_paused=False, change="resumed", state="running")),
            ("tick_once", self._tick_once),
        ):
            node.serve(f"{prefix}/{name}", "std_srvs/srv/Trigger", trigger, right=Right.CONTROL)
        try:  # the package cx_msgs with the types is missing if no workspace is named
            for name, command in (("eval", self._eval), ("build", self._build)):
                node.serve(f"{prefix}/{name}", "cx_msgs/srv/ClipsCommand", command, right=Right.PROGRAMS)
        except Ros2Error as error:
            self.log.warn(f"eval and build are not offered: {error.message}")

    def _define_time(self, env: StockEnvironment) -> None:
        # (unwatch facts time) needs the template, which the first fact creates
        index = env.assert_string(f"(time {self._now_s()})")
        env.eval("(unwatch facts time)")
        if index is not None:
            env.retract(index)
        if env not in self._environments:
            self._environments.append(env)

    # --- ticks --------------------------------------------------------------------------------------------

    def tick(self) -> None:
        """Run the rules of the environments when a tick is due, unless paused."""
        if self._timer.advance_if_due() and not self._is_paused:
            self._run_environments()

    def _run_environments(self) -> None:
        fired_count = 0
        for env in self._environments[:]:
            with env.lock:
                fired_count += self._run_passes(env)
        if self._refresh_publisher is not None:
            self._refresh_publisher.publish({"data": fired_count})

    def _run_passes(self, env: StockEnvironment) -> int:
        """Run passes until no rule fires or the limit is reached; return the number of fired rules.

        The parameter ``rule_limit`` of an environment is the limit; without the parameter, there is none.
        """
        stack, limit = self._read_focus_stack(env), self.parameters.get(f"{env.name}.rule_limit", -1)
        env.call("set-current-module", Symbol(_MAIN_MODULE))
        time_fact = env.assert_ordered("time", (self._now_s(),)) if self._asserts_time else None
        fired_count = 0
        while True:
            pass_fired_count = self._run_pass(env, stack, limit)
            if time_fact is not None:  # the time fact is for the first pass only
                env.retract(time_fact)
                time_fact = None
            fired_count += pass_fired_count
            if not pass_fired_count:
                return fired_count
            if 0 <= limit <= fired_count:
                self.log.error(f"Env '{env.name}': Rule fire limit of {limit} was reached.")
                return fired_count

    def _run_pass(self, env: StockEnvironment, stack: list[str], limit: int) -> int:
        """Focus on each module of the stack and run its rules; return the number of fired rules.

        :param limit: the maximum number of firings for an empty stack; a negative number for no limit. As in
            the ROS 2 CX, the modules of a stack run without a limit.
        """
        if not stack:
            env.refresh_agenda()
            return env.run(limit)
        fired_count = 0
        for module in stack:
            if stack != [_MAIN_MODULE]:  # in a stack of MAIN alone, MAIN has the focus already
                env.call("focus", Symbol(module))
            fired_count += self.context.run_environment(env)
        return fired_count

    def _read_focus_stack(self, env: StockEnvironment) -> list[str]:
        """Return the modules of the focus stack, by default MAIN; log and omit unknown modules."""
        name = f"{env.name}.focus_stack"
        if self.parameters.find(name) is None:
            return [_MAIN_MODULE]
        modules = []
        for module in self.parameters.get_strings(name):
            if lib.FindDefmodule(env.c_env, encode(module)) == ffi.NULL:
                self.log.error(f"Focus stack entry '{module}' is not a valid module, removing from stack.")
            else:
                modules.append(module)
        return modules

    # --- services -----------------------------------------------------------------------------------------

    def _set_paused(self, _request: Message, *, is_paused: bool, change: str, state: str) -> Message:
        if self._is_paused == is_paused:
            return {"success": False, "message": f"executive already {state}."}
        self._is_paused = is_paused
        self.log.info(f"executive {change}.")
        return {"success": True, "message": f"executive {change}."}

    def _tick_once(self, _request: Message) -> Message:
        self._run_environments()
        return {"success": True, "message": "Tick executed."}

    def _run_command(
        self,
        request: Message,
        execute: Callable[[StockEnvironment, bytes], int],
        operation: str,
        reasons_by_code: dict[str, str],
    ) -> Mapping[str, Any]:
        """Execute a CLIPS command in an environment, and return the response.

        :param execute: executes the encoded command, and returns the code of CLIPS for success or an error.
        :param operation: the noun for the command in the response.
        :param reasons_by_code: the reasons of failures by the names of the error codes.
        """
        name = request["env_name"]
        # an empty name means the first environment
        env = next((env for env in self._environments if name in ("", env.name)), None)
        if env is None:
            return {
                "success": False,
                "message": f"Environment '{name}' not found."
                if self._environments
                else "No environments available.",
            }
        with env.lock:
            code = execute(env, encode(request["command"]))
            env.api.clear_halt()  # an error in the command would halt the next run of the rules, too
        reason = next(
            (text for code_name, text in reasons_by_code.items() if getattr(lib, code_name) == code), ""
        )
        return {"success": not reason, "message": f"{operation} failed: {reason}" if reason else ""}

    def _eval(self, request: Message) -> Mapping[str, Any]:
        return self._run_command(
            request,
            lambda env, command: int(lib.Eval(env.c_env, command, ffi.new("CLIPSValue *"))),
            "Eval",
            _EVAL_ERRORS,
        )

    def _build(self, request: Message) -> Mapping[str, Any]:
        return self._run_command(
            request, lambda env, command: int(lib.Build(env.c_env, command)), "Build", _BUILD_ERRORS
        )
