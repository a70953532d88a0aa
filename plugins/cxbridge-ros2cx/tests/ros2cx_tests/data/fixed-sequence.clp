;; The plan that the recordings with a fixed sequence ran; the rule has the recorded name.
(defrule goal-expander-create-sequence
  ?g <- (goal (mode SELECTED) (id TESTGOAL))
  =>
  (bind ?stops (create$ wp_init wp1 wp2 wp3 wp4 wp5 wp6 wp_final))
  (assert (plan (id TESTGOAL-PLAN) (goal-id TESTGOAL)))
  (loop-for-count (?i 1 7)
    (assert (plan-action (id ?i) (plan-id TESTGOAL-PLAN) (goal-id TESTGOAL) (action-name move) (duration 4.0)
              (param-names r w1 w2) (param-values tb3 (nth$ ?i ?stops) (nth$ (+ ?i 1) ?stops)))))
  (modify ?g (mode EXPANDED)))
