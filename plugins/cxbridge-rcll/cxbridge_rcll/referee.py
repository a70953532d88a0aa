"""The referee: the rules of a referee box in a separate CLIPS environment, on the clock of the run."""

from __future__ import annotations

from pathlib import Path
from random import Random
from typing import Final

from cxbridge.config import Configuration
from cxbridge.errors import ExecutiveError
from cxbridge.executive.host.environment import ClipsEnvironment
from cxbridge.executive.host.values import FALSE, TRUE, Symbol, Value
from cxbridge.mainloop import Hook
from cxbridge.run.agent import Run
from cxbridge.run.components.component import Component
from cxbridge_protobuf.feature import ProtobufFeature
from cxbridge_protobuf.local_connections import LocalNetwork
from cxbridge_protobuf.settings import ProtobufSettings
from cxbridge_rcll.hostfunctions import FieldFunctions, MachineFunctions, define_config_functions
from cxbridge_rcll.machines import Machine
from cxbridge_rcll.refbox import Refbox

ENVIRONMENT: Final = "referee"  # the name of the CLIPS environment in logs and recordings

STATIONS_PATH: Final = "/llsfrb/mps/stations/"
SERVER_PORT_PATH: Final = "/llsfrb/comm/server-port"

# the rules report the version of the program rcll-refbox; without the program, the version is 0.0.0
_VERSION_GLOBALS: Final = "(defglobal ?*VERSION-MAJOR* = 0 ?*VERSION-MINOR* = 0 ?*VERSION-MICRO* = 0)"


class Referee(Component):
    """Supervises a game with the rules of a referee box.

    :param config: the configuration of the referee box.
    :param message_folder: the folder with message definitions.
    :param seed: the seed for the referee's random choices.
    :raises CxbridgeError: if the rules do not load.
    """

    hooks = (Hook.SENSOR_ACQUIRE,)
    description = "Referee of the RoboCup Logistics League"

    def __init__(
        self,
        context: Run,
        refbox: Refbox,
        config: Configuration,
        message_folder: Path,
        network: LocalNetwork,
        seed: int,
    ) -> None:
        self._clock = context.clock
        self.env = ClipsEnvironment(ENVIRONMENT, context.bus, "Referee")
        # without the feature's templates, since the rules of the referee box define them
        self._protobuf = ProtobufFeature(
            ProtobufSettings((message_folder,)), network.join, defines_templates=False
        )
        self._define_functions(refbox, config, seed)
        self._load_rules(refbox, seed)

    def _define_functions(self, refbox: Refbox, config: Configuration, seed: int) -> None:
        """Define the global variables and functions that the rules expect from the referee box."""
        env = self.env
        env.build_unrecorded(_VERSION_GLOBALS)
        define_config_functions(env, config, refbox)
        self._machines = MachineFunctions(env, self._make_machine)
        FieldFunctions(env, Random(seed))  # noqa: S311 - a game, not a secret
        env.define("print-fact-list", self._print_facts, 2, types="*;m;m")  # m: a multifield
        self._protobuf.init_context(env)
        self._protobuf.connections(env).enable_server(config.get_uint(SERVER_PORT_PATH, default=0))

    def _load_rules(self, refbox: Refbox, seed: int) -> None:
        env, init_file = self.env, refbox.rules_folder / "init.clp"
        if not env.batch(init_file):
            raise ExecutiveError("the referee's rules do not load; see the log", file=init_file)
        env.call("seed", seed)  # after the batch, in which the rules seed CLIPS with the system's time
        env.assert_string("(init)")  # the fact that starts the rules
        env.refresh_agenda()
        env.run()

    def _make_machine(self, name: str) -> Machine:
        return Machine(name, self._clock, self._report_sensor)

    def _report_sensor(self, machine: str, sensor: str, value: int) -> None:
        """Assert a fact with the changed sensor value of a machine."""
        clips_value = (TRUE if value else FALSE) if isinstance(value, bool) else value
        self.env.assert_ordered("mps-status-feedback", (Symbol(machine), Symbol(sensor), clips_value))

    def _print_facts(self, _indices: tuple[Value, ...], _slots: tuple[Value, ...]) -> None:
        """Print nothing: the result of the game has the values of the final tables."""

    def loop(self) -> None:
        """Let the machines work, assert the received messages, then run the rules."""
        env = self.env
        with env.lock:
            self._machines.loop()
            self._protobuf.before_run(env)
            env.assert_ordered("time", env.to_time_fields(self._clock.now_us()))
            env.refresh_agenda()
            env.run()
            # the rules leave the messages that they have received to the referee box, which deletes them
            self._protobuf.delete_messages(env)

    @property
    def machines(self) -> dict[str, Machine]:
        """The simulated machines by name."""
        return self._machines.machines

    def close(self) -> None:
        self._protobuf.context_destroyed(self.env)
        self.env.destroy()
