; stalled-action.clp - fail an action that no executor picks up

(defrule xm-stalled-action-pending
  "An executor takes a PENDING action in the same run of the rules, before this salience is
   reached. An action that is still PENDING has no executor, or may not be executed."
  (declare (salience ?*SALIENCE-LOW*))
  ?stalled <- (plan-action (state PENDING) (action-name ?name) (goal-id ?goal) (plan-id ?plan))
  (goal (id ?goal) (committed-to ?p&:(eq ?p ?plan)) (mode DISPATCHED))
  (plan (id ?q&:(eq ?q ?plan)) (goal-id ?goal))
  =>
  (modify ?stalled
    (state FAILED) (error-msg (str-cat "No action executor for action '" ?name "'"))))
