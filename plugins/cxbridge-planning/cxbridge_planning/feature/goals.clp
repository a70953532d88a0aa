; goals.clp - what a plan means to the goal that it was made for. Loaded by the feature
; `planner` as soon as there are goals and plans.

(defrule planner-goal-expanded
  "The goal has its plan."
  ?call <- (planner-call (goal-id ?goal-id) (status PLANNED))
  ?goal <- (goal (id ?goal-id) (mode SELECTED))
  =>
  (retract ?call)
  (cx-modify-goal ?goal (mode EXPANDED)))

(defrule planner-goal-failed
  "There is no plan: the goal cannot be pursued."
  ?call <- (planner-call (goal-id ?goal-id) (status ?status&NO-PLAN|FAILED|TIMEOUT|INVALID) (message ?why))
  ?goal <- (goal (id ?goal-id) (mode SELECTED))
  =>
  (printout error "No plan for goal '" ?goal-id "': " ?why crlf)
  (retract ?call)
  (cx-modify-goal ?goal (mode FINISHED) (outcome FAILED) (error PLANNING ?status) (message ?why)))

(defrule planner-goal-changed-its-mind
  "Nobody waits for this plan any more."
  ?call <- (planner-call (id ?id) (goal-id ?goal-id&~nil) (status ?status))
  (not (goal (id ?goal-id) (mode SELECTED)))
  =>
  (if (eq ?status RUNNING) then (planner-cancel ?id))
  (retract ?call))

(defrule planner-plan-checked-before-the-next-action
  "An action is done: what is left is checked before another one is selected."
  (declare (salience ?*SALIENCE-HIGH*))
  (plan-valid (plan-id ?plan))
  (plan-action (plan-id ?plan) (state FINAL))
  =>
  (planner-check ?plan))

(defrule planner-plan-gone
  "Nobody asks any more whether this plan holds."
  ?valid <- (plan-valid (plan-id ?plan))
  (not (plan (id ?plan)))
  =>
  (retract ?valid))
