"""CLIPS environments restricted to pure functions, without access to the outside.

The constructs of these environments may come from an untrusted recording, so they can call only the
functions of :data:`ALLOWED_FUNCTIONS`. A function that a later CLIPS adds is removed until it is listed here
with a reason. All shims except `seed` and `setgen` are allowed. (A shim replaces a function of CLIPS 6.4 to
behave as in 6.30, the version of Fawkes.) No allowed function opens files, runs programs, reads input,
prints, loads or builds constructs, evaluates text, changes facts, or calls into the process. See "A recording
is data" in docs/security.md.
"""

from __future__ import annotations

from typing import Final

from cxbridge.events import EventBus
from cxbridge.executive.host.environment import ClipsEnvironment
from cxbridge.executive.host.recursion import GUARD_FUNCTION
from cxbridge.executive.host.shims import CLIPS630_NAMES, FUNCTIONS, OWN_NAMES
from cxbridge.executive.host.source import check_parser_limits, prepare_source
from cxbridge.executive.host.udf import UNBOUNDED

# The functions with a shim that are not allowed: they set the state of `random` and `gensym`.
_OMITTED_SHIMS: Final = ("seed", "setgen")

_FUNCTIONS_BY_REASON: Final = {
    "computes with numbers": """
        * ** + - / < <= <> = > >= abs acos acosh acot acoth acsc acsch asec asech asin asinh atan atan2
        atanh cos cosh cot coth csc csch deg-grad deg-rad div evenp exp float grad-deg integer log log10
        max min mod oddp pi rad-deg round sec sech sin sinh sqrt tan tanh""",
    "asks for the type of a value": """
        external-addressp fact-addressp floatp instance-addressp instance-namep instancep integerp lexemep
        multifieldp numberp pointerp stringp symbolp type""",
    "compares values": "!= and eq neq not or",
    "converts values to text": """
        lowcase str-byte-length str-cat str-compare str-index str-length str-replace string-to-field
        sub-string sym-cat upcase""",
    "makes and changes lists": """
        create$ delete$ delete-member$ difference$ expand$ explode$ first$ implode$ insert$ intersection$
        length$ member$ nth$ replace$ replace-member$ rest$ sort subseq$ subsetp union$""",
    "chooses and repeats; the process of a diagnosis bounds its time": """
        bind break foreach if loop-for-count progn progn$ return switch void while""",
    "reads facts of the environment itself": """
        any-factp deftemplate-slot-allowed-values deftemplate-slot-cardinality deftemplate-slot-default-value
        deftemplate-slot-defaultp deftemplate-slot-existp deftemplate-slot-multip deftemplate-slot-names
        deftemplate-slot-range deftemplate-slot-singlep deftemplate-slot-types delayed-do-for-all-facts
        do-for-all-facts do-for-fact fact-existp fact-index fact-relation fact-slot-names fact-slot-value
        find-all-facts find-fact get-deftemplate-list get-fact-list""",
    "is made by CLIPS' parser from loops, queries and $?variables": """
        (expansion-call) (get-loop-count) (get-progn$-field) (get-progn$-index) (query-fact)
        (query-fact-slot) (set-evaluation-error)""",
    "draws a number or a name, in the process of the diagnosis alone": "gensym gensym* random",
    "tells the time of the snapshot": "now now-systime",
    "does nothing": "print println printout",
    "computes as in CLIPS 6.30": " ".join(name for name in CLIPS630_NAMES if name not in _OMITTED_SHIMS),
    "is a part of the shims for CLIPS 6.30, without an effect": " ".join(
        (GUARD_FUNCTION, *(own for own, name in OWN_NAMES.items() if name not in _OMITTED_SHIMS))
    ),
}

# The allowed functions with their reasons.
ALLOWED_FUNCTIONS: Final = {
    name: reason for reason, names in _FUNCTIONS_BY_REASON.items() for name in names.split()
}

_FUNCTION_LIST: Final = "get-function-list"


class IsolatedEnvironment(ClipsEnvironment):
    """An environment with only the functions of :data:`ALLOWED_FUNCTIONS`."""

    def __init__(self, name: str, bus: EventBus) -> None:
        # The functions of other environments that are missing here.
        self.removed_functions: frozenset[str] = frozenset(_OMITTED_SHIMS)
        super().__init__(name, bus)
        self._remove_forbidden_functions()

    def _build_clips630_functions(self) -> None:
        # Remove functions before the first construct: CLIPS keeps pointers to the functions that constructs
        # call. The second removal, in the constructor, needs the list of functions once more.
        self._remove_forbidden_functions(kept_function=_FUNCTION_LIST)
        for function in ("print", "println", "printout"):
            self.api.remove_udf(function)
            self.define(function, lambda *_: None, 0, UNBOUNDED)
        for source in FUNCTIONS:
            if not any(f"(cx-{name} " in source for name in _OMITTED_SHIMS):
                self._clips630_functions.build(source)

    def _remove_forbidden_functions(self, kept_function: str = "") -> None:
        """Remove all functions that are not allowed.

        :param kept_function: the name of a function that stays until the next call.
        """
        present_functions = frozenset(str(function) for function in self.call(_FUNCTION_LIST))
        forbidden_functions = present_functions - ALLOWED_FUNCTIONS.keys() - {kept_function}
        for function in forbidden_functions:
            self.api.remove_udf(function)
        self.removed_functions |= forbidden_functions

    def build(self, construct: str) -> None:
        """Define a construct, guarded against crashes of the process.

        :raises ClipsError: if CLIPS refuses the construct, or cannot parse it safely.
        """
        check_parser_limits(construct)
        super().build(prepare_source(construct, self.loader.has_clips_function).text)
