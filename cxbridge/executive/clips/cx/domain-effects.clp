; domain-effects.clp - effects of successful actions
;
; EXECUTION-SUCCEEDED -> [SENSED-EFFECTS-WAIT ->] SENSED-EFFECTS-HOLD -> EFFECTS-APPLIED -> FINAL,
; and EXECUTION-FAILED -> FAILED, all before rules at salience 0 fire, except for the wait. The
; decision which conditional effects apply (domain-grounding.clp) comes before the first step, so that
; no effect of the action changes a condition.
;
; A plan is matched by (id ?p&:(eq ?p ?plan)) instead of (id ?plan), with a new variable in each
; condition, so that CLIPS hashes the join by the goal alone. Two hashed variables would be slower,
; because ids that are numbered together share few buckets (docs/evidence/core.md).

(deftemplate domain-fact-removal
  "A negative effect: the key of the domain-fact (domain-atom-key) that is retracted before rules
   of a lower salience fire."
  (slot key) (multislot values))

(deftemplate domain-numbers
  "The number of changes of function values (revision), and the index of the newest problem-function.
   The fact exists if the domain has functions (domain-numbers.clp)."
  (slot revision (default 0)) (slot newest (default 0)))

(deftemplate domain-numbers-due
  "An action that has succeeded, and whose effects on numbers are due with its other effects."
  (slot operator) (slot duration) (multislot names) (multislot values))

(deftemplate domain-awaited-atom
  "The key of a domain-pending-sensed-fact."
  (slot key) (multislot values) (slot type) (slot pending))

(deffunction domain-effects-met
  "The effects (fact addresses of domain-effects) that are not conditional, or whose condition is
   satisfied. ?conditional are the names of all conditional effects, ?met of those whose condition is
   satisfied."
  (?effects ?conditional ?met)
  (if (= (length$ ?conditional) 0) then (return ?effects))
  (bind ?applicable (create$))
  (progn$ (?effect ?effects)
    (bind ?name (fact-slot-value ?effect name))
    (if (or (not (member$ ?name ?conditional)) (member$ ?name ?met)) then
      (bind ?applicable (create$ ?applicable ?effect))))
  (return ?applicable))

(deffunction domain-effect-values
  "The values of an effect's terms for an action; both are fact addresses."
  (?effect ?action)
  (return (domain-ground-effect
    (fact-slot-value ?effect param-names) (fact-slot-value ?effect param-constants)
    (fact-slot-value ?action param-names) (fact-slot-value ?action param-values))))

(deffunction domain-action-await-effects
  "Assert the sensed effects as pending, and let the action wait for them (SENSED-EFFECTS-WAIT); an
   action without sensed effects continues with SENSED-EFFECTS-HOLD."
  (?action ?effects)
  (progn$ (?effect ?effects)
    (assert (domain-pending-sensed-fact
      (name (fact-slot-value ?effect predicate)) (type (fact-slot-value ?effect type))
      (param-values (domain-effect-values ?effect ?action))
      (action-id (fact-slot-value ?action id)) (plan-id (fact-slot-value ?action plan-id))
      (goal-id (fact-slot-value ?action goal-id)))))
  (modify ?action
    (state (if (> (length$ ?effects) 0) then SENSED-EFFECTS-WAIT else SENSED-EFFECTS-HOLD))))

(deffunction domain-action-apply-effects
  "Apply the effects. A positive effect has precedence over a negative effect on the same atom."
  (?action ?effects)
  (bind ?asserted-keys (create$))
  (progn$ (?effect ?effects)
    (if (eq (fact-slot-value ?effect type) POSITIVE) then
      (bind ?name (fact-slot-value ?effect predicate))
      (bind ?values (domain-effect-values ?effect ?action))
      (bind ?asserted-keys (create$ ?asserted-keys (domain-atom-key ?name ?values)))
      (assert (domain-fact (name ?name) (param-values ?values)))))
  (progn$ (?effect ?effects)
    (if (eq (fact-slot-value ?effect type) NEGATIVE) then
      (bind ?values (domain-effect-values ?effect ?action))
      (bind ?key (domain-atom-key (fact-slot-value ?effect predicate) ?values))
      (if (not (member$ ?key ?asserted-keys)) then
        (assert (domain-fact-removal (key ?key) (values ?values))))))
  ; the domain has functions
  (if (any-factp ((?n domain-numbers)) TRUE) then
    (assert (domain-numbers-due
      (operator (fact-slot-value ?action action-name)) (duration (fact-slot-value ?action duration))
      (names (fact-slot-value ?action param-names)) (values (fact-slot-value ?action param-values)))))
  (modify ?action (state EFFECTS-APPLIED)))

(defrule domain-effects-remove-fact
  "FIRST: no rule of a lower salience fires between the positive and the negative effects of an action."
  (declare (salience ?*SALIENCE-FIRST*))
  ?removal <- (domain-fact-removal (key ?key) (values $?values))
  (domain-true-atom (key ?key) (values $?values) (fact ?fact))
  =>
  (retract ?removal ?fact))

(defrule domain-effects-remove-no-fact
  "The atom is false already."
  (declare (salience ?*SALIENCE-FIRST*))
  ?removal <- (domain-fact-removal (key ?key) (values $?values))
  (not (domain-true-atom (key ?key) (values $?values)))
  =>
  (retract ?removal))

(defrule domain-effects-check-for-sensed
  "The first step, for an operator without conditional effects. As in Fawkes, an action without goal or
   plan stays EXECUTION-SUCCEEDED."
  (declare (salience ?*SALIENCE-DOMAIN-APPLY*))
  ?action <- (plan-action (state EXECUTION-SUCCEEDED) (action-name ?operator)
                          (goal-id ?goal) (plan-id ?plan))
  (domain-operator-effects (operator ?operator) (sensed $?effects) (conditional))
  (goal (id ?goal))
  (plan (goal-id ?goal) (id ?p&:(eq ?p ?plan)))
  =>
  (domain-action-await-effects ?action ?effects))

(defrule domain-effects-check-for-sensed-conditional
  "The first step, for an operator with conditional effects."
  (declare (salience ?*SALIENCE-DOMAIN-APPLY*))
  ?action <- (plan-action (state EXECUTION-SUCCEEDED) (action-name ?operator)
                          (goal-id ?goal) (plan-id ?plan) (precondition ?id))
  (domain-operator-effects (operator ?operator) (sensed $?effects)
                           (conditional $?conditional&:(> (length$ ?conditional) 0)))
  (domain-met-conditions (grounding ?id) (effects $?met))
  (goal (id ?goal))
  (plan (goal-id ?goal) (id ?p&:(eq ?p ?plan)))
  =>
  (domain-action-await-effects ?action (domain-effects-met ?effects ?conditional ?met)))

(defrule domain-effects-apply
  "Apply the effects on predicates that are not sensed, for an operator without conditional effects."
  (declare (salience ?*SALIENCE-DOMAIN-APPLY*))
  ?action <- (plan-action (state SENSED-EFFECTS-HOLD) (action-name ?operator)
                          (goal-id ?goal) (plan-id ?plan))
  (domain-operator-effects (operator ?operator) (direct $?effects) (conditional))
  (goal (id ?goal))
  (plan (goal-id ?goal) (id ?p&:(eq ?p ?plan)))
  =>
  (domain-action-apply-effects ?action ?effects))

(defrule domain-effects-apply-conditional
  "The same for an operator with conditional effects."
  (declare (salience ?*SALIENCE-DOMAIN-APPLY*))
  ?action <- (plan-action (state SENSED-EFFECTS-HOLD) (action-name ?operator)
                          (goal-id ?goal) (plan-id ?plan) (precondition ?id))
  (domain-operator-effects (operator ?operator) (direct $?effects)
                           (conditional $?conditional&:(> (length$ ?conditional) 0)))
  (domain-met-conditions (grounding ?id) (effects $?met))
  (goal (id ?goal))
  (plan (goal-id ?goal) (id ?p&:(eq ?p ?plan)))
  =>
  (domain-action-apply-effects ?action (domain-effects-met ?effects ?conditional ?met)))

(defrule domain-index-awaited-atom
  (declare (salience ?*SALIENCE-DOMAIN-GROUND*))
  (logical ?p <- (domain-pending-sensed-fact (name ?name) (param-values $?values) (type ?type)))
  =>
  (assert (domain-awaited-atom (key (domain-atom-key ?name ?values)) (values ?values)
                               (type ?type) (pending ?p))))

(defrule domain-effect-sensed-positive-holds
  (declare (salience ?*SALIENCE-DOMAIN-APPLY*))
  (domain-awaited-atom (type POSITIVE) (key ?key) (values $?values) (pending ?effect))
  (domain-true-atom (key ?key) (values $?values))
  =>
  (retract ?effect))

(defrule domain-effect-sensed-negative-holds
  (declare (salience ?*SALIENCE-DOMAIN-APPLY*))
  (domain-awaited-atom (type NEGATIVE) (key ?key) (values $?values) (pending ?effect))
  (not (domain-true-atom (key ?key) (values $?values)))
  =>
  (retract ?effect))

(defrule domain-effects-ignore-sensed
  "The operator does not wait for its sensed effects, which stay pending."
  (declare (salience ?*SALIENCE-DOMAIN-APPLY*))
  ?action <- (plan-action (state SENSED-EFFECTS-WAIT) (action-name ?operator))
  (domain-operator (name ?operator) (wait-sensed FALSE))
  =>
  (modify ?action (state SENSED-EFFECTS-HOLD)))

(defrule domain-effect-wait-sensed-done
  "All sensed effects of the action have been observed."
  (declare (salience ?*SALIENCE-DOMAIN-APPLY*))
  ?action <- (plan-action (state SENSED-EFFECTS-WAIT)
                          (id ?id) (plan-id ?plan) (goal-id ?goal))
  (not (domain-pending-sensed-fact (action-id ?a&:(eq ?a ?id)) (plan-id ?p&:(eq ?p ?plan))
                                   (goal-id ?goal)))
  =>
  (modify ?action (state SENSED-EFFECTS-HOLD)))

(defrule domain-effect-sensed-remove-on-removed-action
  ?effect <- (domain-pending-sensed-fact (action-id ?id) (plan-id ?plan) (goal-id ?goal))
  (not (plan-action (id ?a&:(eq ?a ?id)) (plan-id ?p&:(eq ?p ?plan)) (goal-id ?goal)))
  =>
  (retract ?effect))

(defrule domain-action-final
  (declare (salience ?*SALIENCE-DOMAIN-APPLY*))
  ?action <- (plan-action (state EFFECTS-APPLIED))
  =>
  (modify ?action (state FINAL) (precondition nil)))

(defrule domain-action-failed
  (declare (salience ?*SALIENCE-DOMAIN-APPLY*))
  ?action <- (plan-action (state EXECUTION-FAILED))
  =>
  (modify ?action (state FAILED) (precondition nil)))
