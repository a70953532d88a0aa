; temporal.clp - select the actions of a TEMPORAL plan at their dispatch times
;
; Dispatch times count from the start of the plan, which is the moment when its goal is found
; DISPATCHED. Nothing is selected before that moment is known. The time fact comes last in the
; joins: a tick only looks at the actions that wait for their time.

(defrule action-selection-temporal-zerotime
  "Execution begins: note the time that the dispatch times count from."
  (goal (id ?goal) (committed-to ?plan) (mode DISPATCHED))
  ?started <- (plan (id ?p&:(eq ?p ?plan)) (goal-id ?goal) (type TEMPORAL)
              (suspended FALSE) (start-time 0 0))
  =>
  (modify ?started (start-time (now))))

(defrule action-selection-temporal-select
  "The dispatch time of an action has come."
  (goal (id ?goal) (committed-to ?plan) (mode DISPATCHED))
  (plan (id ?p&:(eq ?p ?plan)) (goal-id ?goal) (type TEMPORAL)
        (suspended FALSE) (start-time $?start&~:(eq ?start (create$ 0 0))))
  ?due <- (plan-action (state FORMULATED) (goal-id ?goal) (plan-id ?q&:(eq ?q ?plan))
                       (dispatch-time ?after))
  (time $?now&:(timeout ?now ?start ?after))
  =>
  (modify ?due (state PENDING) (start-time ?now)))

(defrule action-selection-temporal-done
  "Each action is FINAL, or the plan has none."
  ?g <- (goal (id ?goal) (committed-to ?plan) (mode DISPATCHED))
  (plan (type TEMPORAL) (goal-id ?goal) (id ?p&:(eq ?p ?plan)))
  (not (plan-action (state ~FINAL) (goal-id ?goal) (plan-id ?q&:(eq ?q ?plan))))
  =>
  (cx-modify-goal ?g (mode FINISHED) (outcome COMPLETED)))

(defrule action-selection-temporal-failed
  "One failed action fails the goal; other actions that run are not stopped."
  (plan-action (state FAILED) (goal-id ?goal) (plan-id ?plan))
  ?g <- (goal (id ?goal) (committed-to ?p&:(eq ?p ?plan)) (mode DISPATCHED))
  (plan (type TEMPORAL) (goal-id ?goal) (id ?q&:(eq ?q ?plan)))
  =>
  (cx-modify-goal ?g (mode FINISHED) (outcome FAILED)))
