;;; RETRY-SUBGOAL: pursue the only sub-goal again until it completes.
;;;
;;;   params: max-tries N       meta: ... num-tries n ...
;;;   COMPLETED -> COMPLETED
;;;   FAILED, REJECTED -> the next try, or this outcome after N tries
;;;   no sub-goal, more than one, other params -> FAILED
;;;
;;; A sub-goal with sub-goals tries these again, too, unless its expander makes new sub-goals.
;;; Fawkes does not, so that such a goal waits forever, or fails without another try; with
;;; clips-executive/exact-retry it is so here, too.
;;;
;;; The rules retry-goal-... have Fawkes' names. Those that end in -resources-clear wait until the
;;; sub-goal has released its resources.

(deffunction retry-tries (?meta)
  "The integer after num-tries in the meta data; FALSE without an integer there."
  (bind ?position (member$ num-tries ?meta))
  (if (or (not ?position) (>= ?position (length$ ?meta))) then (return FALSE))
  (bind ?tries (nth$ (+ ?position 1) ?meta))
  (if (integerp ?tries) then ?tries else FALSE))

(deffunction retry-meta-with-tries (?meta ?tries)
  "The meta data, which must have num-tries, with a new number of tries; the other entries stay."
  (bind ?position (+ 1 (member$ num-tries ?meta)))
  (replace$ ?meta ?position ?position ?tries))

(deffunction retry-give-up (?goal ?error ?message)
  "Finish the goal as FAILED."
  (cx-modify-goal ?goal (mode FINISHED) (outcome FAILED) (error ?error) (message ?message)))

(defrule retry-goal-failed-no-subgoal
  ?parent <- (goal (id ?id) (type ACHIEVE) (sub-type RETRY-SUBGOAL) (mode EXPANDED))
  (not (goal (type ACHIEVE) (parent ?id)))
  =>
  (retry-give-up ?parent NO-SUB-GOAL (str-cat "No sub-goal for RETRY goal '" ?id "'")))

(defrule retry-goal-failed-invalid-params
  ?parent <- (goal (id ?id) (type ACHIEVE) (sub-type RETRY-SUBGOAL) (mode EXPANDED)
                   (params $?params&:(not (goal-param-positive ?params max-tries))))
  =>
  (retry-give-up ?parent INVALID-PARAMETERS
                 (str-cat "Invalid parameters for RETRY goal '" ?id "': not (params max-tries N)")))

(defrule retry-goal-failed-many-subgoals
  ?parent <- (goal (id ?id) (type ACHIEVE) (sub-type RETRY-SUBGOAL) (mode EXPANDED))
  (goal (id ?one) (parent ?id) (type ACHIEVE))
  (exists (goal (id ~?one) (parent ?id) (type ACHIEVE)))
  =>
  (retry-give-up ?parent TOO-MANY-SUBGOALS
                 (str-cat "More than one sub-goal for RETRY goal '" ?id "'")))

(defrule retry-goal-add-meta
  ?parent <- (goal (type ACHIEVE) (sub-type RETRY-SUBGOAL) (mode EXPANDED)
                   (meta $?meta&:(not (member$ num-tries ?meta))))
  =>
  (cx-modify-goal ?parent (meta ?meta num-tries 0)))

(defrule retry-goal-auto-expand
  "The goal has its sub-goal already, so no other rule needs to expand it."
  ?parent <- (goal (id ?id) (type ACHIEVE) (sub-type RETRY-SUBGOAL) (mode SELECTED))
  (exists (goal (parent ?id) (type ACHIEVE) (mode FORMULATED)))
  =>
  (cx-modify-goal ?parent (mode EXPANDED)))

(defrule retry-goal-commit
  ?parent <- (goal (id ?id) (type ACHIEVE) (sub-type RETRY-SUBGOAL) (mode EXPANDED)
                   (params max-tries ?max-tries&:(numberp ?max-tries))
                   (meta $?meta&:(retry-tries ?meta)&:(< (retry-tries ?meta) ?max-tries)))
  (goal (id ?sub) (parent ?id) (type ACHIEVE) (mode FORMULATED))
  (not (goal (id ~?sub) (parent ?id) (type ACHIEVE)))
  =>
  (bind ?try (+ 1 (retry-tries ?meta)))
  (if (> ?try 1) then
    (printout warn "Committing to RETRY " ?id " -> " ?sub " (try " ?try "/" ?max-tries ")" crlf))
  (cx-modify-goal ?parent (mode COMMITTED) (committed-to ?sub) (meta (retry-meta-with-tries ?meta ?try))))

(defrule retry-goal-dispatch
  ?parent <- (goal (id ?id) (type ACHIEVE) (sub-type RETRY-SUBGOAL) (mode COMMITTED)
                   (committed-to ?sub) (required-resources $?need)
                   (acquired-resources $?have&:(subsetp ?need ?have)))
  ?child <- (goal (id ?sub) (parent ?id) (type ACHIEVE) (mode FORMULATED))
  =>
  (cx-modify-goal ?parent (mode DISPATCHED))
  (cx-modify-goal ?child (mode SELECTED)))

(defrule retry-goal-subgoal-evaluated
  (goal (id ?id) (type ACHIEVE) (sub-type RETRY-SUBGOAL) (mode DISPATCHED) (committed-to ?sub))
  ?child <- (goal (id ?sub) (parent ?id) (type ACHIEVE) (mode EVALUATED))
  =>
  (cx-modify-goal ?child (mode RETRACTED)))

(defrule retry-goal-subgoal-failed-or-rejected-resources-clear
  "Begin the next try, in which the sub-goal keeps its meta data, or finish the goal."
  ?parent <- (goal (id ?id) (type ACHIEVE) (sub-type RETRY-SUBGOAL) (mode DISPATCHED)
                   (committed-to ?sub) (params max-tries ?max-tries) (meta $?meta&:(retry-tries ?meta)))
  ?child <- (goal (id ?sub) (parent ?id) (acquired-resources) (type ACHIEVE) (mode RETRACTED)
                  (outcome ?outcome&FAILED|REJECTED))
  =>
  (bind ?tries (retry-tries ?meta))
  (if (< ?tries ?max-tries)
   then
    (cx-modify-goal ?child (mode FORMULATED) (outcome UNKNOWN))
    (cx-modify-goal ?parent (mode EXPANDED) (committed-to nil))
    (assert (goal-tried-again ?sub))
   else
    (cx-modify-goal ?parent (mode FINISHED) (outcome ?outcome) (committed-to nil)
                    (error (sym-cat SUB-GOAL- ?outcome))
                    (message (str-cat "RETRY goal '" ?id "' sub-goal '" ?sub "' " ?outcome
                                      " in try " ?tries "/" ?max-tries)))))

(defrule retry-goal-subgoal-completed-resources-clear
  ?parent <- (goal (id ?id) (type ACHIEVE) (sub-type RETRY-SUBGOAL) (mode DISPATCHED) (committed-to ?sub))
  (goal (id ?sub) (parent ?id) (acquired-resources) (type ACHIEVE) (mode RETRACTED) (outcome COMPLETED))
  =>
  (cx-modify-goal ?parent (mode FINISHED) (outcome COMPLETED)))

;; ---- the sub-goals of a goal that is tried again
;;
;; (goal-tried-again ID): the goal begins another try, while its sub-goals are RETRACTED from the last
;; try. If its expander has made no new sub-goals when the goal needs them, (goals-below-again ID)
;; requests that the former sub-goals become FORMULATED again, which begin another try, too.
;;
;; Saliences: HIGH is above the rules of the sub-types, which would find no FORMULATED sub-goal. FIRST
;; lets all sub-goals change before any other rule fires.

(defrule retry-again-as-fawkes
  "With exact-retry, the former sub-goals stay RETRACTED."
  (declare (salience ?*SALIENCE-FIRST*))
  (confval (path "/clips-executive/exact-retry") (type BOOL) (value TRUE))
  ?again <- (goal-tried-again ?)
  =>
  (retract ?again))

(defrule retry-again-counts-anew
  "When a RETRY goal is itself tried again, it counts its tries from 0."
  (declare (salience ?*SALIENCE-HIGH*))
  (goal-tried-again ?id)
  ?goal <- (goal (id ?id) (type ACHIEVE) (sub-type RETRY-SUBGOAL) (mode SELECTED|EXPANDED)
                 (meta $?meta&:(retry-tries ?meta)&:(> (retry-tries ?meta) 0)))
  =>
  (cx-modify-goal ?goal (meta (retry-meta-with-tries ?meta 0))))

(defrule retry-again-without-new-sub-goals
  "The goal needs sub-goals, and has only former ones: when it is EXPANDED, or already when it is SELECTED
   if it is a RETRY or TIMEOUT goal, which a FORMULATED sub-goal expands."
  (declare (salience ?*SALIENCE-HIGH*))
  ?again <- (goal-tried-again ?id)
  (or (goal (id ?id) (sub-type ~nil) (type ACHIEVE) (mode EXPANDED))
      (goal (id ?id) (sub-type RETRY-SUBGOAL|TIMEOUT-SUBGOAL) (type ACHIEVE) (mode SELECTED)))
  (exists (goal (parent ?id) (type ACHIEVE) (mode RETRACTED)))
  (not (goal (parent ?id) (type ACHIEVE) (mode ~RETRACTED)))
  =>
  (retract ?again)
  (assert (goals-below-again ?id)))

(defrule retry-again-formulate-sub-goal
  (declare (salience ?*SALIENCE-FIRST*))
  (goals-below-again ?id)
  ?goal <- (goal (id ?sub) (parent ?id) (type ACHIEVE) (mode RETRACTED))
  =>
  (cx-modify-goal ?goal (mode FORMULATED) (outcome UNKNOWN))
  (assert (goal-tried-again ?sub)))

(defrule retry-again-sub-goals-done
  (declare (salience ?*SALIENCE-FIRST*))
  ?below <- (goals-below-again ?id)
  (not (goal (parent ?id) (type ACHIEVE) (mode RETRACTED)))
  =>
  (retract ?below))

(defrule retry-again-over
  "The goal is a leaf, has left the mode EXPANDED, or is gone. The rule fires at once (FIRST): a goal may
   return to EXPANDED after its last sub-goal, and must not begin its sub-goals anew then."
  (declare (salience ?*SALIENCE-FIRST*))
  ?again <- (goal-tried-again ?id)
  (not (goal (id ?id) (sub-type ~nil) (mode FORMULATED|SELECTED|EXPANDED)))
  =>
  (retract ?again))
