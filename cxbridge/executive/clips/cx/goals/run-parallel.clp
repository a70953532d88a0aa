;;; RUN-SUBGOALS-IN-PARALLEL: pursue all sub-goals at the same time.
;;;
;;; Sub-goals of equal priority are selected together; sub-goals of the next lower priority
;;; follow when all sub-goals before them are DISPATCHED or further. After the bad outcome
;;; of a sub-goal, sub-goals that are still FORMULATED are rejected. Bad outcomes are
;;; FAILED and REJECTED; with continue-on REJECTED: FAILED; with continue-on FAILED: none.
;;; The outcome is FAILED if a sub-goal FAILED, else REJECTED if a sub-goal was REJECTED,
;;; else COMPLETED. The parent is not committed to a sub-goal.
;;;
;;; The rules about due sub-goals are ours; all others have Fawkes' names.

(deffunction run-parallel-stop-execution (?params ?sub-goal-outcome)
  "TRUE if no further sub-goal may begin after this outcome. The option continue-on may be anywhere in
   the parameters, followed by the tolerated outcome."
  (if (not (member$ ?sub-goal-outcome (create$ FAILED REJECTED))) then (return FALSE))
  (progn$ (?key ?params)
    (if (and (eq ?key continue-on) (< ?key-index (length$ ?params))) then
      (bind ?tolerated (nth$ (+ ?key-index 1) ?params))
      (if (or (eq ?tolerated FAILED) (eq ?tolerated ?sub-goal-outcome)) then (return FALSE))))
  TRUE)

(defrule run-parallel-goal-expand-failed
  "The goal has no sub-goals."
  ?parent <- (goal (id ?id) (type ACHIEVE) (sub-type RUN-SUBGOALS-IN-PARALLEL) (mode EXPANDED))
  (not (goal (type ACHIEVE) (parent ?id)))
  =>
  (cx-modify-goal ?parent (mode FINISHED) (outcome FAILED) (error NO-SUB-GOALS)
                  (message (str-cat "No sub-goal for RUN-PARALLEL goal '" ?id "'"))))

(defrule run-parallel-goal-commit
  ?parent <- (goal (id ?id) (type ACHIEVE) (sub-type RUN-SUBGOALS-IN-PARALLEL) (mode EXPANDED))
  (exists (goal (parent ?id) (type ACHIEVE) (mode FORMULATED)))
  =>
  (cx-modify-goal ?parent (mode COMMITTED)))

(defrule run-parallel-goal-dispatch
  ?parent <- (goal (type ACHIEVE) (sub-type RUN-SUBGOALS-IN-PARALLEL) (mode COMMITTED)
                   (required-resources $?need)
                   (acquired-resources $?have&:(subsetp ?need ?have)))
  =>
  (cx-modify-goal ?parent (mode DISPATCHED)))

(defrule run-parallel-subgoals-select
  "All FORMULATED sub-goals of the highest priority are due; the rules below select them."
  (goal (id ?id) (type ACHIEVE) (sub-type RUN-SUBGOALS-IN-PARALLEL) (mode DISPATCHED)
        (params $?params))
  (goal (parent ?id) (type ACHIEVE) (mode FORMULATED) (priority ?priority))
  (not (goal (parent ?id) (type ACHIEVE) (mode FORMULATED) (priority ?p&:(> ?p ?priority))))
  (not (goal (parent ?id) (type ACHIEVE) (mode SELECTED|EXPANDED|COMMITTED)))
  (not (goal (parent ?id) (type ACHIEVE)
             (outcome ?outcome&:(run-parallel-stop-execution ?params ?outcome))))
  =>
  (assert (run-parallel-due ?id ?priority)))

;; Fawkes selects the due sub-goals in the order of their facts, the oldest first, and MAINTAIN goals, too.
;; The order decides which of the goals that wait for the same skiller gets it. The agenda runs
;; activations of the newest fact first. So run-parallel-subgoal-note-due asserts a run-parallel-next
;; for each sub-goal, from the newest sub-goal to the oldest, and run-parallel-subgoal-select-due takes
;; the newest of these facts first, which is that of the oldest sub-goal. The saliences FIRST, FIRST - 1
;; and FIRST - 2 keep the three steps apart: note all, select all, forget the request.

(defrule run-parallel-subgoal-note-due
  "The first step: note the due sub-goals."
  (declare (salience ?*SALIENCE-FIRST*))
  (run-parallel-due ?id ?priority)
  (goal (id ?sub) (parent ?id) (mode FORMULATED) (priority ?priority))
  =>
  (assert (run-parallel-next ?id ?sub)))

(defrule run-parallel-subgoal-select-due
  "The second step, for all sub-goals before other rules react to the first selected sub-goal."
  (declare (salience (- ?*SALIENCE-FIRST* 1)))
  ?next <- (run-parallel-next ?id ?sub)
  ?child <- (goal (id ?sub) (parent ?id) (mode FORMULATED))
  =>
  (retract ?next)
  (cx-modify-goal ?child (mode SELECTED)))

(defrule run-parallel-subgoal-not-formulated
  "The sub-goal was retracted or changed before its selection."
  (declare (salience (- ?*SALIENCE-FIRST* 1)))
  ?next <- (run-parallel-next ?id ?sub)
  (not (goal (id ?sub) (parent ?id) (mode FORMULATED)))
  =>
  (retract ?next))

(defrule run-parallel-subgoals-selected
  "The third step: forget the request."
  (declare (salience (- ?*SALIENCE-FIRST* 2)))
  ?due <- (run-parallel-due ?id ?priority)
  =>
  (retract ?due))

(defrule run-parallel-subgoal-reject-other-subgoal-rejected
  "Reject the sub-goal of the lowest priority first. The condition on the goal with the bad outcome
   comes last, as in Fawkes, because the last condition decides the place of the activation in the
   agenda."
  (goal (id ?id) (type ACHIEVE) (sub-type RUN-SUBGOALS-IN-PARALLEL) (mode DISPATCHED)
        (params $?params))
  ?child <- (goal (parent ?id) (type ACHIEVE) (mode FORMULATED) (priority ?priority))
  (not (goal (parent ?id) (type ACHIEVE) (mode FORMULATED) (priority ?p&:(< ?p ?priority))))
  (not (goal (parent ?id) (type ACHIEVE) (mode SELECTED|EXPANDED|COMMITTED)))
  (goal (parent ?id) (type ACHIEVE)
        (outcome ?outcome&:(run-parallel-stop-execution ?params ?outcome)))
  =>
  (cx-modify-goal ?child (mode FINISHED) (outcome REJECTED)))

(defrule run-parallel-subgoal-evaluated
  (goal (id ?id) (type ACHIEVE) (sub-type RUN-SUBGOALS-IN-PARALLEL) (mode DISPATCHED))
  ?child <- (goal (parent ?id) (type ACHIEVE) (mode EVALUATED))
  =>
  (cx-modify-goal ?child (mode RETRACTED)))

(deffunction run-parallel-blame (?goal ?id ?outcome ?verb-phrase)
  "Finish the parent with this outcome if a sub-goal has the outcome, and return whether a sub-goal has
   it. The error names the first such sub-goal in the order of facts: the one whose last change is the
   oldest, because each change of a goal makes a new fact."
  (do-for-fact ((?sub goal)) (and (eq ?sub:parent ?id) (eq ?sub:outcome ?outcome))
    (cx-modify-goal ?goal (mode FINISHED) (outcome ?outcome) (error (sym-cat SUB-GOAL- ?outcome) ?sub:id)
                       (message
                         (str-cat "Sub-goal '" ?sub:id "' of RUN-PARALLEL goal '" ?id "' " ?verb-phrase)))
    (return TRUE))
  FALSE)

(defrule run-parallel-goal-finish-all-subgoals-retracted
  "All sub-goals are RETRACTED and have released their resources."
  ?parent <- (goal (id ?id) (type ACHIEVE) (sub-type RUN-SUBGOALS-IN-PARALLEL) (mode DISPATCHED))
  (not (goal (parent ?id) (type ACHIEVE) (acquired-resources ? $?)))
  (not (goal (parent ?id) (type ACHIEVE) (mode ~RETRACTED)))
  =>
  (if (not (or (run-parallel-blame ?parent ?id FAILED "has failed")
               (run-parallel-blame ?parent ?id REJECTED "was rejected")))
   then (cx-modify-goal ?parent (mode FINISHED) (outcome COMPLETED))))
