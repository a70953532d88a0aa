;;; Plan actions that are executed on the skill board: all actions with a mapping in the
;;; configuration of the spec (action-mapping). Replaces skills-actions.clp.
;;;
;;; The slot skiller of an action names the agent. The skill board needs no exclusive control,
;;; and an agent executes as many actions at a time as it has executors.
;;;
;;;   PENDING -> WAITING (requested) -> RUNNING -> EXECUTION-SUCCEEDED or EXECUTION-FAILED
;;;
;;; Needs plan.clp and the feature skill-board.

(deftemplate skill-board-mapping "The name of an action that is executed on the skill board."
  (slot name (type SYMBOL)))

(deftemplate skill-board-call "The requested skill of an action."
  (slot goal-id (type SYMBOL)) (slot plan-id (type SYMBOL)) (slot action-id (type INTEGER))
  (slot id (type INTEGER)))  ; of the skill-board-action

(defrule skill-board-mapping-init
  "Assert a mapping for each value below action-mapping."
  (confval (path "/clips-executive/spec") (type STRING) (value ?spec))
  (confval (type STRING)
           (path ?path&:(str-prefix (str-cat "/clips-executive/specs/" ?spec "/action-mapping/") ?path)))
  =>
  (bind ?prefix (str-cat "/clips-executive/specs/" ?spec "/action-mapping/"))
  (bind ?name (sub-string (+ 1 (str-length ?prefix)) (str-length ?path) ?path))
  (assert (skill-board-mapping (name (sym-cat ?name)))))

(defrule skill-board-start
  ?action <- (plan-action (state PENDING) (executable TRUE) (skiller ?agent) (action-name ?name)
                          (goal-id ?goal) (plan-id ?plan) (id ?action-id)
                          (param-names $?params) (param-values $?values))
  (skill-board-mapping (name ?name))
  =>
  (bind ?skill-string (map-action-skill ?name ?params ?values))
  ; 0: no executor can be asked, or the action has no skill string
  (bind ?id (if (eq ?skill-string "") then 0 else (skill-board-call ?skill-string ?agent)))
  (if (eq ?id 0)
   then
    (modify ?action (state EXECUTION-FAILED)
                    (error-msg (str-cat "'" ?name "' cannot be requested, see the log")))
   else
    (modify ?action (state WAITING))
    (assert (skill-board-call (goal-id ?goal) (plan-id ?plan) (action-id ?action-id) (id ?id)))))

(defrule skill-board-running
  (skill-board-call (goal-id ?goal) (plan-id ?plan) (action-id ?action-id) (id ?id))
  (skill-board-action (id ?id) (state RUNNING) (executor ?executor))
  ?action <- (plan-action (goal-id ?goal) (plan-id ?plan) (id ?action-id) (state WAITING)
                          (action-name ?name))
  =>
  (printout t "Action " ?name " is executed by " ?executor crlf)
  (modify ?action (state RUNNING)))

(defrule skill-board-succeeded
  ?call <- (skill-board-call (goal-id ?goal) (plan-id ?plan) (action-id ?action-id) (id ?id))
  ?board-action <- (skill-board-action (id ?id) (state SUCCEEDED))
  ?action <- (plan-action (goal-id ?goal) (plan-id ?plan) (id ?action-id) (state WAITING|RUNNING)
                          (action-name ?name))
  =>
  (printout t "Execution of " ?name " completed successfully" crlf)
  (modify ?action (state EXECUTION-SUCCEEDED))
  (retract ?call ?board-action))

(defrule skill-board-failed
  ?call <- (skill-board-call (goal-id ?goal) (plan-id ?plan) (action-id ?action-id) (id ?id))
  ?board-action <- (skill-board-action (id ?id) (state ?state&FAILED|CANCELLED) (error ?error))
  ?action <- (plan-action (goal-id ?goal) (plan-id ?plan) (id ?action-id) (state WAITING|RUNNING)
                          (action-name ?name))
  =>
  (bind ?reason (if (eq ?error "") then (lowcase (str-cat ?state)) else ?error))
  (printout warn "Execution of " ?name " FAILED (" ?reason ")" crlf)
  (modify ?action (state EXECUTION-FAILED) (error-msg ?reason))
  (retract ?call ?board-action))

(defrule skill-board-cancel-without-action
  "The action was retracted during its execution."
  (skill-board-call (goal-id ?goal) (plan-id ?plan) (action-id ?action-id) (id ?id))
  (skill-board-action (id ?id) (state ASKING|CONFIRMED|RUNNING) (skill ?skill))
  (not (plan-action (goal-id ?goal) (plan-id ?plan) (id ?action-id)))
  =>
  (printout warn "Cancelling " ?skill ", the action does not exist any more" crlf)
  (skill-board-cancel ?id))

(defrule skill-board-retract-call-without-action
  "The action was retracted, and its skill has ended."
  ?call <- (skill-board-call (goal-id ?goal) (plan-id ?plan) (action-id ?action-id) (id ?id))
  ?board-action <- (skill-board-action (id ?id) (state SUCCEEDED|FAILED|CANCELLED))
  (not (plan-action (goal-id ?goal) (plan-id ?plan) (id ?action-id)))
  =>
  (retract ?call ?board-action))
