;;; TIMEOUT-SUBGOAL: pursue the only sub-goal for a limited time.
;;;
;;;   params: timeout SECONDS   meta: start-time SEC USEC, from DISPATCHED on
;;;   the goal gets the outcome of the sub-goal
;;;   after SECONDS, a sub-goal that has not FINISHED yet and holds no resources is FAILED
;;;   no sub-goal, more than one, other params -> FAILED
;;;
;;; The rules have Fawkes' names. Those that end in -resources-clear wait until the sub-goal has
;;; released its resources.

(deffunction timeout-give-up (?goal ?error ?message)
  "Finish the goal as FAILED."
  (cx-modify-goal ?goal (mode FINISHED) (outcome FAILED) (error ?error) (message ?message)))

(defrule timeout-goal-failed-no-subgoal
  ?parent <- (goal (id ?id) (type ACHIEVE) (sub-type TIMEOUT-SUBGOAL) (mode EXPANDED))
  (not (goal (type ACHIEVE) (parent ?id)))
  =>
  (timeout-give-up ?parent NO-SUB-GOAL (str-cat "No sub-goal for TIMEOUT goal '" ?id "'")))

(defrule timeout-goal-failed-invalid-params
  ?parent <- (goal (id ?id) (type ACHIEVE) (sub-type TIMEOUT-SUBGOAL) (mode EXPANDED)
                   (params $?params&:(not (goal-param-positive ?params timeout))))
  =>
  (timeout-give-up ?parent INVALID-PARAMETERS
                   (str-cat "Invalid parameters for TIMEOUT goal '" ?id "': not (params timeout SECONDS)")))

(defrule timeout-goal-failed-many-subgoals
  ?parent <- (goal (id ?id) (type ACHIEVE) (sub-type TIMEOUT-SUBGOAL) (mode EXPANDED))
  (goal (id ?one) (parent ?id) (type ACHIEVE))
  (exists (goal (id ~?one) (parent ?id) (type ACHIEVE)))
  =>
  (timeout-give-up ?parent TOO-MANY-SUBGOALS
                   (str-cat "More than one sub-goal for TIMEOUT goal '" ?id "'")))

(defrule timeout-goal-auto-expand
  "The goal has its sub-goal already, so no other rule needs to expand it."
  ?parent <- (goal (id ?id) (type ACHIEVE) (sub-type TIMEOUT-SUBGOAL) (mode SELECTED))
  (exists (goal (parent ?id) (type ACHIEVE) (mode FORMULATED)))
  =>
  (cx-modify-goal ?parent (mode EXPANDED)))

(defrule timeout-goal-commit
  ?parent <- (goal (id ?id) (type ACHIEVE) (sub-type TIMEOUT-SUBGOAL) (mode EXPANDED)
                   (params $?params&:(goal-param-positive ?params timeout)))
  (goal (id ?sub) (parent ?id) (type ACHIEVE) (mode FORMULATED))
  (not (goal (id ~?sub) (parent ?id) (type ACHIEVE)))
  =>
  (cx-modify-goal ?parent (mode COMMITTED) (committed-to ?sub)))

(defrule timeout-goal-dispatch
  "The timeout begins."
  ?parent <- (goal (id ?id) (type ACHIEVE) (sub-type TIMEOUT-SUBGOAL) (mode COMMITTED)
                   (committed-to ?sub) (required-resources $?need)
                   (acquired-resources $?have&:(subsetp ?need ?have)))
  ?child <- (goal (id ?sub) (parent ?id) (type ACHIEVE) (mode FORMULATED))
  =>
  (cx-modify-goal ?parent (mode DISPATCHED) (meta start-time (now)))
  (cx-modify-goal ?child (mode SELECTED)))

(defrule timeout-goal-subgoal-timeout
  "The timeout has passed: fail the sub-goal. The conditions are in Fawkes' order, which decides which of
   several timeouts in one tick comes first."
  (time $?now)
  (goal (id ?id) (type ACHIEVE) (sub-type TIMEOUT-SUBGOAL) (mode DISPATCHED) (committed-to ?sub)
        (params timeout ?seconds) (meta start-time $?start&:(timeout ?now ?start ?seconds)))
  ?child <- (goal (id ?sub) (parent ?id) (acquired-resources) (type ACHIEVE)
                  (mode FORMULATED|SELECTED|EXPANDED|COMMITTED|DISPATCHED))
  =>
  (cx-modify-goal ?child (mode FINISHED) (outcome FAILED) (error TIMEOUT)
                 (message (str-cat "Parent " ?id " set FAILED due to timeout"))))

(defrule timeout-goal-subgoal-evaluated
  (goal (id ?id) (type ACHIEVE) (sub-type TIMEOUT-SUBGOAL) (mode DISPATCHED) (committed-to ?sub))
  ?child <- (goal (id ?sub) (parent ?id) (type ACHIEVE) (mode EVALUATED))
  =>
  (cx-modify-goal ?child (mode RETRACTED)))

(defrule timeout-goal-subgoal-failed-or-rejected-resources-clear
  "The goal gets the outcome and the error code of the sub-goal; without an error code, Fawkes' code
   SUBGOAL-FAILED or SUBGOAL-REJECTED, which other sub-types spell SUB-GOAL-."
  ?parent <- (goal (id ?id) (type ACHIEVE) (sub-type TIMEOUT-SUBGOAL) (mode DISPATCHED)
                   (committed-to ?sub))
  (goal (id ?sub) (parent ?id) (acquired-resources) (error $?errors) (type ACHIEVE) (mode RETRACTED)
        (outcome ?outcome&FAILED|REJECTED))
  =>
  (bind ?error (if (eq ?errors (create$)) then (sym-cat SUBGOAL- ?outcome) else (nth$ 1 ?errors)))
  (cx-modify-goal ?parent (mode FINISHED) (outcome ?outcome) (committed-to nil) (error ?error)
                  (message (str-cat "TIMEOUT goal '" ?id "' sub-goal '" ?sub "' " ?outcome
                                    " (error " ?error ")"))))

(defrule timeout-goal-subgoal-completed-resources-clear
  ?parent <- (goal (id ?id) (type ACHIEVE) (sub-type TIMEOUT-SUBGOAL) (mode DISPATCHED) (committed-to ?sub))
  (goal (id ?sub) (parent ?id) (acquired-resources) (type ACHIEVE) (mode RETRACTED) (outcome COMPLETED))
  =>
  (cx-modify-goal ?parent (mode FINISHED) (outcome COMPLETED)))
