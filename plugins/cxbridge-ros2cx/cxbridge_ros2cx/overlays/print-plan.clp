;;; A plan for goals of the class PRINT: talk-plan-temporal.clp has only plans for goals of the class TALK.

(defrule print-plan
  (goal (id ?goal) (class PRINT) (mode SELECTED))
  (not (plan (goal-id ?goal)))
  =>
  (bind ?plan (sym-cat ?goal -PLAN))
  (assert (plan (id ?plan) (goal-id ?goal) (type SEQUENTIAL))
          (plan-action (id 1) (goal-id ?goal) (plan-id ?plan) (action-name print)
                       (param-names severity text) (param-values warn (str-cat ?goal " prints")))))
