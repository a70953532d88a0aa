;;; Goals without sub-goals. TALK and PRINT have a plan; rules play the other goals.

(defrule talk-player-expand
  ?goal <- (goal (mode SELECTED) (class ALWAYS-REJECT|ALWAYS-FAIL|HANG-NOOP|SUCCEED-SECOND-TRY))
  =>
  (modify ?goal (mode EXPANDED)))

(defrule talk-player-reject
  ?goal <- (goal (mode EXPANDED) (class ALWAYS-REJECT))
  =>
  (modify ?goal (mode FINISHED) (outcome REJECTED)))

(defrule talk-player-commit-and-dispatch
  ?goal <- (goal (mode ?mode&EXPANDED|COMMITTED) (class ALWAYS-FAIL|HANG-NOOP|SUCCEED-SECOND-TRY))
  =>
  (modify ?goal (mode (if (eq ?mode EXPANDED) then COMMITTED else DISPATCHED))))

(defrule talk-player-fail
  ?goal <- (goal (mode DISPATCHED) (class ALWAYS-FAIL))
  =>
  (modify ?goal (mode FINISHED) (outcome FAILED)))

(defrule talk-player-second-try
  "A goal keeps its meta data when it is tried again."
  ?goal <- (goal (mode DISPATCHED) (class SUCCEED-SECOND-TRY) (meta $?meta))
  =>
  (if (member$ tried-once ?meta)
   then (modify ?goal (mode FINISHED) (outcome COMPLETED))
   else (modify ?goal (mode FINISHED) (outcome FAILED) (meta tried-once))))

(defrule talk-player-evaluate
  ?goal <- (goal (mode FINISHED) (class ALWAYS-REJECT|ALWAYS-FAIL|HANG-NOOP|SUCCEED-SECOND-TRY))
  =>
  (modify ?goal (mode EVALUATED)))

;; ---- goals with a plan

(defrule talk-planned-expand
  "talk-plans.clp has asserted a plan."
  ?goal <- (goal (id ?id) (mode SELECTED) (class TALK|PRINT))
  (exists (plan (goal-id ?id)))
  =>
  (modify ?goal (mode EXPANDED)))

(defrule talk-planned-commit
  ?goal <- (goal (id ?id) (mode EXPANDED) (class TALK|PRINT))
  (plan (id ?plan) (goal-id ?id))
  =>
  (modify ?goal (mode COMMITTED) (committed-to ?plan)))

(defrule talk-planned-dispatch
  "Dispatch a goal that has acquired all resources that it needs."
  ?goal <- (goal (mode COMMITTED) (class TALK|PRINT) (required-resources $?need)
                 (acquired-resources $?have&:(subsetp ?need ?have)))
  =>
  (modify ?goal (mode DISPATCHED)))

(defrule talk-planned-evaluate
  ?goal <- (goal (id ?id) (mode FINISHED) (class TALK|PRINT) (outcome ?outcome))
  =>
  (printout t "Goal '" ?id "' is " ?outcome ", nothing to learn from it" crlf)
  (modify ?goal (mode EVALUATED)))
