; temporal-over-duration.clp - warn of actions that take longer than planned
;
; A plan is matched by (id ?p&:(eq ?p ?plan)) instead of (id ?plan), with a new variable in each
; condition, so that CLIPS hashes the join by the goal alone. Two hashed variables would be slower,
; because ids that are numbered together share few buckets (docs/evidence/core.md).
;
; The start-time (0 0) is the default: the action has no start yet.

(defrule xm-temporal-plan-warn-action-over-duration
  "An action runs longer than its planned duration: log it once, and add
   ACTION-OVER-DURATION, the action's id and its operator to the goal's warnings."
  (declare (salience ?*SALIENCE-LOW*))
  ?goal-fact <- (goal (id ?goal) (mode DISPATCHED) (committed-to ?plan) (warning $?warnings))
  (plan (id ?p&:(eq ?p ?plan)) (goal-id ?goal) (type TEMPORAL))
  (plan-action (goal-id ?goal) (plan-id ?q&:(eq ?q ?plan)) (state ~FORMULATED&~FINAL&~FAILED)
               (start-time $?start&~:(eq ?start (create$ 0 0))) (duration ?duration)
               (id ?id) (action-name ?name&~:(member$ (create$ ACTION-OVER-DURATION ?id ?name)
                                                      ?warnings)))
  (time $?now&:(timeout ?now ?start ?duration))
  =>
  (printout warn "Action " ?name " (goal " ?goal ", plan " ?plan ", action " ?id
                 ") running longer than expected (which was " ?duration " sec)" crlf)
  (cx-modify-goal ?goal-fact (warning ?warnings ACTION-OVER-DURATION ?id ?name)))
