; sequential.clp - select the actions of a SEQUENTIAL plan, one after the other
;
; The next action of a plan is found before the goal is looked at: then a transition of an
; action is compared with the actions of its own plan only.

(defrule action-selection-sequential-select
  "Nothing is going on in the plan: the FORMULATED action with the smallest id is next."
  ?next <- (plan-action (state FORMULATED) (id ?id) (plan-id ?plan) (goal-id ?goal))
  (not (plan-action (state FORMULATED) (id ?smaller&:(< ?smaller ?id))
                    (plan-id ?p&:(eq ?p ?plan)) (goal-id ?goal)))
  (goal (id ?goal) (mode DISPATCHED) (committed-to ?q&:(eq ?q ?plan)))
  (plan (id ?r&:(eq ?r ?plan)) (goal-id ?goal) (type SEQUENTIAL) (suspended FALSE))
  (not (plan-action (plan-id ?s&:(eq ?s ?plan)) (goal-id ?goal) (state ~FORMULATED&~FINAL)))
  =>
  (modify ?next (state PENDING)))

(defrule action-selection-sequential-done
  "Each action is FINAL, or the plan has none."
  ?g <- (goal (id ?goal) (committed-to ?plan) (mode DISPATCHED))
  (plan (type SEQUENTIAL) (goal-id ?goal) (id ?p&:(eq ?p ?plan)))
  (not (plan-action (state ~FINAL) (goal-id ?goal) (plan-id ?q&:(eq ?q ?plan))))
  =>
  (modify-goal ?g (mode FINISHED) (outcome COMPLETED)))

(defrule action-selection-sequential-failed
  "One failed action fails the goal."
  (plan-action (state FAILED) (goal-id ?goal) (plan-id ?plan)
               (action-name ?name) (error-msg ?reason))
  ?g <- (goal (id ?goal) (committed-to ?p&:(eq ?p ?plan)) (mode DISPATCHED))
  (plan (type SEQUENTIAL) (goal-id ?goal) (id ?q&:(eq ?q ?plan)))
  =>
  (modify-goal ?g (mode FINISHED) (outcome FAILED) (error ACTION-FAILED)
             (message (str-cat "Action " ?name " failed: " ?reason))))
