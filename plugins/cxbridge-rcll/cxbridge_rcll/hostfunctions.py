"""The functions for the rules of the referee: configuration, machines, field.

The referee box defines these functions in C++, under the same names.
"""

from __future__ import annotations

from collections.abc import Callable
from random import Random
from typing import Final

from cxbridge.config import Configuration
from cxbridge.executive.features.config import confvals
from cxbridge.executive.host.environment import ClipsEnvironment
from cxbridge.executive.host.values import FALSE, TRUE, Symbol, Value
from cxbridge_rcll.machines import (
    DISPENSE,
    HANDLE_CAP,
    MOUNT_RING,
    RELOCATE,
    RETRIEVE,
    STORE,
    BeltPosition,
    Machine,
)
from cxbridge_rcll.placing import MACHINE_NAMES, Placement, arrange_machines
from cxbridge_rcll.refbox import Refbox

# CLIPS' codes for the types of arguments: any types after a first string or symbol; then integers
_TEXT_ARGUMENT: Final = "*;sy"
_INTEGER_ARGUMENT, _TWO_INTEGER_ARGUMENTS = "*;l", "*;l;l"
# the functions for parts of machines that are not simulated, with the number of their arguments
_IGNORED_FUNCTIONS: Final = {
    "mps-reset-base-counter": 1,
    "mps-reset-lights": 1,
    "mps-set-light": 3,
    "mps-set-lights": 4,
}
# the functions that give a task to a machine, with the number of arguments after the machine, e.g. a colour
# or a shelf, which the simulation ignores
_TASKS: Final = {
    "mps-bs-dispense": (DISPENSE, 1),
    "mps-cs-retrieve-cap": (HANDLE_CAP, 0),
    "mps-cs-mount-cap": (HANDLE_CAP, 0),
    "mps-rs-mount-ring": (MOUNT_RING, 2),
    "mps-ss-retrieve": (RETRIEVE, 2),
    "mps-ss-store": (STORE, 2),
    "mps-ss-relocate": (RELOCATE, 4),
}
_NO_FIELD: Final = (Symbol("INVALID-GENERATION"),)  # the result without a generated field


def define_config_functions(env: ClipsEnvironment, config: Configuration, refbox: Refbox) -> None:
    """Define the functions ``config-...``, ``load-config`` and ``get-clips-dirs`` in an environment.

    :param config: the referee's configuration.
    :param refbox: the checkout whose folder of rules ``get-clips-dirs`` returns.
    """

    def load_config(prefix: str) -> None:
        for slots in confvals(config, prefix):
            env.assert_fact("confval", slots)

    def update_config(path: str, value: Value) -> None:
        if value in (TRUE, FALSE):
            config.set(path, value == TRUE)
        elif isinstance(value, str | int | float):
            # str() turns a Symbol into plain text
            config.set(path, str(value) if isinstance(value, str) else value)

    env.define("get-clips-dirs", lambda: (f"{refbox.rules_folder}/",))
    for name, function in (
        ("load-config", load_config),
        ("config-path-exists", config.exists),
        ("config-get-bool", lambda path: config.get_bool(path, default=False)),
        ("config-get-int", lambda path: config.get_int(path, default=0)),
    ):
        env.define(name, function, 1, types=_TEXT_ARGUMENT)
    for kind in ("float", "uint", "int", "bool", "string"):
        env.define(f"config-update-{kind}", update_config, 2, types=_TEXT_ARGUMENT)


class MachineFunctions:
    """Defines the functions ``mps-...`` and ``reconfigure-machine`` in an environment.

    :param make_machine: creates a machine by name.
    """

    def __init__(self, env: ClipsEnvironment, make_machine: Callable[[str], Machine]) -> None:
        self.machines: dict[str, Machine] = {}
        self._make_machine = make_machine
        self._log = env.log
        self._define_functions(env)

    def _define_functions(self, env: ClipsEnvironment) -> None:
        def define_machine_function(
            name: str, action: Callable[..., None], extra_argument_count: int = 0
        ) -> None:
            env.define(
                name,
                lambda machine_name, *arguments: self._instruct(machine_name, action, arguments),
                1 + extra_argument_count,
                types=_TEXT_ARGUMENT,
            )

        def ignore(*_arguments: Value) -> None:
            """Do nothing."""

        define_machine_function(
            "mps-move-conveyor", lambda machine, goal, _direction: machine.move(BeltPosition(goal)), 2
        )
        define_machine_function("mps-ds-process", Machine.deliver, 1)
        define_machine_function("mps-deliver", lambda machine: machine.move(BeltPosition.OUTPUT))
        for name, (task, extra_argument_count) in _TASKS.items():
            # a default, since a closure would see the last task of the loop
            define_machine_function(
                name, lambda machine, *_ignored, task=task: machine.add_task(task), extra_argument_count
            )
        define_machine_function("mps-reset", Machine.reset)
        for name, argument_count in _IGNORED_FUNCTIONS.items():
            env.define(name, ignore, argument_count, types=_TEXT_ARGUMENT)
        env.define("reconfigure-machine", self._create_machine, 1, types=_TEXT_ARGUMENT)

    def _instruct(self, name: str, action: Callable[..., None], arguments: tuple[Value, ...]) -> None:
        machine = self.machines.get(name)
        if machine is None:
            # an error of the rules or of the configuration, after which the rules continue
            self._log.error(f"Invalid station {name}")
        else:
            action(machine, *arguments)

    def _create_machine(self, name: str) -> None:
        self.machines[str(name)] = self._make_machine(str(name))

    def loop(self) -> None:
        """Let all machines start and end the tasks that are due."""
        for machine in self.machines.values():
            machine.loop()


class FieldFunctions:
    """Defines the functions ``mps-generator-...``, which place the machines on the field.

    In the referee box, a separate thread generates the field. Here the field is available at once.

    :param random: the source of the positions.
    """

    def __init__(self, env: ClipsEnvironment, random: Random) -> None:
        self._random = random
        self._machine_numbers = set(MACHINE_NAMES)
        self._field_size = (7, 8)  # width and height of a half in zones, until the rules set the size
        self._placements: list[Placement] | None = None
        define = env.define
        define("mps-generator-set-field", self._set_field, 2, types=_TWO_INTEGER_ARGUMENTS)
        define("mps-generator-add-machine", self._add_machine, 1, types=_INTEGER_ARGUMENT)
        define("mps-generator-remove-machine", self._remove_machine, 1, types=_INTEGER_ARGUMENT)
        define("mps-generator-start", self._generate_field)
        define("mps-generator-abort", lambda: None)
        define("mps-generator-running", lambda: False)
        define("mps-generator-field-generated", lambda: bool(self._placements))
        define("mps-generator-get-generated-field", self._get_generated_field)

    def _set_field(self, width: int, height: int) -> bool:
        """Set the size of a half in zones; return whether the size is valid."""
        if width <= 0 or height <= 0:
            return False
        self._field_size = (width, height)
        return True

    def _add_machine(self, number: int) -> bool:
        """Add a machine; return whether the machine is new."""
        is_new = number not in self._machine_numbers
        self._machine_numbers.add(number)
        return is_new

    def _remove_machine(self, number: int) -> bool:
        """Remove a machine; return whether the machine was present."""
        was_known = number in self._machine_numbers
        self._machine_numbers.discard(number)
        return was_known

    def _generate_field(self) -> None:
        self._placements = arrange_machines(self._random, self._machine_numbers, *self._field_size)

    def _get_generated_field(self) -> Value:
        """Return the name, the zone and the angle in degrees of each machine, one machine after another."""
        if self._placements is None:
            return _NO_FIELD
        field: list[Value] = []
        for placement in self._placements:
            name = MACHINE_NAMES.get(placement.machine, "NOT-SET")
            # the placed machines are those of cyan (C)
            zone = Symbol(f"C_Z{placement.x}{placement.y}")
            field += (Symbol(f"C-{name}"), zone, placement.angle)
        return tuple(field)
