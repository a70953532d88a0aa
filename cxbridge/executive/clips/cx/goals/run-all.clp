;;; RUN-ALL-OF-SUBGOALS: pursue the sub-goals one after the other; all must complete.
;;;
;;; sub-goals by priority, the highest first
;;;   COMPLETED -> the next one, or COMPLETED after the last
;;;   FAILED -> FAILED   REJECTED -> REJECTED   no sub-goals -> FAILED
;;;
;;; The rules have Fawkes' names. Those that end in -resources-clear wait until the sub-goal has
;;; released its resources.

(defrule run-all-goal-expand-failed
  "The goal has no sub-goals."
  ?parent <- (goal (id ?id) (type ACHIEVE) (sub-type RUN-ALL-OF-SUBGOALS) (mode EXPANDED))
  (not (goal (type ACHIEVE) (parent ?id)))
  =>
  (cx-modify-goal ?parent (mode FINISHED) (outcome FAILED) (error NO-SUB-GOALS)
                  (message (str-cat "No sub-goal for RUN-ALL goal '" ?id "'"))))

(defrule run-all-goal-commit
  ?parent <- (goal (id ?id) (type ACHIEVE) (sub-type RUN-ALL-OF-SUBGOALS) (mode EXPANDED))
  (goal (id ?next) (parent ?id) (type ACHIEVE) (mode FORMULATED) (priority ?priority))
  (not (goal (parent ?id) (type ACHIEVE) (mode FORMULATED) (priority ?p&:(> ?p ?priority))))
  =>
  (cx-modify-goal ?parent (mode COMMITTED) (committed-to ?next)))

(defrule run-all-goal-dispatch
  ?parent <- (goal (id ?id) (type ACHIEVE) (sub-type RUN-ALL-OF-SUBGOALS) (mode COMMITTED)
                   (committed-to ?next) (required-resources $?need)
                   (acquired-resources $?have&:(subsetp ?need ?have)))
  ?child <- (goal (id ?next) (parent ?id) (type ACHIEVE) (mode FORMULATED))
  =>
  (cx-modify-goal ?parent (mode DISPATCHED))
  (cx-modify-goal ?child (mode SELECTED)))

(defrule run-all-goal-subgoal-evaluated
  (goal (id ?id) (type ACHIEVE) (sub-type RUN-ALL-OF-SUBGOALS) (mode DISPATCHED) (committed-to ?sub))
  ?child <- (goal (id ?sub) (parent ?id) (type ACHIEVE) (mode EVALUATED))
  =>
  (cx-modify-goal ?child (mode RETRACTED)))

(defrule run-all-goal-subgoal-rejected-resources-clear
  "The error does not name the sub-goal, as in Fawkes."
  ?parent <- (goal (id ?id) (type ACHIEVE) (sub-type RUN-ALL-OF-SUBGOALS)
                   (mode DISPATCHED) (committed-to ?sub))
  (goal (id ?sub) (parent ?id) (acquired-resources) (type ACHIEVE) (mode RETRACTED) (outcome REJECTED))
  =>
  (cx-modify-goal ?parent (mode FINISHED) (outcome REJECTED) (committed-to nil) (error SUB-GOAL-REJECTED)
                  (message (str-cat "Sub-goal '" ?sub "' of RUN-ALL goal '" ?id "' was rejected"))))

(defrule run-all-goal-subgoal-failed-resources-clear
  ?parent <- (goal (id ?id) (type ACHIEVE) (sub-type RUN-ALL-OF-SUBGOALS)
                   (mode DISPATCHED) (committed-to ?sub))
  (goal (id ?sub) (parent ?id) (acquired-resources) (type ACHIEVE) (mode RETRACTED) (outcome FAILED))
  =>
  (cx-modify-goal ?parent (mode FINISHED) (outcome FAILED) (committed-to nil) (error SUB-GOAL-FAILED ?sub)
                  (message (str-cat "Sub-goal '" ?sub "' of RUN-ALL goal '" ?id "' has failed"))))

(defrule run-all-goal-subgoal-completed-one-resources-clear
  "Further sub-goals are left."
  ?parent <- (goal (id ?id) (type ACHIEVE) (sub-type RUN-ALL-OF-SUBGOALS)
                   (mode DISPATCHED) (committed-to ?sub))
  (goal (id ?sub) (parent ?id) (acquired-resources) (type ACHIEVE) (mode RETRACTED) (outcome COMPLETED))
  (exists (goal (parent ?id) (type ACHIEVE) (mode FORMULATED)))
  =>
  (cx-modify-goal ?parent (mode EXPANDED) (committed-to nil)))

(defrule run-all-goal-subgoal-completed-all-resources-clear
  "The last sub-goal has completed."
  ?parent <- (goal (id ?id) (type ACHIEVE) (sub-type RUN-ALL-OF-SUBGOALS)
                   (mode DISPATCHED) (committed-to ?sub))
  (goal (id ?sub) (parent ?id) (acquired-resources) (type ACHIEVE) (mode RETRACTED) (outcome COMPLETED))
  (not (goal (parent ?id) (type ACHIEVE) (mode FORMULATED)))
  =>
  (cx-modify-goal ?parent (mode FINISHED) (outcome COMPLETED) (committed-to nil)))
