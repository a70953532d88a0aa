; stalled-sequential-plan.clp - fail a sequential plan that cannot continue
;
; A plan is matched by (id ?p&:(eq ?p ?plan)) instead of (id ?plan), with a new variable in each
; condition, so that CLIPS does not hash the join by goal and plan. These two hashed variables would
; be slower, because ids that are numbered together share few buckets (docs/evidence/core.md).

(defrule xm-stalled-sequential-plan-next-action-not-executable
  "While no action of the plan is in execution, its next action must be executable. Do not load
   this file if an action may wait until its precondition becomes true."
  (declare (salience ?*SALIENCE-LOW*))
  (plan-action (state FORMULATED) (id ?id) (plan-id ?plan) (goal-id ?goal))
  (not (plan-action (state FORMULATED) (id ?smaller&:(< ?smaller ?id))
                    (plan-id ?p&:(eq ?p ?plan)) (goal-id ?goal)))
  (plan-action (id ?id) (plan-id ?q&:(eq ?q ?plan)) (goal-id ?goal)
               (state FORMULATED) (executable FALSE) (action-name ?name))
  ?goal-fact <- (goal (id ?goal) (mode DISPATCHED) (committed-to ?r&:(eq ?r ?plan)))
  (plan (id ?s&:(eq ?s ?plan)) (goal-id ?goal) (type SEQUENTIAL))
  (not (plan-action (plan-id ?t&:(eq ?t ?plan)) (goal-id ?goal) (state ~FORMULATED&~FINAL&~FAILED)))
  =>
  (cx-modify-goal ?goal-fact (mode FINISHED) (outcome FAILED) (error STALLED-NONE-EXECUTABLE)
    (message (str-cat "Action " ?name " (goal " ?goal ", plan " ?plan ", action " ?id
                      ") not executable, but next in sequence"))))
