"""``cx::ExecutivePlugin``: ticks and time facts."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from cxbridge.clock import MICROSECONDS
from cxbridge.executive.host.facts.making import NumberFact
from cxbridge_ros2cx.cx.plugin import CxPlugin
from cxbridge_ros2cx.cx.stock import StockEnvironment
from cxbridge_ros2cx.refresh import RefreshTimer

if TYPE_CHECKING:
    from cxbridge.executive.host.environment import ClipsEnvironment
    from cxbridge_ros2.node import Publisher
    from cxbridge_ros2cx.cx.parameters import NodeParameters

CLASS: Final = "cx::ExecutivePlugin"
_REFRESHED: Final = "clips_executive/refresh_agenda"
_DEFAULT_HZ: Final = 10  # the original's default
_MAX_HZ: Final = 10_000
_SALIENCE: Final = "?*PRIORITY-TIME-RETRACT*"
# the time fact is retracted last, so that each rule has seen it before
_CONSTRUCTS: Final = (
    f"(defglobal {_SALIENCE} = -10000)",
    f"(defrule time-retract (declare (salience {_SALIENCE})) ?time <- (time $?) => (retract ?time))",
)


class ExecutivePlugin(CxPlugin):
    """Runs the rules of its environments at its rate, each time with a fact ``(time SECONDS)``."""

    refreshed_type = "std_msgs/msg/Empty"

    @property
    def refreshed_topic(self) -> str:
        return self.context.ros.full_name(_REFRESHED)

    def initialize(self) -> None:
        """Read the rate and start the timer."""
        self._asserts_time = self.parameters.get(self.parameter("assert_time"), default=True)
        self._timer = RefreshTimer(self.context.clock, period_us(self.name, self.parameters))
        self._times: dict[StockEnvironment, NumberFact] = {}
        self._refreshed: Publisher | None = None
        if self.parameters.get(self.parameter("publish_on_refresh"), default=False):
            self._refreshed = self.context.ros.node.create_publisher(
                self.refreshed_topic, self.refreshed_type
            )

    def init_context(self, env: ClipsEnvironment) -> None:
        """Define the time functions and the rule that retracts the time facts."""
        if isinstance(env, StockEnvironment):
            for name in ("now", "now-systime"):
                env.define(name, self._now_s)
            self._init_times(env)
        else:  # the environment of an inspection, in which no rule fires
            env.time_of = lambda time_us: (time_us / MICROSECONDS,)

    def _init_times(self, env: StockEnvironment) -> None:
        if env not in self._times:  # a plug-in that is loaded again only defines its functions
            for construct in _CONSTRUCTS:
                env.build(construct)
            env.eval("(unwatch facts time)")
            env.eval("(unwatch rules time-retract)")
            self._times[env] = NumberFact(env.env, "time")

    def _now_s(self) -> float:
        return self.context.clock.now_us() / MICROSECONDS

    def tick(self) -> None:
        """When a tick is due, run the rules of the environments in the order in which they were loaded."""
        if not self._timer.advance_if_due():
            return
        for env, time in list(self._times.items()):
            with env.lock:
                if self._asserts_time:
                    time.add(self._now_s())
                self.context.run_environment(env)
        if self._refreshed is not None:
            self._refreshed.publish({})

    def context_destroyed(self, env: ClipsEnvironment) -> None:
        """Stop running the rules of the environment."""
        time = self._times.pop(env, None) if isinstance(env, StockEnvironment) else None
        if time is not None:
            time.dispose()


def period_us(plugin: str, parameters: NodeParameters) -> int:
    """Return the time between two ticks of an executive plug-in.

    :raises ConfigError: if the rate is not an integer from 1 to 10000.
    """
    name = f"{plugin}.refresh_rate"
    rate = parameters.get(name, _DEFAULT_HZ)
    if not 0 < rate <= _MAX_HZ:
        raise parameters.wrong(name, f"cannot be {rate}", f"Hz, from 1 to {_MAX_HZ}")
    return MICROSECONDS // rate


def tick_period_us(parameters: NodeParameters) -> int:
    """Return the tick period of the fastest executive plug-in, by default that of the original."""
    plugins = [
        name.removesuffix(".plugin")
        for name, parameter in parameters
        if parameter.value == CLASS and "." in name
    ]
    return min((period_us(name, parameters) for name in plugins), default=MICROSECONDS // _DEFAULT_HZ)
