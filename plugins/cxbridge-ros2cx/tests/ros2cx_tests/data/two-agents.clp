;; Each of two agents has an action at the same time.
(defrule two-agents
  (executive-init)
  (ff-feature-loaded skill_execution)
  =>
  (assert (plan (id P) (goal-id G) (type SEQUENTIAL)))
  (loop-for-count (?number 1 2)
    (assert (plan-action (id ?number) (goal-id G) (plan-id P) (agent-id (str-cat robot ?number)) (duration 4.0)
              (dispatch-time 0.0) (state PENDING) (executable TRUE) (action-name move)
              (param-names r from to) (param-values tb3 wp_init (sym-cat wp ?number))))))
