; domain.clp - the planning domain: its model, and the errors in the model
;
; The domain is in five files, in this order:
;   domain.clp            the model: templates for the facts of a domain (or of the PDDL parser),
;                         functions, types of objects, errors
;   domain-index.clp      an index of the model
;   domain-grounding.clp  grounded preconditions of plan-actions, and their truth
;   domain-effects.clp    effects of successful actions
;   domain-exogenous.clp  preconditions of exogenous operators
; If a domain has functions, the program also loads features/domain-numbers.clp, the rules for numbers.
; The files need plan.clp, goal.clp and saliences.clp. Templates, and rules and functions that do the same
; as in Fawkes, have Fawkes' names (docs/evidence/core.md).
;
; The work after the change of a fact depends only on the facts that refer to it, not on the number
; of goals, plans and facts.

; --- templates

(deftemplate domain-object-type
  "A type of objects; all types descend from the type object."
  (slot super-type (default object) (type SYMBOL)) (slot name (type SYMBOL)))

(deftemplate domain-object
  "An object, with the most specific of its types."
  (slot type (default object) (type SYMBOL)) (slot name))

(deftemplate domain-predicate
  "The declaration of a predicate."
  (slot name (default ?NONE) (type SYMBOL))
  ; the names and types of the parameters, in the same order
  (multislot param-names (type SYMBOL)) (multislot param-types (type SYMBOL))
  ; sensed: only observations of the world change the facts of the predicate; an action that has such
  ; an effect does not apply the effect, but may wait for its observation
  (slot sensed (default FALSE) (type SYMBOL) (allowed-values TRUE FALSE))
  ; value predicate: a partial function, whose value for the other arguments is the last argument
  (slot value-predicate (default FALSE) (type SYMBOL) (allowed-values TRUE FALSE)))

(deftemplate domain-fact
  "A ground atom that is true. All other atoms are false."
  (slot name (default ?NONE) (type SYMBOL)) (multislot param-values))

(deftemplate domain-pending-sensed-fact
  "An effect on a sensed predicate, until the effect is observed or its action is retracted."
  (slot name (default ?NONE) (type SYMBOL)) (multislot param-values)
  (slot type (default POSITIVE) (type SYMBOL) (allowed-values POSITIVE NEGATIVE))
  ; the action that has the effect
  (slot action-id (type INTEGER)) (slot plan-id (type SYMBOL)) (slot goal-id (type SYMBOL)))

(deftemplate domain-operator
  "An operator. Separate facts have the types of its parameters, its precondition and its effects."
  (slot name (type SYMBOL)) (multislot param-names)
  ; exogenous: another agent performs the action, and the plan expects it
  (slot exogenous (default FALSE) (type SYMBOL) (allowed-values TRUE FALSE))
  ; whether an action waits until its sensed effects have been observed
  (slot wait-sensed (default TRUE) (type SYMBOL) (allowed-values TRUE FALSE)))

(deftemplate domain-operator-parameter
  "The type of a parameter of an operator."
  (slot operator (type SYMBOL)) (slot type (default object) (type SYMBOL)) (slot name))

(deftemplate domain-effect
  "A literal that an operator (part-of) makes true (POSITIVE) or false (NEGATIVE). The effect is
   conditional if pddl-formula facts are part-of the effect's name."
  (slot part-of (type SYMBOL)) (slot name (default-dynamic (gensym*)) (type SYMBOL))
  (slot predicate (type SYMBOL))
  (slot type (default POSITIVE) (type SYMBOL) (allowed-values POSITIVE NEGATIVE))
  ; a constant other than nil replaces the parameter at the same position; without constants, all
  ; names are parameters
  (multislot param-names (default)) (multislot param-constants (default))
  ; a slot of Fawkes, without use here
  (multislot param-values (default)))

(deftemplate domain-error
  "An error in the domain, which is logged and has no other effect."
  (slot error-type (type SYMBOL)) (slot error-msg (type STRING)))

(deftemplate pddl-formula
  "An inner node of a condition. The root is part-of an operator or of an effect."
  (slot part-of (type SYMBOL)) (slot id (default ?NONE) (type SYMBOL))
  (slot type (type SYMBOL) (allowed-values conjunction disjunction negation atom)))

(deftemplate pddl-predicate
  "A leaf of a condition, part-of a formula: an atom, or the EQUALITY of two terms."
  (slot part-of (type SYMBOL)) (slot id (default ?NONE) (type SYMBOL))
  (slot predicate (type SYMBOL))
  ; constants: as in domain-effect
  (multislot param-names (type SYMBOL)) (multislot param-constants))

(deftemplate domain-comparison
  "A comparison of numbers, as PDDL text. Its pddl-predicate has the comparison's operator as its
   predicate and the variables as its parameters; problem-function facts have the functions' values."
  (slot predicate-id (type SYMBOL)) (slot text))

(deftemplate pddl-grounding
  "The arguments of a grounding of conditions; plan-action.precondition has its id."
  (slot id (default ?NONE) (type SYMBOL))
  (multislot param-values (type SYMBOL)) (multislot param-names (type SYMBOL)))

(deftemplate grounded-pddl-formula
  "A pddl-formula (formula-id) in a grounding, and whether it is satisfied."
  (slot id (default ?NONE) (type SYMBOL))
  (slot grounding (type SYMBOL)) (slot formula-id (type SYMBOL))
  (slot is-satisfied (default FALSE) (type SYMBOL) (allowed-values TRUE FALSE)))

(deftemplate grounded-pddl-predicate
  "A pddl-predicate (predicate-id) in a grounding, and whether it is satisfied."
  (slot id (default ?NONE) (type SYMBOL))
  (slot grounding (type SYMBOL)) (slot predicate-id (type SYMBOL))
  (slot is-satisfied (default FALSE) (type SYMBOL) (allowed-values TRUE FALSE)))

; --- functions

(deffunction domain-wipe
  "Retract the domain and all its groundings; rules retract derived facts except domain-obj-is-of-type."
  ()
  (progn$ (?template (create$ domain-fact domain-object domain-object-type domain-predicate
                              domain-effect domain-operator domain-operator-parameter
                              pddl-predicate pddl-formula domain-comparison pddl-grounding
                              domain-error))
    (delayed-do-for-all-facts ((?f ?template)) TRUE (retract ?f))))

(deffunction domain-fact-args
  "The arguments in the form of a world model key: args? name value name value ...; () without
   arguments; FALSE and an error message if the numbers of names and values differ."
  (?param-names ?param-values)
  (if (<> (length$ ?param-names) (length$ ?param-values)) then
    (printout error "Domain fact arguments: " (length$ ?param-names) " names ("
                    (implode$ ?param-names) ") but " (length$ ?param-values) " values ("
                    (implode$ ?param-values) ")" crlf)
    (return FALSE))
  (if (= (length$ ?param-names) 0) then (return (create$)))
  (bind ?args (create$ args?))
  (progn$ (?name ?param-names)
    (bind ?args (create$ ?args ?name (nth$ ?name-index ?param-values))))
  (return ?args))

(deffunction domain-fact-key
  "The world model key of a fact: its name and its arguments; FALSE as for domain-fact-args."
  (?name ?param-names ?param-values)
  (bind ?args (domain-fact-args ?param-names ?param-values))
  (if (eq ?args FALSE) then (return FALSE))
  (return (create$ ?name ?args)))

(deffunction domain-param-value-for-name
  "The value of the parameter with this name; FALSE without such a parameter."
  (?param-values ?param-names ?param-name)
  (bind ?position (member$ ?param-name ?param-names))
  (if ?position then (return (nth$ ?position ?param-values)))
  (return FALSE))

(deffunction domain-build-ground-parameter-list
  "The values of a predicate's terms: the constant, or else the value of the parameter;
   FALSE and an error if a parameter is unknown."
  (?names ?constants ?grounded-names ?grounded-values)
  (bind ?values (create$))
  (progn$ (?name ?names)
    (bind ?value (nth$ ?name-index ?constants))
    (if (eq ?value nil) then
      (bind ?position (member$ ?name ?grounded-names))
      (if (not ?position) then
        (printout error "PDDL Predicate has unknown parameter " ?name
                        " (" ?grounded-names " vs " ?names ") " crlf)
        (return FALSE))
      (bind ?value (nth$ ?position ?grounded-values)))
    (bind ?values (create$ ?values ?value)))
  (return ?values))

(deffunction domain-check-grounding-match
  "Whether the terms of a predicate have the values ?domain-values in a grounding."
  (?param-names ?domain-values ?predicate-constants ?grounded-params ?grounded-values)
  (return (eq ?domain-values
              (domain-build-ground-parameter-list
                ?param-names ?predicate-constants ?grounded-params ?grounded-values))))

(deffunction domain-check-grounded-equality
  "Whether the two terms of an EQUALITY are the same (also in type) in a grounding."
  (?param-names ?predicate-constants ?grounded-params ?grounded-values)
  (bind ?values (domain-build-ground-parameter-list
                  ?param-names ?predicate-constants ?grounded-params ?grounded-values))
  (if (or (eq ?values FALSE) (<> (length$ ?values) 2)) then (return FALSE))
  (return (eq (nth$ 1 ?values) (nth$ 2 ?values))))

(deffunction domain-ground-effect
  "The values of an effect's terms: the constant, or else the value of the action's parameter. A
   name that is not a parameter of the action stays, as in Fawkes."
  (?effect-param-names ?effect-param-constants ?action-param-names ?action-param-values)
  (bind ?values (create$))
  (progn$ (?name ?effect-param-names)
    (bind ?value (nth$ ?name-index ?effect-param-constants))
    (if (eq ?value nil) then
      (bind ?position (member$ ?name ?action-param-names))
      (bind ?value (if ?position then (nth$ ?position ?action-param-values) else ?name)))
    (bind ?values (create$ ?values ?value)))
  (return ?values))

(deffunction domain-get-operator-for-pddl-predicate
  "The operator whose precondition contains a formula or predicate with the part-of ?part-of; FALSE
   without such an operator."
  (?part-of)
  (do-for-fact ((?f pddl-formula)) (eq ?f:id ?part-of)
    (return (domain-get-operator-for-pddl-predicate ?f:part-of)))
  (return (if (any-factp ((?o domain-operator)) (eq ?o:name ?part-of))
    then ?part-of else FALSE)))

(deffunction domain-is-formula-negative
  "Whether a formula is within an odd number of negations. The formula itself counts, too, if it is
   a negation."
  (?formula-id)
  (do-for-fact ((?f pddl-formula)) (eq ?f:id ?formula-id)
    (return (neq (eq ?f:type negation) (domain-is-formula-negative ?f:part-of))))
  (return FALSE))

(deffunction domain-is-precond-negative
  "The former name of domain-is-formula-negative, which Fawkes has kept for agents."
  (?formula-id)
  (return (domain-is-formula-negative ?formula-id)))

(deffunction intersect
  "The elements of the first list that are also in the second list, in the order of the first."
  (?first ?second)
  (bind ?common (create$))
  (progn$ (?element ?first)
    (if (member$ ?element ?second) then (bind ?common (create$ ?common ?element))))
  (return ?common))

; --- types of objects

(defrule domain-add-type-object
  "The type object, from which all types descend, needs no declaration."
  (not (domain-object-type (name object)))
  =>
  (assert (domain-object-type (name object))))

(defrule domain-translate-obj-slot-type-to-ordered-fact
  "Note the declared type of an object as a type to which the object belongs."
  (domain-object (type ?type) (name ?object))
  =>
  (assert (domain-obj-is-of-type ?object ?type)))

(defrule domain-get-transitive-types
  "An object of a type also belongs to the super-type. The type object has no super-type."
  (domain-obj-is-of-type ?object ?type&~object)
  (domain-object-type (name ?type) (super-type ?super))
  =>
  (assert (domain-obj-is-of-type ?object ?super)))

; --- errors

(deffunction domain-report
  "Assert a domain-error, whose message is the concatenation of ?message-parts."
  (?type $?message-parts)
  (assert (domain-error (error-type ?type) (error-msg (str-cat (expand$ ?message-parts))))))

(defrule domain-print-error
  (domain-error (error-msg ?message) (error-type ?type))
  =>
  (printout error "Domain error '" ?type "': " ?message crlf))

(defrule domain-check-object-types-exist
  (domain-object (type ?type) (name ?object))
  (not (domain-object-type (name ?type)))
  =>
  (domain-report type-of-object-does-not-exist
    "Type " ?type " of object " ?object " does not exist."))

(defrule domain-check-super-type-exists
  "The super-type object needs no declaration."
  (domain-object-type (super-type ?super&~object) (name ?type))
  (not (domain-object-type (name ?super)))
  =>
  (domain-report super-type-does-not-exist
    "Super-type " ?super " of type " ?type " does not exist."))

(defrule domain-check-operator-of-action-exists
  (plan-action (action-name ?operator))
  (not (domain-operator (name ?operator)))
  =>
  (domain-report operator-of-action-does-not-exist
    "Operator of action " ?operator " does not exist"))

; "prediacte" is Fawkes' spelling, which agents may use to watch the rule
(defrule domain-check-pddl-predicate-has-domain-prediacte
  (pddl-predicate (predicate nil) (id ?id))
  =>
  (domain-report precondition-must-have-predicate-or-be-equality
    "pddl-predicate " ?id " must have a predicate"))

(defrule domain-check-effects-on-value-predicates-must-occur-in-pairs
  "An effect that sets the value for some arguments must come with an effect that removes the former
   value for the same arguments, and vice versa. The last argument is the value."
  (domain-effect (part-of ?operator) (predicate ?predicate) (name ?name)
                 (type ?type) (param-names $?args ?))
  (domain-predicate (value-predicate TRUE) (name ?predicate))
  (not (domain-effect (part-of ?operator) (predicate ?predicate)
                      (type ~?type) (param-names $?args ?)))
  =>
  (domain-report value-predicate-without-paired-effect
    "Effect " ?name " of operator " ?operator " on " ?predicate " (" (implode$ ?args)
    ") is not matched with a complementary effect"))
