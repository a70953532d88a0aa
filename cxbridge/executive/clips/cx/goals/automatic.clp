;;; Goals of the class AUTOMATIC-SUBGOAL: the rules of this file expand and evaluate them, so that
;;; agents need no rules for goals whose sub-goals are asserted together with them.

(defrule automatic-subgoal-expand
  ?goal <- (goal (mode SELECTED) (class AUTOMATIC-SUBGOAL))
  => (cx-modify-goal ?goal (mode EXPANDED)))

(defrule automatic-subgoal-evaluate
  ?goal <- (goal (mode FINISHED) (class AUTOMATIC-SUBGOAL))
  => (cx-modify-goal ?goal (mode EVALUATED)))
