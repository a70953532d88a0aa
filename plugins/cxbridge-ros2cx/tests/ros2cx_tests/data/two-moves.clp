;; Two actions of one agent, one after the other: what was asserted last comes first.
(defrule two-moves
  (executive-init)
  (ff-feature-loaded skill_execution)
  =>
  (assert (plan (id P) (goal-id G) (type SEQUENTIAL)))
  (loop-for-count (?number 1 2)
    (assert (plan-action (id (- 3 ?number)) (goal-id G) (plan-id P) (duration 4.0) (dispatch-time 0.0)
              (state PENDING) (executable TRUE) (action-name move)
              (param-names r from to) (param-values tb3 wp_init (sym-cat wp (- 3 ?number)))))))
