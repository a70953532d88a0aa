"""The activity of an environment as events: firings of rules and changes of facts.

CLIPS' ``watch`` prints a line in dozens of pieces. Through a Python router, a line costs as much as dozens of
firings. Therefore the host implements the watch items ``facts`` and ``rules`` with C hooks. It formats a fact
in one call, and only while a listener needs the text.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from typing import TypeAlias

from clips._clips import ffi, lib

from cxbridge.errors import ClipsError
from cxbridge.events import EventBus, FactChange, RuleFired
from cxbridge.executive.host.capi import NULL, CData, ClipsApi, decode, encode, make_callback
from cxbridge.executive.host.output import OutputRouter
from cxbridge.executive.host.values import Value, print_value, to_python

_FOUND = lib.GSE_NO_ERROR


class WatchItem:
    """The watched constructs of a kind: all or none, with exceptions.

    As in CLIPS, ``(watch facts)`` includes facts defined later, and ``(unwatch facts time)`` adds an
    exception.
    """

    def __init__(self) -> None:
        self.default = False
        """Whether constructs other than the exceptions are watched."""
        self.exceptions: set[str] = set()

    def set(self, names: tuple[str, ...], *, on: bool) -> None:
        """Watch the named constructs, or stop watching them; without names, all constructs."""
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
        """Return whether any construct can be watched."""
        return self.default or bool(self.exceptions)


Follower: TypeAlias = Callable[[str, dict[str, str]], None]
"""Gets a fact: the deftemplate, and the slots requested by any of its followers, as CLIPS prints them."""


class _Followers:
    """The followers of one deftemplate, and the slots that they requested."""

    def __init__(self) -> None:
        self._followers: list[Follower] = []
        self._c_names: dict[str, CData] = {}  # the names of the requested slots in C, by slot
        self._value = ffi.new("CLIPSValue *")

    def add(self, follower: Follower, slots: Iterable[str]) -> None:
        self._followers.append(follower)
        self._c_names |= {slot: ffi.new("char[]", encode(slot)) for slot in slots}

    def notify(self, template: str, fact: CData) -> None:
        """Pass the slots of a fact to the followers."""
        # each slot is queried once for all followers: a query costs as much as printing the whole fact
        get_slot, value = lib.GetFactSlot, self._value
        slots = {
            name: print_value(value)
            for name, c_name in self._c_names.items()
            if get_slot(fact, c_name, value) == _FOUND
        }
        for follower in self._followers:
            follower(template, slots)


class Watcher:
    """Emits the events of one environment.

    :param env: the environment's pointer.
    :param name: the environment's name in events.
    """

    def __init__(self, env: CData, api: ClipsApi, output: OutputRouter, bus: EventBus, name: str) -> None:
        self._env, self._api, self._output, self._bus, self._name = env, api, output, bus, name
        self.facts = WatchItem()
        self.rules = WatchItem()
        self.firings = 0
        """The number of firings in the present run, counted while firings are recorded."""
        self._assert_followers: dict[str, _Followers] = {}
        self._retract_followers: dict[str, _Followers] = {}
        self._names: dict[CData, str] = {}  # names of deftemplates by pointer
        self._unwatched_templates: set[CData] = set()  # pointers of deftemplates without listeners
        self._emits_facts = False
        # the texts of emitted facts by index: the retraction reuses the text, because formatting takes time
        self._fact_texts: dict[int, str] = {}
        self._hooks = (
            make_callback("void(Environment *, Fact *, void *)", self._handle_assertion),
            make_callback("void(Environment *, Fact *, void *)", self._handle_retraction),
            make_callback("void(Environment *, Activation *, void *)", self._handle_firing),
        )

    def watch(self, item: str, names: Sequence[str] = (), *, on: bool = True) -> None:
        """Execute ``(watch ITEM NAME...)`` or ``(unwatch ...)``.

        :raises ClipsError: if the item is unknown, or a name after ``facts`` or ``rules``.
        """
        if item not in ("facts", "rules", "all"):
            raise ClipsError(f"watching '{item}' is not supported", hint="watch facts, rules or all")
        finders = {"facts": lib.FindDeftemplate, "rules": lib.FindDefrule}
        for name in names:
            if item in finders and finders[item](self._env, encode(name)) == NULL:
                raise ClipsError(
                    f"Unable to find {'deftemplate' if item == 'facts' else 'defrule'} '{name}'."
                )
        if item in ("facts", "all"):
            self.facts.set(tuple(names), on=on)
        if item in ("rules", "all"):
            self.rules.set(tuple(names), on=on)

    def unwatch_undefined(self, item: str, name: str) -> None:
        """Stop watching a deftemplate or rule that may not be defined yet, unlike :meth:`watch`.

        :param item: ``facts`` or ``rules``.
        """
        {"facts": self.facts, "rules": self.rules}[item].set((name,), on=False)

    def follow(self, template: str, follower: Follower, slots: Iterable[str]) -> None:
        """Call ``follower`` for each assertion of a deftemplate.

        :param slots: the slots to pass; slots that the deftemplate lacks are left out.
        """
        self._assert_followers.setdefault(template, _Followers()).add(follower, slots)
        self.set_hooks()

    def follow_retractions(self, template: str, follower: Follower, slots: Iterable[str]) -> None:
        """Call ``follower`` for each retraction of a deftemplate.

        :param slots: see :meth:`follow`.
        """
        self._retract_followers.setdefault(template, _Followers()).add(follower, slots)
        self.set_hooks()

    def follow_changes(self, template: str, callback: Callable[[], None]) -> None:
        """Call ``callback`` for each assertion or retraction of a deftemplate."""
        self.follow(template, lambda _template, _slots: callback(), ())
        self.follow_retractions(template, lambda _template, _slots: callback(), ())

    def set_hooks(self) -> None:
        """Set the hooks that the present listeners and followers need.

        To be called again after a listener of the bus has been added or removed.
        """
        self._emits_facts = self._bus.wants(FactChange)
        self._unwatched_templates.clear()
        self._fact_texts.clear()
        assert_hook, retract_hook, firing_hook = self._hooks
        # a hook costs time for every fact: without listeners there is no hook
        set_hook = self._api.set_hook
        set_hook("Assert", assert_hook if self._emits_facts or self._assert_followers else None)
        set_hook("Retract", retract_hook if self._emits_facts or self._retract_followers else None)
        set_hook("BeforeRuleFires", firing_hook if self._bus.wants(RuleFired) else None)

    def forget_names(self) -> None:
        """Clear the cached deftemplates, which may be redefined."""
        self._names.clear()
        self._unwatched_templates.clear()

    # CLIPS calls the hooks for every fact: facts without a listener must cost little

    def _handle_assertion(self, _env: CData, fact: CData, _context: CData) -> None:
        deftemplate = lib.FactDeftemplate(fact)
        if deftemplate not in self._unwatched_templates:
            self._handle_change(fact, deftemplate, self._assert_followers, is_assertion=True)

    def _handle_retraction(self, _env: CData, fact: CData, _context: CData) -> None:
        deftemplate = lib.FactDeftemplate(fact)
        if deftemplate not in self._unwatched_templates:
            self._handle_change(fact, deftemplate, self._retract_followers, is_assertion=False)

    def _handle_change(
        self, fact: CData, deftemplate: CData, followers: dict[str, _Followers], *, is_assertion: bool
    ) -> None:
        template = self._names.get(deftemplate)
        if template is None:
            template = self._names[deftemplate] = decode(lib.DeftemplateName(deftemplate))
        if self._emits_facts and template in self.facts:
            now_us, index = self._bus.clock.now_us(), lib.FactIndex(fact)
            if is_assertion:
                text = self._fact_texts[index] = self.fact_text(fact)
            else:
                text = self._fact_texts.pop(index, "") or self.fact_text(fact)
            self._bus.emit(FactChange(now_us, self._name, is_assertion, index, template, text))
        elif self._fact_texts:  # the deftemplate may have been watched when the fact was asserted
            self._fact_texts.pop(lib.FactIndex(fact), None)
        if template in followers:
            followers[template].notify(template, fact)
        elif (
            not self._emits_facts and template not in self._assert_followers.keys() | self._retract_followers
        ):
            self._unwatched_templates.add(deftemplate)

    def _handle_firing(self, _env: CData, activation: CData, _context: CData) -> None:
        self.firings += 1
        rule = decode(lib.ActivationRuleName(activation))
        if rule in self.rules:
            basis = self.activation_basis(activation)
            self._bus.emit(RuleFired(self._bus.clock.now_us(), self._name, self.firings, rule, basis))

    def activation_basis(self, activation: CData) -> str:
        """Return the facts of an activation in CLIPS' notation: ``f-8,f-86,*``."""
        self._output.pause()
        text = self._api.activation_text(activation)
        self._output.resume()
        return text.split(":", 1)[1].strip()

    def fact_text(self, fact: CData) -> str:
        """Return a fact as CLIPS prints it in one line, without its index."""
        self._output.pause()
        text = self._api.fact_text(fact)
        self._output.resume()
        return text


def slot_values(fact: CData) -> dict[str, Value]:
    """Return the values of a fact by slot, in the order of the deftemplate.

    An ordered fact has the single slot ``implied``.
    """
    names = ffi.new("CLIPSValue *")
    lib.FactSlotNames(fact, names)
    values: dict[str, Value] = {}
    value = ffi.new("CLIPSValue *")
    for name in to_python(names):
        values[str(name)] = slot_value(fact, encode(name), value)
    return values


def slot_value(fact: CData, name: bytes, buffer: CData) -> Value:
    """Return the value of a slot.

    :param buffer: a CLIPSValue that receives the value. Callers reuse it, because its allocation takes time.
    """
    lib.GetFactSlot(fact, name, buffer)
    return to_python(buffer)
