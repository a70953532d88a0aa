; Counts to the goal, one number each tick; rejects negative goals. Without a function
; cxbridge-examples-count-cancel-goal-callback, the server accepts each cancel request.

; `last` is the time of the last count, so that each tick counts only once
(deftemplate counting (slot handle) (slot to) (multislot counted) (slot last (default 0.0)))

; answers of rclcpp_action: 1 rejects a goal, 2 accepts and executes the goal
(deffunction cxbridge-examples-count-handle-goal-callback (?server ?goal ?uuid)
  (if (< (cxbridge-examples-count-goal-get-field ?goal "to") 0) then (return 1))
  (return 2))

; at the end of a run, (executive-finalize) keeps this rule from firing again after the rule `destroy-server`
(defrule create-server
  (not (cxbridge-examples-count-server))
  (not (executive-finalize))
  =>
  (cxbridge-examples-count-create-server "count"))

(defrule begin-counting
  ?fact <- (cxbridge-examples-count-accepted-goal (server-goal-handle-ptr ?handle))
  =>
  (retract ?fact)
  (bind ?goal (cxbridge-examples-count-server-goal-handle-get-goal ?handle))
  (assert (counting (handle ?handle) (to (cxbridge-examples-count-goal-get-field ?goal "to"))))
  (cxbridge-examples-count-goal-destroy ?goal))

(deffunction finish-counting (?counting)
  (bind ?handle (fact-slot-value ?counting handle))
  (bind ?result (cxbridge-examples-count-result-create))
  (cxbridge-examples-count-result-set-field ?result "counted" (fact-slot-value ?counting counted))
  (if (cxbridge-examples-count-server-goal-handle-is-canceling ?handle)
    then (cxbridge-examples-count-server-goal-handle-canceled ?handle ?result)
    else (cxbridge-examples-count-server-goal-handle-succeed ?handle ?result))
  (cxbridge-examples-count-result-destroy ?result)
  (cxbridge-examples-count-server-goal-handle-destroy ?handle)
  (retract ?counting))

(defrule count-or-finish
  (time ?now)
  ?counting <- (counting (handle ?handle) (to ?to) (counted $?counted) (last ?last&:(> ?now ?last)))
  =>
  (bind ?next (+ 1 (length$ ?counted)))
  (if (or (> ?next ?to) (cxbridge-examples-count-server-goal-handle-is-canceling ?handle))
    then (finish-counting ?counting)
    else
    (bind ?feedback (cxbridge-examples-count-feedback-create))
    (cxbridge-examples-count-feedback-set-field ?feedback "now" ?next)
    (cxbridge-examples-count-server-goal-handle-publish-feedback ?handle ?feedback)
    (cxbridge-examples-count-feedback-destroy ?feedback)
    (modify ?counting (counted ?counted ?next) (last ?now))))

(defrule destroy-server
  (executive-finalize)
  (cxbridge-examples-count-server (name ?server))
  =>
  (cxbridge-examples-count-destroy-server ?server))
