; sequential.clp - select the actions of a SEQUENTIAL plan, one after the other
;
; The goal comes first, as in Fawkes: among rules that wait for the same change of a goal the
; agenda has the same order then. Of a plan only the next action is compared with the others.

(defrule action-selection-sequential-select
  "Nothing is going on in the plan: the FORMULATED action with the smallest id is next."
  (goal (id ?goal) (mode DISPATCHED) (committed-to ?plan))
  (plan (id ?p&:(eq ?p ?plan)) (goal-id ?goal) (type SEQUENTIAL) (suspended FALSE))
  ?next <- (plan-action (state FORMULATED) (id ?id) (plan-id ?q&:(eq ?q ?plan)) (goal-id ?goal))
  (not (plan-action (state FORMULATED) (id ?smaller&:(< ?smaller ?id))
                    (plan-id ?r&:(eq ?r ?plan)) (goal-id ?goal)))
  (not (plan-action (plan-id ?s&:(eq ?s ?plan)) (goal-id ?goal) (state ~FORMULATED&~FINAL)))
  =>
  (modify ?next (state PENDING)))

(defrule action-selection-sequential-done
  "Each action is FINAL, or the plan has none."
  ?g <- (goal (id ?goal) (committed-to ?plan) (mode DISPATCHED))
  (plan (type SEQUENTIAL) (goal-id ?goal) (id ?p&:(eq ?p ?plan)))
  (not (plan-action (state ~FINAL) (goal-id ?goal) (plan-id ?q&:(eq ?q ?plan))))
  =>
  (cx-modify-goal ?g (mode FINISHED) (outcome COMPLETED)))

(defrule action-selection-sequential-failed
  "One failed action fails the goal."
  (plan-action (state FAILED) (goal-id ?goal) (plan-id ?plan)
               (action-name ?name) (error-msg ?reason))
  ?g <- (goal (id ?goal) (committed-to ?p&:(eq ?p ?plan)) (mode DISPATCHED))
  (plan (type SEQUENTIAL) (goal-id ?goal) (id ?q&:(eq ?q ?plan)))
  =>
  (cx-modify-goal ?g (mode FINISHED) (outcome FAILED) (error ACTION-FAILED)
             (message (str-cat "Action " ?name " failed: " ?reason))))
