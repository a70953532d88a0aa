; temporal-missed-dispatch.clp - warn of actions that are not selected in time
;
; A plan is matched by (id ?p&:(eq ?p ?plan)) instead of (id ?plan), with a new variable in each
; condition, so that CLIPS hashes the join by the goal alone. Two hashed variables would be slower,
; because ids that are numbered together share few buckets (docs/evidence/core.md).

(defrule xm-temporal-plan-missed-dispatch
  "The dispatch time of an action has passed, but the action is FORMULATED: log it once, and add
   ACTION-MISSED-DISPATCH, the action's id and its operator to the goal's warnings."
  (declare (salience ?*SALIENCE-LOW*))
  ?goal-fact <- (goal (id ?goal) (mode DISPATCHED) (committed-to ?plan) (warning $?warnings))
  (plan (id ?p&:(eq ?p ?plan)) (goal-id ?goal) (type TEMPORAL)
        (start-time $?start&~:(eq ?start (create$ 0 0))))
  (plan-action (goal-id ?goal) (plan-id ?q&:(eq ?q ?plan)) (state FORMULATED) (dispatch-time ?after)
               (id ?id) (action-name ?name&~:(member$ (create$ ACTION-MISSED-DISPATCH ?id ?name)
                                                      ?warnings)))
  (time $?now&:(timeout ?now ?start ?after))
  =>
  (printout warn "Action " ?name " (goal " ?goal ", plan " ?plan ", action " ?id
                 ") missed its dispatch time" crlf)
  (cx-modify-goal ?goal-fact (warning ?warnings ACTION-MISSED-DISPATCH ?id ?name)))
