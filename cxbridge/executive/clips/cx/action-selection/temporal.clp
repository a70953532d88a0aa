; temporal.clp - select the actions of a TEMPORAL plan at their dispatch times
;
; Dispatch times count from the start of the plan: the first tick at which its goal is DISPATCHED and the
; plan is not suspended. The rule that selects actions has the time fact as its last condition, so that a
; tick only concerns the actions that wait for their dispatch time.
;
; A plan is matched by (id ?p&:(eq ?p ?plan)) instead of (id ?plan), with a new variable in each
; condition, so that CLIPS hashes the join by the goal alone. Two hashed variables would be slower,
; because ids that are numbered together share few buckets (docs/evidence/core.md).

(defrule action-selection-temporal-zerotime
  "The plan begins: store the time from which the dispatch times count."
  (goal (id ?goal) (committed-to ?plan) (mode DISPATCHED))
  ?started <- (plan (id ?p&:(eq ?p ?plan)) (goal-id ?goal) (type TEMPORAL)
              (suspended FALSE) (start-time 0 0))
  =>
  (modify ?started (start-time (now))))

(defrule action-selection-temporal-select
  "The dispatch time of an action has passed."
  (goal (id ?goal) (committed-to ?plan) (mode DISPATCHED))
  (plan (id ?p&:(eq ?p ?plan)) (goal-id ?goal) (type TEMPORAL)
        (suspended FALSE) (start-time $?start&~:(eq ?start (create$ 0 0))))
  ?due <- (plan-action (state FORMULATED) (goal-id ?goal) (plan-id ?q&:(eq ?q ?plan))
                       (dispatch-time ?after))
  (time $?now&:(timeout ?now ?start ?after))
  =>
  (modify ?due (state PENDING) (start-time ?now)))

(defrule action-selection-temporal-done
  "All actions are FINAL, or the plan has no actions."
  ?goal-fact <- (goal (id ?goal) (committed-to ?plan) (mode DISPATCHED))
  (plan (type TEMPORAL) (goal-id ?goal) (id ?p&:(eq ?p ?plan)))
  (not (plan-action (state ~FINAL) (goal-id ?goal) (plan-id ?q&:(eq ?q ?plan))))
  =>
  (cx-modify-goal ?goal-fact (mode FINISHED) (outcome COMPLETED)))

(defrule action-selection-temporal-failed
  "A failed action fails the goal; running actions continue. As in Fawkes, the goal gets neither an error
   nor a message."
  (plan-action (state FAILED) (goal-id ?goal) (plan-id ?plan))
  ?goal-fact <- (goal (id ?goal) (committed-to ?p&:(eq ?p ?plan)) (mode DISPATCHED))
  (plan (type TEMPORAL) (goal-id ?goal) (id ?q&:(eq ?q ?plan)))
  =>
  (cx-modify-goal ?goal-fact (mode FINISHED) (outcome FAILED)))
