; sequential.clp - select the actions of a SEQUENTIAL plan, one after the other
;
; The goal comes first in the rule that selects, as in Fawkes, so that rules that react to the same change
; of a goal have the same order in the agenda. The search for an action in execution comes last, so that
; CLIPS makes it only for the next action of a plan.
;
; A plan is matched by (id ?p&:(eq ?p ?plan)) instead of (id ?plan), with a new variable in each
; condition, so that CLIPS hashes the join by the goal alone. Two hashed variables would be slower,
; because ids that are numbered together share few buckets (docs/evidence/core.md).

(defrule action-selection-sequential-select
  "All actions of the plan are FORMULATED or FINAL: select the FORMULATED one with the smallest id."
  (goal (id ?goal) (mode DISPATCHED) (committed-to ?plan))
  (plan (id ?p&:(eq ?p ?plan)) (goal-id ?goal) (type SEQUENTIAL) (suspended FALSE))
  ?next <- (plan-action (state FORMULATED) (id ?id) (plan-id ?q&:(eq ?q ?plan)) (goal-id ?goal))
  (not (plan-action (state FORMULATED) (id ?smaller&:(< ?smaller ?id))
                    (plan-id ?r&:(eq ?r ?plan)) (goal-id ?goal)))
  (not (plan-action (plan-id ?s&:(eq ?s ?plan)) (goal-id ?goal) (state ~FORMULATED&~FINAL)))
  =>
  (modify ?next (state PENDING)))

(defrule action-selection-sequential-done
  "All actions are FINAL, or the plan has no actions."
  ?goal-fact <- (goal (id ?goal) (committed-to ?plan) (mode DISPATCHED))
  (plan (type SEQUENTIAL) (goal-id ?goal) (id ?p&:(eq ?p ?plan)))
  (not (plan-action (state ~FINAL) (goal-id ?goal) (plan-id ?q&:(eq ?q ?plan))))
  =>
  (cx-modify-goal ?goal-fact (mode FINISHED) (outcome COMPLETED)))

(defrule action-selection-sequential-failed
  "A failed action fails the goal."
  (plan-action (state FAILED) (goal-id ?goal) (plan-id ?plan)
               (action-name ?name) (error-msg ?reason))
  ?goal-fact <- (goal (id ?goal) (committed-to ?p&:(eq ?p ?plan)) (mode DISPATCHED))
  (plan (type SEQUENTIAL) (goal-id ?goal) (id ?q&:(eq ?q ?plan)))
  =>
  (cx-modify-goal ?goal-fact (mode FINISHED) (outcome FAILED) (error ACTION-FAILED)
             (message (str-cat "Action " ?name " failed: " ?reason))))
