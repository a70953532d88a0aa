;;; One goal: the robot is in the store. A plan that becomes invalid is replaced.

(defglobal ?*DETOUR-GOAL-FORMULA* = "(at store)")

(defrule detour-begin
  "Formulate the goal once, when the domain is loaded and the Skiller is controlled."
  (domain-loaded)
  (skiller-control (skiller "robot") (acquired TRUE))
  (not (detour-begun))
  =>
  (assert (goal (id STORE) (class VISIT) (mode SELECTED))
          (detour-begun)))

(defrule detour-plan
  "Call the planner, which expands the goal with the plan, or fails the goal."
  (goal (id ?id) (class VISIT) (mode SELECTED))
  (not (planner-call (goal-id ?id)))
  =>
  (planner-plan ?id ?*DETOUR-GOAL-FORMULA*))

(defrule detour-set-skiller
  "The actions of a planner name the default Skiller; this scenario has the Skiller robot."
  ?action <- (plan-action (skiller "Skiller"))
  =>
  (modify ?action (skiller "robot")))

(defrule detour-commit
  "Commit to the only plan, after detour-set-skiller has changed all its actions."
  ?goal <- (goal (id ?id) (mode EXPANDED))
  (plan (id ?plan) (goal-id ?id))
  (not (plan-action (plan-id ?plan) (skiller "Skiller")))
  =>
  (modify ?goal (mode COMMITTED) (committed-to ?plan)))

(defrule detour-dispatch
  ?goal <- (goal (class VISIT) (mode COMMITTED))
  =>
  (modify ?goal (mode DISPATCHED)))

(defrule detour-replan
  "The world has changed and no action has failed: retract the plan when no action runs, and plan
   again. The salience is above that of the selection of the next action."
  (declare (salience ?*SALIENCE-MODERATE*))
  (plan-valid (plan-id ?plan) (valid FALSE) (message ?why))
  ?goal <- (goal (id ?id) (mode DISPATCHED) (committed-to ?plan))
  (not (plan-action (plan-id ?plan) (state ~FORMULATED&~FINAL)))
  =>
  (printout warn "Goal '" ?id "' is planned again: " ?why crlf)
  (plan-retract-all-for-goal ?id)
  (modify ?goal (mode SELECTED) (committed-to nil)))

(defrule detour-advance
  "A finished goal needs no decisions: advance it to its next mode."
  ?goal <- (goal (class VISIT) (mode ?mode&FINISHED|EVALUATED))
  =>
  (modify ?goal (mode (if (eq ?mode FINISHED) then EVALUATED else RETRACTED))))
