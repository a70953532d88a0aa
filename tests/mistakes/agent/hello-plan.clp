(defrule hello-expand
  ?goal <- (goal (id ?id) (class GREET) (mode SELECTED) (params who ?name))
  =>
  (assert (plan (id (sym-cat ?id -PLAN)) (goal-id ?id) (type SEQUENTIAL))
          (plan-action (id 1) (plan-id (sym-cat ?id -PLAN)) (goal-id ?id)
                       (action-name greet) (param-names who) (param-values ?name)))
  (modify ?goal (mode EXPANDED)))
