; stalled-action.clp - fail an action that no executor picks up

(defrule xm-stalled-action-pending
  "Executors start PENDING actions at higher saliences. An action that is still PENDING at this
   salience has no executor, or its precondition is not satisfied."
  (declare (salience ?*SALIENCE-LOW*))
  ?stalled <- (plan-action (state PENDING) (action-name ?name) (goal-id ?goal) (plan-id ?plan))
  (goal (id ?goal) (committed-to ?p&:(eq ?p ?plan)) (mode DISPATCHED))
  (plan (id ?q&:(eq ?q ?plan)) (goal-id ?goal))
  =>
  (modify ?stalled
    (state FAILED) (error-msg (str-cat "No action executor for action '" ?name "'"))))
