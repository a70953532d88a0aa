;;; Plan actions that are executed by skills: all actions with a mapping in the
;;; configuration of the spec (action-mapping). A skiller executes one action at a time. The rules have
;;; Fawkes' names.
;;;
;;;   PENDING -> WAITING (called) -> RUNNING -> EXECUTION-SUCCEEDED or EXECUTION-FAILED

(deftemplate skill-action-execinfo "The called skill of an action."
  (slot goal-id (type SYMBOL)) (slot plan-id (type SYMBOL))
  (slot action-id (type INTEGER))
  (slot skill-name                ; of the action
    (type SYMBOL))
  (slot skill-id (type SYMBOL))   ; of the skill fact
  (slot skiller
    (type STRING) (default "Skiller"))
  (multislot skill-args))         ; name value name value ...

(deftemplate skill-action-mapping "An action that is executed by a skill."
  (slot name (type SYMBOL) (default ?NONE))
  (slot map-string                ; the template of its skill string
    (type STRING)))

(defrule skill-action-init
  "Assert a mapping for each value below action-mapping."
  (confval (path "/clips-executive/spec") (type STRING) (value ?spec))
  (confval (type STRING) (value ?template)
           (path ?path&:(str-prefix (str-cat "/clips-executive/specs/" ?spec "/action-mapping/") ?path)))
  =>
  (bind ?begin (+ 1 (str-length (str-cat "/clips-executive/specs/" ?spec "/action-mapping/"))))
  (assert (skill-action-mapping (name (sym-cat (sub-string ?begin (str-length ?path) ?path)))
                                (map-string ?template))))

(defrule skill-action-start
  "The agenda decides which of several actions gets the skiller, so the order of the conditions
   matters: actions wait at the negated condition, as in Fawkes."
  ?action <- (plan-action (skiller ?skiller) (state PENDING) (executable TRUE) (action-name ?name)
                          (goal-id ?goal) (plan-id ?plan) (id ?id)
                          (param-names $?params) (param-values $?values))
  (skill-action-mapping (name ?name))
  (not (skill-action-execinfo (skiller ?skiller)))
  (skiller-control (skiller ?skiller) (acquired TRUE))
  =>
  (bind ?skill-id (skill-call ?name ?params ?values ?skiller))
  (modify ?action (state WAITING))
  (bind ?args (create$))
  (progn$ (?param ?params)
    (bind ?args (create$ ?args ?param (nth$ ?param-index ?values))))
  (assert (skill-action-execinfo (goal-id ?goal) (plan-id ?plan) (action-id ?id) (skiller ?skiller)
                                 (skill-name ?name) (skill-id ?skill-id) (skill-args ?args))))

(defrule skill-action-running
  (skill-action-execinfo (goal-id ?goal) (plan-id ?plan) (action-id ?id) (skill-id ?skill-id))
  (skill (id ?skill-id) (status S_RUNNING))
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

(defrule skill-action-failed-inactive-interface
  "The Skiller has become inactive without reporting the end of the skill. First branch: its interface
   shows no skill while the action is RUNNING. Second branch: the interface has shown the skill itself
   as S_INACTIVE, whatever the interface shows now. (\"SKillerInterface\" is Fawkes' spelling.)"
  ?call <- (skill-action-execinfo (goal-id ?goal) (plan-id ?plan) (action-id ?id) (skill-id ?skill-id)
                                  (skiller ?skiller))
  ?skill <- (skill (id ?skill-id) (status ?status))
  ?action <- (plan-action (goal-id ?goal) (plan-id ?plan) (id ?id) (state ?state&WAITING|RUNNING)
                          (action-name ?name))
  (or (and (test (eq ?state RUNNING))
           (SkillerInterface (id ?skiller) (status S_INACTIVE)))
      (test (eq ?status S_INACTIVE)))
  =>
  (printout warn "Execution of " ?name " on " ?skiller
                 " FAILED (SKillerInterface status inactive during running)" crlf)
  (modify ?action (state EXECUTION-FAILED)
                  (error-msg "SkillerInterface status inactive during running action"))
  (retract ?skill ?call))

(defrule skill-action-cancel-if-action-does-not-exist
  "The action was retracted during its execution."
  ?call <- (skill-action-execinfo (goal-id ?goal) (plan-id ?plan) (action-id ?id) (skill-id ?skill-id)
                                  (skiller ?skiller))
  ?skill <- (skill (id ?skill-id) (status S_IDLE|S_RUNNING))
  (not (plan-action (goal-id ?goal) (plan-id ?plan) (id ?id)))
  =>
  (printout warn "Cancelling Skill Execution, corresponding action does not exist" crlf)
  (blackboard-send-msg (skill-message ?skiller "StopExecMessage"))
  (retract ?skill ?call))

(defrule skill-action-retract-execinfo-without-action
  "The action was retracted and its skill has ended: retract the call and its skill."
  ?call <- (skill-action-execinfo (goal-id ?goal) (plan-id ?plan) (action-id ?id) (skill-id ?skill-id))
  (not (plan-action (goal-id ?goal) (plan-id ?plan) (id ?id)))
  (not (skill (id ?skill-id) (status S_IDLE|S_RUNNING)))
  =>
  (do-for-fact ((?skill skill)) (eq ?skill:id ?skill-id)
    (retract ?skill))
  (retract ?call))
