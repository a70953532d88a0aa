;;; Skills of several agents, executed over the skill board. To be executed as commands
;;; (BATCH|skills.clp), as the executive for ROS 2 does.
;;;
;;; (skill-call ...) asks for an executor and asserts a skill fact. Its status follows what
;;; (call-skill-read) finds once a tick: S_IDLE (asked) -> S_RUNNING -> S_FINAL or S_FAILED.

(defglobal
  ?*SKILL-INIT-TIMEOUT-SEC* = 5) ; asked for, and nobody has begun

(deftemplate skill "A call of a skill."
  (slot id                  ; <action>_<gensym>
    (type SYMBOL))
  (slot name                ; of the action
    (type SYMBOL))
  (slot parameters          ; the values, separated by blanks
    (type STRING))
  (slot status
    (type SYMBOL) (allowed-values S_IDLE S_RUNNING S_FINAL S_FAILED))
  (slot error-msg (type STRING))
  (slot skill-string        ; what the action is mapped to, empty when it is not
    (type STRING))
  (multislot start-time
    (type INTEGER) (cardinality 2 2) (default (create$ 0 0)))
  (slot agent-id            ; who executes it
    (type STRING) (default "")))

(deftemplate skill-feedback "What is known of a call in this tick."
  (slot skill-id (type SYMBOL))
  (slot status
    (type SYMBOL) (allowed-values S_IDLE S_RUNNING S_FINAL S_FAILED))
  (slot error (type STRING))
  (slot agent-id (type STRING) (default "")))

(assert (ff-feature-loaded skill_execution))

(load* (path-resolve "skill-call.clp"))

(defrule skill-read-information
  (declare (salience ?*SALIENCE-HIGH*))
  (time $?)
  =>
  (call-skill-read))

(defrule skill-status-update
  ?feedback <- (skill-feedback (skill-id ?id) (agent-id ?agent) (status ?new) (error ?error))
  ?skill <- (skill (id ?id) (agent-id ?agent) (name ?name) (status ?old&~?new&S_IDLE|S_RUNNING))
  =>
  (printout t "Skill " ?name " is " ?new ", was: " ?old crlf)
  (retract ?feedback)
  (modify ?skill (status ?new) (error-msg ?error)))

(defrule skill-status-update-nochange
  "What is known already, or of a call that is over, or forgotten."
  (declare (salience ?*SALIENCE-LOW*))
  ?feedback <- (skill-feedback)
  =>
  (retract ?feedback))

(defrule skill-start-timeout
  ?skill <- (skill (name ?name) (status S_IDLE) (start-time $?start))
  (time $?now&:(timeout ?now ?start ?*SKILL-INIT-TIMEOUT-SEC*))
  =>
  (printout warn "Timeout starting skill " ?name " (" ?*SKILL-INIT-TIMEOUT-SEC*
                 " sec): assuming failure" crlf)
  (modify ?skill (status S_FAILED) (error-msg "Start timeout")))
