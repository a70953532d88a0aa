"""What an environment does, as events: rule firings, fact changes, transitions.

CLIPS' own ``watch`` prints text piece by piece, which through a Python router costs a hundred firings each. So
the host keeps the watch items ``facts`` and ``rules`` itself, with CLIPS' meaning, and makes events of them
from C hooks, formatting a fact in one call, and only when somebody listens. All other items stay CLIPS' own.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from clips._clips import ffi, lib

from cxbridge.events import EventBus, FactChange, RuleFired
from cxbridge.executive.capi import NULL, CData, ClipsApi, callback, decode, encode
from cxbridge.executive.values import Value, show, to_python

if TYPE_CHECKING:
    from collections.abc import Callable

    from cxbridge.executive.output import OutputRouter

FactSink = "Callable[[str, dict[str, str]], None]"


class WatchItems:
    """A watch item: everything or nothing, except what is named.

    CLIPS' meaning: ``(watch facts)`` turns all on, those defined later, too; ``(unwatch facts time)`` one off.
    """

    def __init__(self) -> None:
        self.default = False
        self.exceptions: set[str] = set()

    def set(self, names: tuple[str, ...], *, on: bool) -> None:
        """Switch the named ones; all of them when none is named."""
        if not names:
            self.default = on
            self.exceptions.clear()
        elif on == self.default:
            self.exceptions.difference_update(names)
        else:
            self.exceptions.update(names)

    def __contains__(self, name: str) -> bool:
        return self.default != (name in self.exceptions)

    def __bool__(self) -> bool:
        return self.default or bool(self.exceptions)


class Watcher:
    """Makes events of what one environment does.

    :param env: the environment's pointer.
    :param name: its name, for the events.
    """

    def __init__(self, env: CData, api: ClipsApi, output: OutputRouter, bus: EventBus, name: str) -> None:
        self._env = env
        self._api = api
        self._output = output
        self._bus = bus
        self._name = name
        self.facts = WatchItems()
        self.rules = WatchItems()
        self.firings = 0
        self._followed: dict[str, Callable[[str, dict[str, str]], None]] = {}
        self._hooks: tuple[CData, CData, CData] | None = None

    def follow(self, template: str, sink: Callable[[str, dict[str, str]], None]) -> None:
        """Call ``sink(template, slots)`` for each asserted fact of this deftemplate.

        Slots map to the text CLIPS prints for them.
        """
        self._followed[template] = sink

    def start(self) -> None:
        """Set the hooks that somebody needs. To be called again when listeners or followers have changed."""
        asserts, retracts, fires = self._hooks or (
            callback("void(Environment *, Fact *, void *)", self._asserted),
            callback("void(Environment *, Fact *, void *)", self._retracted),
            callback("void(Environment *, Activation *, void *)", self._fired),
        )
        self._hooks = (asserts, retracts, fires)
        facts = self._bus.wants(FactChange)
        self._api.on_assert(asserts if facts or self._followed else None)
        self._api.on_retract(retracts if facts else None)
        self._api.on_fire(fires if self._bus.wants(RuleFired) else None)

    def _asserted(self, _env: CData, fact: CData, _context: CData) -> None:
        template = decode(lib.DeftemplateName(lib.FactDeftemplate(fact)))
        if template in self.facts:
            self._tell(fact, template, asserted=True)
        sink = self._followed.get(template)
        if sink is not None:
            sink(template, self.slots(fact))

    def _retracted(self, _env: CData, fact: CData, _context: CData) -> None:
        template = decode(lib.DeftemplateName(lib.FactDeftemplate(fact)))
        if template in self.facts:
            self._tell(fact, template, asserted=False)

    def _tell(self, fact: CData, template: str, *, asserted: bool) -> None:
        if self._bus.wants(FactChange):
            text = self.text(fact)
            now = self._bus.clock.now_us()
            self._bus.emit(FactChange(now, self._name, asserted, lib.FactIndex(fact), template, text))

    def _fired(self, _env: CData, activation: CData, _context: CData) -> None:
        self.firings += 1
        rule = decode(lib.ActivationRuleName(activation))
        if rule in self.rules:
            self._output.pause()
            text = self._api.activation_text(activation)
            self._output.resume()
            basis = text.split(":", 1)[1].strip()
            self._bus.emit(RuleFired(self._bus.clock.now_us(), self._name, self.firings, rule, basis))

    def text(self, fact: CData) -> str:
        """Return a fact as CLIPS prints it on one line, without its index."""
        self._output.pause()
        text = self._api.fact_text(fact)
        self._output.resume()
        return text

    def slots(self, fact: CData) -> dict[str, str]:
        """Return a fact's slots, as CLIPS prints them; an ordered fact has the slot ``implied``."""
        return {name: show(value) for name, value in slot_values(self._env, fact).items()}


def slot_values(env: CData, fact: CData) -> dict[str, Value]:
    """Return a fact's slots by name, in order; an ordered fact has one slot called ``implied``."""
    names = ffi.new("CLIPSValue *")
    lib.FactSlotNames(fact, names)
    values: dict[str, Value] = {}
    value = ffi.new("CLIPSValue *")
    for name in to_python(names):
        lib.GetFactSlot(fact, encode(name), value)
        values[str(name)] = to_python(value)
    return values


__all__ = ["NULL", "WatchItems", "Watcher", "slot_values"]
