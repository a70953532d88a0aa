; stalled-action.clp - fail an action that no executor picks up
;
; A plan is matched by (id ?p&:(eq ?p ?plan)) instead of (id ?plan), with a new variable in each
; condition, so that CLIPS hashes the join by the goal alone. Two hashed variables would be slower,
; because ids that are numbered together share few buckets (docs/evidence/core.md).

(defrule xm-stalled-action-pending
  "Executors start PENDING actions at higher saliences. An action that is still PENDING at this
   salience has no executor, or its precondition is not satisfied. As in Fawkes, the error names only
   the first cause."
  (declare (salience ?*SALIENCE-LOW*))
  ?stalled <- (plan-action (state PENDING) (action-name ?name) (goal-id ?goal) (plan-id ?plan))
  (goal (id ?goal) (committed-to ?p&:(eq ?p ?plan)) (mode DISPATCHED))
  (plan (id ?q&:(eq ?q ?plan)) (goal-id ?goal))
  =>
  (modify ?stalled
    (state FAILED) (error-msg (str-cat "No action executor for action '" ?name "'"))))
