;;; One goal: all dishes are served. Its plan is temporal; the first parameter of an action is the cook.

(defglobal ?*BREAKFAST-GOAL-FORMULA* = "(and (served egg) (served toast))")

(defrule breakfast-begin
  "Formulate the goal once, when the domain is loaded and both Skillers are controlled."
  (domain-facts-loaded)
  (skiller-control (skiller "ann") (acquired TRUE))
  (skiller-control (skiller "ben") (acquired TRUE))
  (not (breakfast-begun))
  =>
  (assert (goal (id BREAKFAST) (class SERVE) (mode SELECTED))
          (breakfast-begun)))

(defrule breakfast-plan
  "Call the planner, which expands the goal with the plan, or fails the goal."
  (goal (id ?id) (class SERVE) (mode SELECTED))
  (not (planner-call (goal-id ?id)))
  =>
  (planner-plan ?id ?*BREAKFAST-GOAL-FORMULA*))

(defrule breakfast-set-skiller
  "The actions of a planner name the default Skiller; each cook has a separate Skiller."
  ?action <- (plan-action (skiller "Skiller") (param-values ?cook $?))
  =>
  (modify ?action (skiller (str-cat ?cook))))

(defrule breakfast-commit
  "Commit to the only plan, after breakfast-set-skiller has changed all its actions."
  ?goal <- (goal (id ?id) (mode EXPANDED))
  (plan (id ?plan) (goal-id ?id))
  (not (plan-action (plan-id ?plan) (skiller "Skiller")))
  =>
  (modify ?goal (mode COMMITTED) (committed-to ?plan)))

(defrule breakfast-dispatch
  ?goal <- (goal (class SERVE) (mode COMMITTED))
  =>
  (modify ?goal (mode DISPATCHED)))

(defrule breakfast-advance
  "A finished goal needs no decisions: advance it to its next mode."
  ?goal <- (goal (class SERVE) (mode ?mode&FINISHED|EVALUATED))
  =>
  (modify ?goal (mode (if (eq ?mode FINISHED) then EVALUATED else RETRACTED))))
