;;; The class AUTOMATIC-SUBGOAL: goals that need nobody to expand and evaluate them,
;;; because their sub-goals were made together with them.

(defrule automatic-subgoal-expand
  ?goal <- (goal (mode SELECTED) (class AUTOMATIC-SUBGOAL))
  => (cx-modify-goal ?goal (mode EXPANDED)))

(defrule automatic-subgoal-evaluate
  ?goal <- (goal (mode FINISHED) (class AUTOMATIC-SUBGOAL))
  => (cx-modify-goal ?goal (mode EVALUATED)))
