; domain-exogenous.clp - preconditions of exogenous operators
;
; Another agent performs an exogenous action, perhaps before the plan reaches it. The sensed facts
; that the action changes may therefore have changed already, so its precondition must accept them.

(deffunction remove-precondition
  "Remove a pddl-predicate or pddl-formula (a fact) from its condition, with each negation, atom
   and disjunction that becomes empty. An empty conjunction replaces a condition of which nothing is
   left, and is always satisfied."
  (?precond-fact)
  (bind ?id (fact-slot-value ?precond-fact id))
  (bind ?part-of (fact-slot-value ?precond-fact part-of))
  (bind ?parent FALSE)
  (do-for-fact ((?f pddl-formula)) (eq ?f:id ?part-of) (bind ?parent ?f))
  (retract ?precond-fact)
  ; the fact was the root of the condition
  (if (not ?parent) then
    (assert (pddl-formula (id ?id) (part-of ?part-of) (type conjunction)))
    (return))
  (if (and (neq (fact-slot-value ?parent type) conjunction)
           (not (any-factp ((?f pddl-formula)) (eq ?f:part-of ?part-of)))
           (not (any-factp ((?p pddl-predicate)) (eq ?p:part-of ?part-of)))) then
    (remove-precondition ?parent)))

(defrule domain-remove-precond-on-sensed-nonval-effect-of-exog-action
  "A sensed effect of an exogenous action may occur before the plan reaches the action. Therefore the
   precondition must not depend on the atom of the effect."
  (domain-operator (name ?operator) (exogenous TRUE))
  (domain-effect (part-of ?operator) (predicate ?predicate)
                 (param-names $?names) (param-constants $?constants))
  (domain-predicate (name ?predicate) (sensed TRUE) (value-predicate FALSE))
  ?atom <- (pddl-predicate (predicate ?predicate) (id ?id)
                           (param-names $?names) (param-constants $?constants))
  (pddl-formula-node (id ?id) (root ?operator))
  =>
  (remove-precondition ?atom))

(deftemplate domain-exogenous-value
  "A disjunction of the values that the precondition of an exogenous operator accepts; marks that the
   precondition was replaced already."
  (slot formula))

(deffunction domain-term-equal
  "Whether two predicates have the same term, a constant or a parameter, at a position."
  (?place ?names ?constants ?other-names ?other-constants)
  (bind ?constant (nth$ ?place ?constants))
  (bind ?other (nth$ ?place ?other-constants))
  (if (and (eq ?constant nil) (eq ?other nil)) then
    (return (eq (nth$ ?place ?names) (nth$ ?place ?other-names))))
  (return (eq ?constant ?other)))

(deffunction domain-is-other-value
  "Whether two value predicates have equal arguments and different values."
  (?names ?constants ?other-names ?other-constants)
  (bind ?last (length$ ?names))
  (if (<> ?last (length$ ?other-names)) then (return FALSE))
  (loop-for-count (?place 1 (- ?last 1))
    (if (not (domain-term-equal ?place ?names ?constants ?other-names ?other-constants)) then
      (return FALSE)))
  (return (not (domain-term-equal ?last ?names ?constants ?other-names ?other-constants))))

(defrule domain-replace-precond-on-sensed-val-effect-of-exog-action
  "The precondition on a value also accepts the values that the action sets. A negated precondition
   stays unchanged, because a different value satisfies it already."
  (domain-operator (name ?operator) (exogenous TRUE))
  (domain-effect (part-of ?operator) (predicate ?predicate) (type POSITIVE)
                 (param-names $?names) (param-constants $?constants))
  (domain-predicate (name ?predicate) (sensed TRUE) (value-predicate TRUE))
  ?atom <- (pddl-predicate (predicate ?predicate) (id ?id) (part-of ?parent)
                           (param-names $?atom-names) (param-constants $?atom-constants))
  (pddl-formula-node (id ?id) (root ?operator))
  (not (domain-exogenous-value (formula ?parent)))
  (test (domain-is-other-value ?names ?constants ?atom-names ?atom-constants))
  =>
  (if (domain-is-formula-negative ?parent) then (return))
  ; the disjunction takes the id of the atom, whose id gets the suffix 1; the alternatives get 2, 3 ...
  (assert (domain-exogenous-value (formula ?id)))
  (assert (pddl-formula (id ?id) (part-of ?parent) (type disjunction)))
  (modify ?atom (id (sym-cat ?id 1)) (part-of ?id))
  (bind ?count 1)
  (do-for-all-facts ((?e domain-effect))
      (and (eq ?e:part-of ?operator) (eq ?e:predicate ?predicate) (eq ?e:type POSITIVE)
           (domain-is-other-value ?e:param-names ?e:param-constants ?atom-names ?atom-constants))
    (bind ?count (+ ?count 1))
    (assert (pddl-predicate (id (sym-cat ?id ?count)) (part-of ?id)
      (predicate ?predicate) (param-names ?e:param-names)
      (param-constants ?e:param-constants)))))
