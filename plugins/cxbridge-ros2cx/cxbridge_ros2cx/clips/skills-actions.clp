;;; Plan actions that are executed over the skill board: all of them, whether they are mapped
;;; or not. An agent executes one at a time.
;;;
;;;   PENDING -> WAITING (asked) -> RUNNING -> EXECUTION-SUCCEEDED or EXECUTION-FAILED

(deftemplate skill-action-execinfo "Which skill was called for which action."
  (slot goal-id (type SYMBOL)) (slot plan-id (type SYMBOL))
  (slot action-id (type INTEGER))
  (slot skill-name                ; of the action
    (type SYMBOL))
  (slot skill-id (type SYMBOL))   ; of the skill fact
  (slot agent-id
    (type STRING) (default ""))
  (multislot skill-args))         ; name value name value ...

(defrule skill-action-start
  ?action <- (plan-action (agent-id ?agent) (state PENDING) (executable TRUE) (action-name ?name)
                          (goal-id ?goal) (plan-id ?plan) (id ?id)
                          (param-names $?params) (param-values $?values))
  (not (skill-action-execinfo (agent-id ?agent)))
  =>
  (bind ?skill (skill-call ?name ?params ?values ?agent))
  (modify ?action (state WAITING))
  (bind ?args (create$))
  (if (eq (length$ ?params) (length$ ?values)) then
    (progn$ (?param ?params)
      (bind ?args (create$ ?args ?param (nth$ ?param-index ?values)))))
  (assert (skill-action-execinfo (goal-id ?goal) (plan-id ?plan) (action-id ?id) (agent-id ?agent)
                                 (skill-name ?name) (skill-id ?skill) (skill-args ?args))))

(defrule skill-action-running
  (skill-action-execinfo (goal-id ?goal) (plan-id ?plan) (action-id ?id) (skill-id ?skill))
  (skill (id ?skill) (status S_RUNNING))
  ?action <- (plan-action (goal-id ?goal) (plan-id ?plan) (id ?id) (state WAITING) (action-name ?name))
  =>
  (printout t "Action " ?name " is running" crlf)
  (modify ?action (state RUNNING)))

(defrule skill-action-final
  ?call <- (skill-action-execinfo (goal-id ?goal) (plan-id ?plan) (action-id ?id) (skill-id ?skill-id))
  ?skill <- (skill (id ?skill-id) (status S_FINAL))
  ?action <- (plan-action (goal-id ?goal) (plan-id ?plan) (id ?id) (state WAITING|RUNNING)
                          (action-name ?name))
  =>
  (printout t "Execution of " ?name " completed successfully" crlf)
  (modify ?action (state EXECUTION-SUCCEEDED))
  (retract ?skill ?call))

(defrule skill-action-failed
  ?call <- (skill-action-execinfo (goal-id ?goal) (plan-id ?plan) (action-id ?id) (skill-id ?skill-id))
  ?skill <- (skill (id ?skill-id) (status S_FAILED) (error-msg ?error))
  ?action <- (plan-action (goal-id ?goal) (plan-id ?plan) (id ?id) (state WAITING|RUNNING)
                          (action-name ?name))
  =>
  (printout warn "Execution of " ?name " FAILED (" ?error ")" crlf)
  (modify ?action (state EXECUTION-FAILED) (error-msg ?error))
  (retract ?skill ?call))

(defrule skill-action-cancel-if-action-does-not-exist
  "The plan went away while its action is executed."
  ?call <- (skill-action-execinfo (goal-id ?goal) (plan-id ?plan) (action-id ?id) (skill-id ?skill-id)
                                  (agent-id ?agent))
  (skill (id ?skill-id) (status S_IDLE|S_RUNNING))
  (not (plan-action (goal-id ?goal) (plan-id ?plan) (id ?id)))
  =>
  (printout warn "Cancelling Skill Execution, corresponding action does not exist" crlf)
  (call-skill-cancel ?agent)
  (retract ?call))

(defrule skill-action-retract-execinfo-without-action
  "The plan went away, and nothing runs for it."
  ?call <- (skill-action-execinfo (goal-id ?goal) (plan-id ?plan) (action-id ?id) (skill-id ?skill-id))
  (not (plan-action (goal-id ?goal) (plan-id ?plan) (id ?id)))
  (not (skill (id ?skill-id) (status S_IDLE|S_RUNNING)))
  =>
  (retract ?call))

(defrule skill-action-forget
  "The skill of an action that went away has ended."
  ?skill <- (skill (id ?id) (status S_FINAL|S_FAILED))
  (not (skill-action-execinfo (skill-id ?id)))
  =>
  (retract ?skill))
