; Sends two goals, one after the other: count to 3, and count to 100, which is cancelled at 5.

(deffacts goals (goal 3) (goal 100))

; at the end of a run, (executive-finalize) keeps this rule from firing again after the rule `destroy-client`
(defrule create-client
  (not (cxbridge-examples-count-client))
  (not (executive-finalize))
  =>
  (cxbridge-examples-count-create-client "count"))

; sends the goal with the lowest number, from the first tick on: (time ?) is a fact of a tick;
; (sent GOAL) keeps the goal's message until its result
(defrule send-next-goal
  (time ?)
  (cxbridge-examples-count-client (server ?server))
  ?next <- (goal ?to)
  (not (goal ?other&:(> ?to ?other)))
  (not (sent ?))
  =>
  (retract ?next)
  (bind ?goal (cxbridge-examples-count-goal-create))
  (cxbridge-examples-count-goal-set-field ?goal "to" ?to)
  (cxbridge-examples-count-send-goal ?goal ?server)
  (assert (sent ?goal))
  (printout info "count to " ?to crlf))

(deffunction destroy-sent-goal (?sent)
  (cxbridge-examples-count-goal-destroy (nth$ 1 (fact-slot-value ?sent implied)))
  (retract ?sent))

(defrule cancel-goal-at-5
  ?fact <- (cxbridge-examples-count-goal-feedback (server ?server) (client-goal-handle-ptr ?handle)
             (feedback-ptr ?feedback))
  =>
  (if (= 5 (cxbridge-examples-count-feedback-get-field ?feedback "now"))
    then (cxbridge-examples-count-client-cancel-goal ?server ?handle))
  (cxbridge-examples-count-feedback-destroy ?feedback)
  (retract ?fact))

(defrule print-result
  ?fact <- (cxbridge-examples-count-wrapped-result (code ?code) (result-ptr ?result))
  ?response <- (cxbridge-examples-count-goal-response (client-goal-handle-ptr ?handle))
  ?sent <- (sent ?)
  =>
  (printout info ?code " " (cxbridge-examples-count-result-get-field ?result "counted") crlf)
  (cxbridge-examples-count-result-destroy ?result)
  (cxbridge-examples-count-client-goal-handle-destroy ?handle)
  (retract ?fact ?response)
  (destroy-sent-goal ?sent))

(defrule shut-down-without-goals
  (not (goal ?))
  (not (sent ?))
  (time ?)
  =>
  (cx-shutdown))

(defrule destroy-client
  (executive-finalize)
  (cxbridge-examples-count-client (server ?server))
  =>
  (cxbridge-examples-count-destroy-client ?server))
