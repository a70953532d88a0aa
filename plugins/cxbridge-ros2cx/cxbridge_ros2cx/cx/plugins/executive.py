"""The plug-in ``cx::ExecutivePlugin``: runs the rules of its environments at a fixed rate."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from cxbridge.clock import MICROSECONDS
from cxbridge_ros2cx.cx.plugin import CxPlugin
from cxbridge_ros2cx.cx.stock import StockEnvironment
from cxbridge_ros2cx.refresh import RefreshTimer

if TYPE_CHECKING:
    from cxbridge.executive.host.environment import ClipsEnvironment
    from cxbridge_ros2.node import Publisher
    from cxbridge_ros2cx.cx.parameters import NodeParameters

CLASS_NAME: Final = "cx::ExecutivePlugin"
_REFRESH_TOPIC: Final = "clips_executive/refresh_agenda"
_DEFAULT_HZ: Final = 10  # the default of the ROS 2 CX
_MAX_HZ: Final = 10_000  # far above useful rates; a higher value is a typing error
_SALIENCE_GLOBAL: Final = "?*PRIORITY-TIME-RETRACT*"
# the rule with the lowest salience retracts the time fact, after all other rules could use the fact
_CONSTRUCTS: Final = (
    f"(defglobal {_SALIENCE_GLOBAL} = -10000)",
    f"(defrule time-retract (declare (salience {_SALIENCE_GLOBAL})) ?time <- (time $?) => (retract ?time))",
)


class ExecutivePlugin(CxPlugin):
    """Runs the rules of its environments at its rate, by default each time with a fact ``(time SECONDS)``."""

    refresh_type = "std_msgs/msg/Empty"

    @property
    def refresh_topic(self) -> str:
        return self.context.ros.full_name(_REFRESH_TOPIC)

    def initialize(self) -> None:
        """Read the parameters, start the timer and announce the publisher if there is one."""
        self._asserts_time = self.parameters.get(self.parameter("assert_time"), default=True)
        self._timer = RefreshTimer(self.context.clock, read_period_us(self.name, self.parameters))
        self._environments: list[StockEnvironment] = []
        self._refresh_publisher: Publisher | None = None
        if self.parameters.get(self.parameter("publish_on_refresh"), default=False):
            self._refresh_publisher = self.context.ros.node.create_publisher(
                self.refresh_topic, self.refresh_type
            )

    def init_context(self, env: ClipsEnvironment) -> None:
        """Define the time functions and the rule that retracts the time facts."""
        if isinstance(env, StockEnvironment):
            for name in ("now", "now-systime"):
                env.define(name, self._now_s)
            self._define_time(env)
        else:  # an environment for inspection, in which no rule fires
            env.to_time_fields = lambda time_us: (time_us / MICROSECONDS,)

    def _define_time(self, env: StockEnvironment) -> None:
        if env not in self._environments:  # an environment may load the plug-in twice
            for construct in _CONSTRUCTS:
                env.build(construct)
            env.eval("(unwatch facts time)")
            env.eval("(unwatch rules time-retract)")
            self._environments.append(env)

    def _now_s(self) -> float:
        return self.context.clock.now_us() / MICROSECONDS

    def tick(self) -> None:
        """When a tick is due, run the rules of the environments, in the order of their loading."""
        if not self._timer.advance_if_due():
            return
        for env in self._environments[:]:
            with env.lock:
                if self._asserts_time:
                    env.assert_ordered("time", (self._now_s(),))
                self.context.run_environment(env)
        if self._refresh_publisher is not None:
            self._refresh_publisher.publish({})

    def context_destroyed(self, env: ClipsEnvironment) -> None:
        """Stop running the rules of the environment."""
        if isinstance(env, StockEnvironment) and env in self._environments:
            self._environments.remove(env)


def read_period_us(plugin: str, parameters: NodeParameters) -> int:
    """Return the time between two ticks of an executive plug-in.

    :raises ConfigError: if the rate is not an integer from 1 to 10000.
    """
    name = f"{plugin}.refresh_rate"
    rate = parameters.get(name, _DEFAULT_HZ)
    if not 0 < rate <= _MAX_HZ:
        raise parameters.make_error(name, f"cannot be {rate}", f"the rate is in Hz, from 1 to {_MAX_HZ}")
    return MICROSECONDS // rate


def find_shortest_period_us(parameters: NodeParameters) -> int:
    """Return the shortest time between two ticks of the executive plug-ins in the parameters.

    Without such a plug-in, the time is that of the default rate.
    """
    return min(
        (
            # the parameter PLUGIN.plugin has the plug-in's class
            read_period_us(name.removesuffix(".plugin"), parameters)
            for name, parameter in parameters
            if parameter.value == CLASS_NAME and "." in name
        ),
        default=MICROSECONDS // _DEFAULT_HZ,
    )
