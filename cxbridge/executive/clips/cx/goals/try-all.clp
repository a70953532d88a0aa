;;; TRY-ALL-OF-SUBGOALS: pursue the sub-goals one after the other until a sub-goal completes.
;;;
;;; sub-goals by priority, the highest first
;;;   COMPLETED -> COMPLETED   FAILED, REJECTED -> the next one
;;;   after the last: FAILED if a sub-goal FAILED, else REJECTED
;;;   no sub-goals -> FAILED
;;;
;;; The rules have Fawkes' names. Those that end in -resources-clear wait until the sub-goal has
;;; released its resources.

(defrule try-all-goal-expand-failed
  "The goal has no sub-goals."
  ?parent <- (goal (id ?id) (type ACHIEVE) (sub-type TRY-ALL-OF-SUBGOALS) (mode EXPANDED))
  (not (goal (type ACHIEVE) (parent ?id)))
  =>
  (cx-modify-goal ?parent (mode FINISHED) (outcome FAILED) (error NO-SUB-GOALS)
                  (message (str-cat "No sub-goal for TRY-ALL goal '" ?id "'"))))

(defrule try-all-goal-reject
  "All sub-goals were rejected."
  ?parent <- (goal (id ?id) (type ACHIEVE) (sub-type TRY-ALL-OF-SUBGOALS) (mode EXPANDED))
  (exists (goal (parent ?id) (type ACHIEVE)))
  (not (goal (parent ?id) (type ACHIEVE) (mode ~RETRACTED)))
  (not (goal (parent ?id) (type ACHIEVE) (outcome ~REJECTED)))
  (not (goal (parent ?id) (type ACHIEVE) (acquired-resources ? $?)))
  =>
  (cx-modify-goal ?parent (mode FINISHED) (outcome REJECTED) (committed-to nil)
                  (error SUB-GOALS-REJECTED)))

(defrule try-all-goal-failed
  "No sub-goal has completed, and at least one has failed."
  ?parent <- (goal (id ?id) (type ACHIEVE) (sub-type TRY-ALL-OF-SUBGOALS) (mode EXPANDED))
  (exists (goal (parent ?id) (type ACHIEVE) (outcome FAILED)))
  (not (goal (parent ?id) (type ACHIEVE) (mode ~RETRACTED)))
  (not (goal (parent ?id) (type ACHIEVE) (outcome ~FAILED&~REJECTED)))
  (not (goal (parent ?id) (type ACHIEVE) (acquired-resources ? $?)))
  =>
  (cx-modify-goal ?parent (mode FINISHED) (outcome FAILED) (committed-to nil)
                  (error SUB-GOALS-FAILED)))

(defrule try-all-goal-commit
  ?parent <- (goal (id ?id) (type ACHIEVE) (sub-type TRY-ALL-OF-SUBGOALS) (mode EXPANDED))
  (goal (id ?next) (parent ?id) (type ACHIEVE) (mode FORMULATED) (priority ?priority))
  (not (goal (parent ?id) (type ACHIEVE) (mode FORMULATED) (priority ?p&:(> ?p ?priority))))
  =>
  (cx-modify-goal ?parent (mode COMMITTED) (committed-to ?next)))

(defrule try-all-goal-dispatch
  ?parent <- (goal (id ?id) (type ACHIEVE) (sub-type TRY-ALL-OF-SUBGOALS) (mode COMMITTED)
                   (committed-to ?next) (required-resources $?need)
                   (acquired-resources $?have&:(subsetp ?need ?have)))
  ?child <- (goal (id ?next) (parent ?id) (type ACHIEVE) (mode FORMULATED))
  =>
  (cx-modify-goal ?parent (mode DISPATCHED))
  (cx-modify-goal ?child (mode SELECTED)))

(defrule try-all-goal-subgoal-evaluated
  (goal (id ?id) (type ACHIEVE) (sub-type TRY-ALL-OF-SUBGOALS) (mode DISPATCHED) (committed-to ?sub))
  ?child <- (goal (id ?sub) (parent ?id) (type ACHIEVE) (mode EVALUATED))
  =>
  (cx-modify-goal ?child (mode RETRACTED)))

(defrule try-all-goal-subgoal-failed-or-rejected-resources-clear
  ?parent <- (goal (id ?id) (type ACHIEVE) (sub-type TRY-ALL-OF-SUBGOALS)
                   (mode DISPATCHED) (committed-to ?sub))
  (goal (id ?sub) (parent ?id) (acquired-resources) (type ACHIEVE) (mode RETRACTED) (outcome FAILED|REJECTED))
  =>
  (cx-modify-goal ?parent (mode EXPANDED) (committed-to nil)))

(defrule try-all-goal-subgoal-completed-resources-clear
  ?parent <- (goal (id ?id) (type ACHIEVE) (sub-type TRY-ALL-OF-SUBGOALS)
                   (mode DISPATCHED) (committed-to ?sub))
  (goal (id ?sub) (parent ?id) (acquired-resources) (type ACHIEVE) (mode RETRACTED) (outcome COMPLETED))
  =>
  (cx-modify-goal ?parent (mode FINISHED) (outcome COMPLETED) (committed-to nil)))
