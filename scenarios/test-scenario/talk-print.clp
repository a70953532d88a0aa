;;; The action print, without a skill. It prints the value of its parameter text to the router that its
;;; parameter severity names.

(defrule talk-print-start
  ?action <- (plan-action (action-name print) (state PENDING) (executable TRUE)
                          (param-names $?names) (param-values $?values))
  =>
  (bind ?router (plan-action-arg severity ?names ?values info))
  (printout ?router (plan-action-arg text ?names ?values "") crlf)
  (modify ?action (state RUNNING)))

(defrule talk-print-end
  "The salience is below that of other rules, so that they see the action running."
  (declare (salience ?*SALIENCE-LOW*))
  ?action <- (plan-action (action-name print) (state RUNNING))
  =>
  (modify ?action (state EXECUTION-SUCCEEDED)))
