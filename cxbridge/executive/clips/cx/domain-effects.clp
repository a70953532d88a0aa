; domain-effects.clp - what a successful action changes
;
; EXECUTION-SUCCEEDED -> [SENSED-EFFECTS-WAIT ->] SENSED-EFFECTS-HOLD -> EFFECTS-APPLIED -> FINAL,
; and EXECUTION-FAILED -> FAILED, all before a rule at salience 0 has its turn, except for the
; wait. Which conditional effects apply is settled at the first step, before anything changes.

(deftemplate domain-fact-removal
  "A negative effect on its way: the domain-fact goes before anything else happens."
  (slot key) (multislot values))

(deftemplate domain-numbers
  "How often values of functions have changed (revision), and the latest problem-function; there
   is none while no domain has functions (domain-numbers.clp)."
  (slot revision (default 0)) (slot newest (default 0)))

(deftemplate domain-numbers-due
  "An action has succeeded: its effects on numbers come with its other effects."
  (slot operator) (slot duration) (multislot names) (multislot values))

(deftemplate domain-awaited-atom
  "The key of a domain-pending-sensed-fact."
  (slot key) (multislot values) (slot type) (slot pending))

(deffunction domain-effects-met
  "Those of the effects that are not conditional, or whose condition is met."
  (?effects ?conditional ?met)
  (if (= (length$ ?conditional) 0) then (return ?effects))
  (bind ?applicable (create$))
  (progn$ (?effect ?effects)
    (bind ?name (fact-slot-value ?effect name))
    (if (or (not (member$ ?name ?conditional)) (member$ ?name ?met)) then
      (bind ?applicable (create$ ?applicable ?effect))))
  (return ?applicable))

(deffunction domain-effect-values (?effect ?action)
  (return (domain-ground-effect
    (fact-slot-value ?effect param-names) (fact-slot-value ?effect param-constants)
    (fact-slot-value ?action param-names) (fact-slot-value ?action param-values))))

(deffunction domain-action-await-effects
  "Expect these sensed effects."
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
  "Apply these effects. What one makes true another one does not make false."
  (?action ?effects)
  (bind ?made (create$))
  (progn$ (?effect ?effects)
    (if (eq (fact-slot-value ?effect type) POSITIVE) then
      (bind ?name (fact-slot-value ?effect predicate))
      (bind ?values (domain-effect-values ?effect ?action))
      (bind ?made (create$ ?made (domain-atom-key ?name ?values)))
      (assert (domain-fact (name ?name) (param-values ?values)))))
  (progn$ (?effect ?effects)
    (if (eq (fact-slot-value ?effect type) NEGATIVE) then
      (bind ?values (domain-effect-values ?effect ?action))
      (bind ?key (domain-atom-key (fact-slot-value ?effect predicate) ?values))
      (if (not (member$ ?key ?made)) then
        (assert (domain-fact-removal (key ?key) (values ?values))))))
  (if (any-factp ((?n domain-numbers)) TRUE) then
    (assert (domain-numbers-due
      (operator (fact-slot-value ?action action-name)) (duration (fact-slot-value ?action duration))
      (names (fact-slot-value ?action param-names)) (values (fact-slot-value ?action param-values)))))
  (modify ?action (state EFFECTS-APPLIED)))

(defrule domain-effects-remove-fact
  (declare (salience ?*SALIENCE-FIRST*))
  ?removal <- (domain-fact-removal (key ?key) (values $?values))
  (domain-true-atom (key ?key) (values $?values) (fact ?fact))
  =>
  (retract ?removal ?fact))

(defrule domain-effects-remove-no-fact
  (declare (salience ?*SALIENCE-FIRST*))
  ?removal <- (domain-fact-removal (key ?key) (values $?values))
  (not (domain-true-atom (key ?key) (values $?values)))
  =>
  (retract ?removal))

(defrule domain-effects-check-for-sensed
  (declare (salience ?*SALIENCE-DOMAIN-APPLY*))
  ?action <- (plan-action (state EXECUTION-SUCCEEDED) (action-name ?operator)
                          (goal-id ?goal) (plan-id ?plan))
  (domain-operator-effects (operator ?operator) (sensed $?effects) (conditional))
  (goal (id ?goal))
  (plan (goal-id ?goal) (id ?p&:(eq ?p ?plan)))
  =>
  (domain-action-await-effects ?action ?effects))

(defrule domain-effects-check-for-sensed-conditional
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
  (declare (salience ?*SALIENCE-DOMAIN-APPLY*))
  ?action <- (plan-action (state SENSED-EFFECTS-HOLD) (action-name ?operator)
                          (goal-id ?goal) (plan-id ?plan))
  (domain-operator-effects (operator ?operator) (direct $?effects) (conditional))
  (goal (id ?goal))
  (plan (goal-id ?goal) (id ?p&:(eq ?p ?plan)))
  =>
  (domain-action-apply-effects ?action ?effects))

(defrule domain-effects-apply-conditional
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
  "The operator does not wait for its sensed effects; they stay pending."
  (declare (salience ?*SALIENCE-DOMAIN-APPLY*))
  ?action <- (plan-action (state SENSED-EFFECTS-WAIT) (action-name ?operator))
  (domain-operator (name ?operator) (wait-sensed FALSE))
  =>
  (modify ?action (state SENSED-EFFECTS-HOLD)))

(defrule domain-effect-wait-sensed-done
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
