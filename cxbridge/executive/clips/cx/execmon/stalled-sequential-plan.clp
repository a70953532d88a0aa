; stalled-sequential-plan.clp - fail a sequential plan that cannot go on

(defrule xm-stalled-sequential-plan-next-action-not-executable
  "Strict: as soon as nothing of the plan is going on, its next action must be executable.
   Do not load this file where an action may wait for its precondition to come true."
  (declare (salience ?*SALIENCE-LOW*))
  (plan-action (state FORMULATED) (id ?id) (plan-id ?plan) (goal-id ?goal))
  (not (plan-action (state FORMULATED) (id ?smaller&:(< ?smaller ?id))
                    (plan-id ?p&:(eq ?p ?plan)) (goal-id ?goal)))
  (plan-action (id ?id) (plan-id ?q&:(eq ?q ?plan)) (goal-id ?goal)
               (state FORMULATED) (executable FALSE) (action-name ?name))
  ?g <- (goal (id ?goal) (mode DISPATCHED) (committed-to ?r&:(eq ?r ?plan)))
  (plan (id ?s&:(eq ?s ?plan)) (goal-id ?goal) (type SEQUENTIAL))
  (not (plan-action (plan-id ?t&:(eq ?t ?plan)) (goal-id ?goal) (state ~FORMULATED&~FINAL&~FAILED)))
  =>
  (cx-modify-goal ?g (mode FINISHED) (outcome FAILED) (error STALLED-NONE-EXECUTABLE)
    (message (str-cat "Action " ?name " (goal " ?goal ", plan " ?plan ", action " ?id
                      ") not executable, but next in sequence"))))
