;;; RUN-ONE-OF-SUBGOALS: the first sub-goal that is not rejected decides.
;;;
;;; sub-goals by priority, the highest first
;;;   COMPLETED -> COMPLETED   FAILED -> FAILED   REJECTED -> the next one
;;;   no sub-goals -> FAILED   all REJECTED -> REJECTED
;;;
;;; The rules have Fawkes' names. Those that end in -resources-clear wait until the sub-goal has
;;; released its resources.

(defrule run-one-goal-expand-failed
  "The goal has no sub-goals. As in Fawkes, the goal gets no error code."
  ?parent <- (goal (id ?id) (type ACHIEVE) (sub-type RUN-ONE-OF-SUBGOALS) (mode EXPANDED))
  (not (goal (type ACHIEVE) (parent ?id)))
  =>
  (cx-modify-goal ?parent (mode FINISHED) (outcome FAILED)
                  (message (str-cat "No sub-goal for RUN-ONE goal '" ?id "'"))))

(defrule run-one-goal-reject
  "All sub-goals were rejected."
  ?parent <- (goal (id ?id) (type ACHIEVE) (sub-type RUN-ONE-OF-SUBGOALS) (mode EXPANDED))
  (exists (goal (parent ?id) (type ACHIEVE)))
  (not (goal (parent ?id) (type ACHIEVE) (mode ~RETRACTED)))
  (not (goal (parent ?id) (type ACHIEVE) (outcome ~REJECTED)))
  =>
  (cx-modify-goal ?parent (mode FINISHED) (outcome REJECTED) (committed-to nil)
                  (error SUB-GOALS-REJECTED)))

(defrule run-one-goal-commit
  ?parent <- (goal (id ?id) (type ACHIEVE) (sub-type RUN-ONE-OF-SUBGOALS) (mode EXPANDED))
  (goal (id ?next) (parent ?id) (type ACHIEVE) (mode FORMULATED) (priority ?priority))
  (not (goal (parent ?id) (type ACHIEVE) (mode FORMULATED) (priority ?p&:(> ?p ?priority))))
  =>
  (cx-modify-goal ?parent (mode COMMITTED) (committed-to ?next)))

(defrule run-one-goal-dispatch
  ?parent <- (goal (id ?id) (type ACHIEVE) (sub-type RUN-ONE-OF-SUBGOALS) (mode COMMITTED)
                   (committed-to ?next) (required-resources $?need)
                   (acquired-resources $?have&:(subsetp ?need ?have)))
  ?child <- (goal (id ?next) (parent ?id) (type ACHIEVE) (mode FORMULATED))
  =>
  (cx-modify-goal ?parent (mode DISPATCHED))
  (cx-modify-goal ?child (mode SELECTED)))

(defrule run-one-goal-subgoal-evaluated
  (goal (id ?id) (type ACHIEVE) (sub-type RUN-ONE-OF-SUBGOALS) (mode DISPATCHED) (committed-to ?sub))
  ?child <- (goal (id ?sub) (parent ?id) (type ACHIEVE) (mode EVALUATED))
  =>
  (cx-modify-goal ?child (mode RETRACTED)))

(defrule run-one-goal-subgoal-rejected-resources-clear
  ?parent <- (goal (id ?id) (type ACHIEVE) (sub-type RUN-ONE-OF-SUBGOALS)
                   (mode DISPATCHED) (committed-to ?sub))
  (goal (id ?sub) (parent ?id) (acquired-resources) (type ACHIEVE) (mode RETRACTED) (outcome REJECTED))
  =>
  (cx-modify-goal ?parent (mode EXPANDED) (committed-to nil)))

(defrule run-one-goal-subgoal-failed-resources-clear
  ?parent <- (goal (id ?id) (type ACHIEVE) (sub-type RUN-ONE-OF-SUBGOALS)
                   (mode DISPATCHED) (committed-to ?sub))
  (goal (id ?sub) (parent ?id) (acquired-resources) (type ACHIEVE) (mode RETRACTED) (outcome FAILED))
  =>
  (cx-modify-goal ?parent (mode FINISHED) (outcome FAILED) (committed-to nil) (error SUB-GOAL-FAILED)
                  (message (str-cat "Sub-goal '" ?sub "' of RUN-ONE goal '" ?id "' has failed"))))

(defrule run-one-goal-subgoal-completed-resources-clear
  ?parent <- (goal (id ?id) (type ACHIEVE) (sub-type RUN-ONE-OF-SUBGOALS)
                   (mode DISPATCHED) (committed-to ?sub))
  (goal (id ?sub) (parent ?id) (acquired-resources) (type ACHIEVE) (mode RETRACTED) (outcome COMPLETED))
  =>
  (cx-modify-goal ?parent (mode FINISHED) (outcome COMPLETED) (committed-to nil)))
