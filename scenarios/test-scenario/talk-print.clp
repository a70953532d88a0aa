;;; The action print, which needs no skill: (severity S) is where to, (text T) what.

(defrule talk-print-start
  ?action <- (plan-action (action-name print) (state PENDING) (executable TRUE)
                          (param-names $?names) (param-values $?values))
  =>
  (bind ?router (plan-action-arg severity ?names ?values info))
  (printout ?router (plan-action-arg text ?names ?values "") crlf)
  (modify ?action (state RUNNING)))

(defrule talk-print-end
  "Later, so that everybody has seen it running."
  (declare (salience ?*SALIENCE-LOW*))
  ?action <- (plan-action (action-name print) (state RUNNING))
  =>
  (modify ?action (state EXECUTION-SUCCEEDED)))
