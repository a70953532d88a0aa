; temporal-over-duration.clp - warn of actions that take longer than planned

(defrule xm-temporal-plan-warn-action-over-duration
  "An action runs longer than its planned duration: log it once, and add
   ACTION-OVER-DURATION, the action's id and its operator to the goal's warnings."
  (declare (salience ?*SALIENCE-LOW*))
  ?g <- (goal (id ?goal) (mode DISPATCHED) (committed-to ?plan) (warning $?warnings))
  (plan (id ?p&:(eq ?p ?plan)) (goal-id ?goal) (type TEMPORAL))
  (plan-action (goal-id ?goal) (plan-id ?q&:(eq ?q ?plan)) (state ~FORMULATED&~FINAL&~FAILED)
               (start-time $?start&~:(eq ?start (create$ 0 0))) (duration ?duration)
               (id ?id) (action-name ?name&~:(member$ (create$ ACTION-OVER-DURATION ?id ?name)
                                                      ?warnings)))
  (time $?now&:(timeout ?now ?start ?duration))
  =>
  (printout warn "Action " ?name " (goal " ?goal ", plan " ?plan ", action " ?id
                 ") running longer than expected (which was " ?duration " sec)" crlf)
  (cx-modify-goal ?g (warning ?warnings ACTION-OVER-DURATION ?id ?name)))
