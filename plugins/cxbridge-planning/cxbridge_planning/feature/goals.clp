; goals.clp - the effect of a plan on its goal. Loaded by the feature `planner` once the
; templates of goals and plans exist.

(defrule planner-goal-expanded
  "Expand the goal of a plan."
  ?call <- (planner-call (goal-id ?goal-id) (status PLANNED))
  ?goal <- (goal (id ?goal-id) (mode SELECTED))
  =>
  (retract ?call)
  (cx-modify-goal ?goal (mode EXPANDED)))

(defrule planner-goal-failed
  "Fail the goal of a call that has ended without a plan, unless the call was cancelled."
  ?call <- (planner-call (goal-id ?goal-id) (status ?status&NO-PLAN|FAILED|TIMEOUT|INVALID)
                         (message ?message))
  ?goal <- (goal (id ?goal-id) (mode SELECTED))
  =>
  (printout error "No plan for goal '" ?goal-id "': " ?message crlf)
  (retract ?call)
  (cx-modify-goal ?goal (mode FINISHED) (outcome FAILED) (error PLANNING ?status) (message ?message)))

(defrule planner-call-without-selected-goal
  "Drop the call of a goal that is not in the mode SELECTED; cancel the call if it is running."
  ?call <- (planner-call (id ?id) (goal-id ?goal-id&~nil) (status ?status))
  (not (goal (id ?goal-id) (mode SELECTED)))
  =>
  (if (eq ?status RUNNING) then (planner-cancel ?id))
  (retract ?call))

(defrule planner-plan-check-after-action
  "After each action, check the rest of the plan. The salience is above that of action selection."
  (declare (salience ?*SALIENCE-HIGH*))
  (plan-valid (plan-id ?plan))
  (plan-action (plan-id ?plan) (state FINAL))
  =>
  (planner-check ?plan))

(defrule planner-plan-valid-without-plan
  "Retract the plan-valid fact of a plan that was retracted."
  ?valid <- (plan-valid (plan-id ?plan))
  (not (plan (id ?plan)))
  =>
  (retract ?valid))
