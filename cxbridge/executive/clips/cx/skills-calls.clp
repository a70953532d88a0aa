;;; Skills: the exclusive control of skillers, calls of skills and their statuses. The rules
;;; need the template of SkillerInterface, so skills.clp is executed before.
;;;
;;; An agent that calls skills asserts (skiller-control) for each skiller, and waits until
;;; its slot acquired is TRUE. (skill-call ...) then asserts a skill fact, whose status
;;; follows the interface: S_IDLE (sent) -> S_RUNNING -> S_FINAL or S_FAILED. The calling
;;; rule retracts the fact. Other clients of the skiller count their messages in the same
;;; way, so a message id in the interface belongs to this agent only while no other client
;;; has control. Without control the agent cannot follow its skills. All rules except skill-stolen
;;; have Fawkes' names.

(defglobal  ; Fawkes' values
  ?*SKILL-INIT-TIMEOUT-SEC* = 5                    ; from the message to S_RUNNING
  ?*SKILL-ACQUIRE-CONTROL-RETRY-INTERVAL-SEC* = 3) ; between two requests for control

(deftemplate skill "A call of a skill."
  (slot id                  ; <name>-<msgid>; of other skillers <name>-<skiller>-<msgid>; a name from
                            ; gensym* after <name> without a skill string
    (type SYMBOL))
  (slot name                ; of the action
    (type SYMBOL))
  ;; A stopped skill becomes S_INACTIVE: CLIPS checks allowed-values of texts of files only, not of
  ;; values that rules compute. skills-actions.clp fails the action then.
  (slot status
    (type SYMBOL) (allowed-values S_IDLE S_RUNNING S_FINAL S_FAILED))
  (slot error-msg (type STRING))
  (slot skill-string        ; what the skiller executes
    (type STRING))
  (slot msgid               ; the id of the message, which the interface shows
    (type INTEGER))
  (multislot start-time     ; of the call, in seconds and microseconds
    (type INTEGER) (cardinality 2 2) (default (create$ 0 0)))
  (slot skiller
    (type STRING) (default "Skiller")))

(deftemplate skiller-control "A request for exclusive control of a skiller, and its state."
  (slot skiller             ; id of its SkillerInterface
    (type STRING) (default "Skiller"))
  (slot acquired            ; whether this agent has control
    (type SYMBOL) (allowed-values FALSE TRUE))
  (slot acquiring           ; whether the agent waits for an answer
    (type SYMBOL) (allowed-values FALSE TRUE))
  (multislot last-try       ; the time of the last request, in seconds and microseconds
    (type INTEGER) (cardinality 2 2) (default (create$ 0 0))))

;; ---- calls of skills

(deffunction merge-params (?params ?param-values)
  "The names and values in turn; FALSE if their numbers differ."
  (if (<> (length$ ?params) (length$ ?param-values)) then
    (printout logerror "Invalid skill call, number of parameters is not the "
                       "same as number of parameter values" crlf)
    (return FALSE))
  (bind ?merged (create$))
  (progn$ (?param ?params)
    (bind ?merged (create$ ?merged ?param (nth$ ?param-index ?param-values))))
  ?merged)

(deffunction skill-message (?skiller ?type)
  "Create a message of the type for the skiller."
  (blackboard-create-msg (str-cat "SkillerInterface::" ?skiller) ?type))

(deffunction skill-call (?name ?param-names ?param-values $?opt-skiller)
  "Send the skill string of the action to the skiller (by default \"Skiller\").
   Return the id of the skill fact, which is S_FAILED without a skill string or without
   a writer of the interface."
  (bind ?skiller (if (eq ?opt-skiller (create$)) then "Skiller" else (nth$ 1 ?opt-skiller)))
  (if (> (length$ ?opt-skiller) 1) then
    (printout warn "skill-call: ignore unexpected params " (rest$ ?opt-skiller) crlf))
  (bind ?skill-string (map-action-skill ?name ?param-names ?param-values))
  (printout logwarn "sks='" ?skill-string "'" crlf)  ; level and text of this line and of the next are Fawkes'
  (if (eq ?skill-string "") then
    (bind ?id (sym-cat ?name (gensym*)))
    (assert (skill (id ?id) (name (sym-cat ?name)) (skiller ?skiller) (status S_FAILED)
                   (start-time (now))
                   (error-msg (str-cat "Failed to convert action '" ?name "' to skill string"))))
    (return ?id))
  (bind ?message (skill-message ?skiller "ExecSkillMessage"))
  (blackboard-set-msg-field ?message "skill_string" ?skill-string)
  (printout logwarn "Calling skill '" ?skill-string "'" crlf)
  (bind ?msgid (blackboard-send-msg ?message))
  ;; message ids are unique for each skiller only
  (bind ?id (if (eq ?skiller "Skiller") then (sym-cat ?name - ?msgid)
                                        else (sym-cat ?name - ?skiller - ?msgid)))
  (assert (skill (id ?id) (name (sym-cat ?name)) (skiller ?skiller) (skill-string ?skill-string)
                 (msgid ?msgid) (start-time (now))
                 (status (if (eq ?msgid 0) then S_FAILED else S_IDLE))))
  ?id)

;; ---- exclusive control

(deffunction skill-control-ask (?skiller)
  "Request exclusive control. Return the id of the message; 0 if the interface has no writer."
  (bind ?message (skill-message ?skiller "AcquireControlMessage"))
  (if (any-factp ((?conf confval))
        (and (eq ?conf:path "/clips-executive/steal-skiller-control") (eq ?conf:value TRUE)))
   then
    (blackboard-set-msg-field ?message "steal_control" TRUE))
  (blackboard-send-msg ?message))

(deffunction skill-fail-without-control (?skill ?controller)
  "Fail a call whose skiller is under the control of another client, or of none."
  (bind ?controller-name (if (eq ?controller "") then "nobody" else ?controller))
  (bind ?error (str-cat "Lost exclusive control of " (fact-slot-value ?skill skiller)
                       " to " ?controller-name))
  (printout warn "Skill " (fact-slot-value ?skill name) " was "
                 (fact-slot-value ?skill status) ": " ?error ", assuming failure" crlf)
  (modify ?skill (status S_FAILED) (error-msg ?error)))

(defrule skill-control-acquire
  "Request control, and repeat the request after a time: the skiller does not report refusals."
  ?control <- (skiller-control (skiller ?skiller) (acquired FALSE) (last-try $?last))
  (time $?now&:(timeout ?now ?last ?*SKILL-ACQUIRE-CONTROL-RETRY-INTERVAL-SEC*))
  =>
  (printout t "Acquiring exclusive skiller control for " ?skiller crlf)
  (bind ?sent (neq 0 (skill-control-ask ?skiller)))
  (modify ?control (acquiring ?sent) (last-try ?now)))

(defrule skill-control-acquired
  ?control <- (skiller-control (skiller ?skiller) (acquired FALSE) (acquiring TRUE))
  (blackboard-interface (type "SkillerInterface") (id ?skiller) (serial ?own-serial))
  (SkillerInterface (id ?skiller) (exclusive_controller ?own-serial))
  =>
  (printout t "Acquired exclusive skiller control" crlf)
  (modify ?control (acquiring FALSE) (acquired TRUE)))

(defrule skill-control-lost
  "A running skill continues, but the interface may show the skill of another client. So the
   calls fail before another rule reads the status (salience HIGH), and the agent requests control
   again. If no client has control, the interface still shows the last skill: a call with the same
   message id and skill string has ended, and skill-status-update reads how."
  (declare (salience ?*SALIENCE-HIGH*))
  ?control <- (skiller-control (skiller ?skiller) (acquired TRUE))
  (blackboard-interface (type "SkillerInterface") (id ?skiller) (serial ?own-serial))
  (SkillerInterface (id ?skiller) (exclusive_controller ?controller&~?own-serial)
                    (skill_string ?skill-string) (msgid ?msgid) (status ?status))
  =>
  (printout t "Lost exclusive skiller control" crlf)
  (modify ?control (acquired FALSE))
  (bind ?ended (and (eq ?controller "") (member$ ?status (create$ S_FINAL S_FAILED))))
  (do-for-all-facts ((?skill skill))
      (and (eq ?skill:skiller ?skiller) (member$ ?skill:status (create$ S_IDLE S_RUNNING))
           (not (and ?ended (= ?skill:msgid ?msgid) (eq ?skill:skill-string ?skill-string))))
    (skill-fail-without-control ?skill ?controller)))

(defrule skill-control-release
  "At the end of the program, with Fawkes' salience."
  (declare (salience ?*SALIENCE-HIGH*))
  (executive-finalize)
  ?control <- (skiller-control (skiller ?skiller) (acquired TRUE))
  ?interface <- (blackboard-interface (type "SkillerInterface") (id ?skiller))
  =>
  (printout t "Releasing control on finalize" crlf)
  (blackboard-send-msg (skill-message ?skiller "ReleaseControlMessage"))
  (blackboard-close "SkillerInterface" ?skiller)
  (retract ?interface)
  (modify ?control (acquired FALSE)))

;; ---- the status of a call

(defrule skill-status-update
  "The interface shows the status of this call if it shows the id of its message, and no other
   client has control. A finished call keeps its status."
  ?skill <- (skill (name ?name) (msgid ?msgid) (skiller ?skiller) (status ?old&S_IDLE|S_RUNNING))
  (blackboard-interface (type "SkillerInterface") (id ?skiller) (serial ?own-serial))
  ?update <- (SkillerInterface (id ?skiller) (msgid ?msgid) (status ?new&~?old) (error ?error)
                               (exclusive_controller ?own-serial|""))
  =>
  (printout t "Skill " ?name " is " ?new ", was: " ?old crlf)
  (modify ?skill (status ?new) (error-msg ?error))
  (retract ?update))  ; as in Fawkes

(defrule skill-stolen
  "Another client has taken control, so the agent cannot follow a skill that it called without control."
  ?skill <- (skill (skiller ?skiller) (status S_RUNNING))
  (not (skiller-control (skiller ?skiller) (acquired TRUE)))
  (blackboard-interface (type "SkillerInterface") (id ?skiller) (serial ?own-serial))
  (SkillerInterface (id ?skiller) (exclusive_controller ?controller&~?own-serial&~""))
  =>
  (skill-fail-without-control ?skill ?controller))

(defrule skill-start-timeout
  "The skiller has not started the skill in time."
  ?skill <- (skill (name ?name) (status S_IDLE) (start-time $?start))
  (time $?now&:(timeout ?now ?start ?*SKILL-INIT-TIMEOUT-SEC*))
  =>
  (printout warn "Timeout starting skill " ?name " (" ?*SKILL-INIT-TIMEOUT-SEC*
                 " sec): assuming failure" crlf)
  (modify ?skill (status S_FAILED) (error-msg "Start timeout")))
