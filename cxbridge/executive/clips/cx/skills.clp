;;; Skills: exclusive control of skillers, calls, and what becomes of them. To be executed
;;; as commands (BATCH|skills.clp), since it opens the interface of the default skiller.
;;;
;;; Who wants to call skills asserts (skiller-control), one for each skiller, and waits
;;; for its slot acquired. (skill-call ...) then asserts a skill fact, whose status
;;; follows the interface: S_IDLE (sent) -> S_RUNNING -> S_FINAL or S_FAILED. The
;;; rule that called it retracts it. Others count their messages as we do: an id is ours only
;;; as long as nobody else has control, and who loses it loses sight of its skills.

(defglobal
  ?*SKILL-INIT-TIMEOUT-SEC* = 5                    ; sent, and not heard of since
  ?*SKILL-ACQUIRE-CONTROL-RETRY-INTERVAL-SEC* = 3) ; asked for control, without success

(deftemplate skill "A call of a skill."
  (slot id                  ; <name>-<msgid>, of another skiller <name>-<skiller>-<msgid>
    (type SYMBOL))
  (slot name                ; of the action
    (type SYMBOL))
  (slot status              ; also S_INACTIVE, when the skiller says so
    (type SYMBOL) (allowed-values S_IDLE S_RUNNING S_FINAL S_FAILED))
  (slot error-msg (type STRING))
  (slot skill-string        ; what the skiller executes
    (type STRING))
  (slot msgid               ; of the message, and then in the interface
    (type INTEGER))
  (multislot start-time
    (type INTEGER) (cardinality 2 2) (default (create$ 0 0)))
  (slot skiller
    (type STRING) (default "Skiller")))

(deftemplate skiller-control "That we want, and perhaps have, exclusive control of a skiller."
  (slot skiller             ; id of its SkillerInterface
    (type STRING) (default "Skiller"))
  (slot acquired            ; it obeys us
    (type SYMBOL) (allowed-values FALSE TRUE))
  (slot acquiring           ; we have asked, and wait
    (type SYMBOL) (allowed-values FALSE TRUE))
  (multislot last-try
    (type INTEGER) (cardinality 2 2) (default (create$ 0 0))))

(blackboard-open-reading "SkillerInterface" "Skiller")
(assert (ff-feature-loaded skills))

;; ---- calls

(deffunction merge-params (?params ?param-values)
  "Names and values in turn, FALSE when there are not as many of one as of the other."
  (if (<> (length$ ?params) (length$ ?param-values)) then
    (printout logerror "Invalid skill call, number of parameters is not the "
                       "same as number of parameter values" crlf)
    (return FALSE))
  (bind ?merged (create$))
  (progn$ (?param ?params)
    (bind ?merged (create$ ?merged ?param (nth$ ?param-index ?param-values))))
  ?merged)

(deffunction skill-message (?skiller ?type)
  "A message of that type for the skiller."
  (blackboard-create-msg (str-cat "SkillerInterface::" ?skiller) ?type))

(deffunction skill-call (?name ?param-names ?param-values $?opt-skiller)
  "Have the skiller (\"Skiller\" unless named) execute what the action is mapped to.
   Returns the id of the skill fact, which is S_FAILED when there was nothing to send or
   nobody to send it to."
  (bind ?skiller (if (eq ?opt-skiller (create$)) then "Skiller" else (nth$ 1 ?opt-skiller)))
  (if (> (length$ ?opt-skiller) 1) then
    (printout warn "skill-call: ignore unexpected params " (rest$ ?opt-skiller) crlf))
  (bind ?text (map-action-skill ?name ?param-names ?param-values))
  (printout logwarn "sks='" ?text "'" crlf)
  (if (eq ?text "") then
    (bind ?id (sym-cat ?name (gensym*)))
    (assert (skill (id ?id) (name (sym-cat ?name)) (skiller ?skiller) (status S_FAILED)
                   (start-time (now))
                   (error-msg (str-cat "Failed to convert action '" ?name "' to skill string"))))
    (return ?id))
  (bind ?message (skill-message ?skiller "ExecSkillMessage"))
  (blackboard-set-msg-field ?message "skill_string" ?text)
  (printout logwarn "Calling skill '" ?text "'" crlf)
  (bind ?msgid (blackboard-send-msg ?message))
  ;; each skiller counts its messages by itself, so they have the same numbers
  (bind ?id (if (eq ?skiller "Skiller") then (sym-cat ?name - ?msgid)
                                        else (sym-cat ?name - ?skiller - ?msgid)))
  (assert (skill (id ?id) (name (sym-cat ?name)) (skiller ?skiller) (skill-string ?text)
                 (msgid ?msgid) (start-time (now))
                 (status (if (eq ?msgid 0) then S_FAILED else S_IDLE))))
  ?id)

;; ---- exclusive control

(deffunction skill-control-ask (?skiller)
  "Ask for exclusive control. Returns the id of the message, 0 when nobody gets it."
  (bind ?message (skill-message ?skiller "AcquireControlMessage"))
  (if (any-factp ((?conf confval))
        (and (eq ?conf:path "/clips-executive/steal-skiller-control") (eq ?conf:value TRUE)))
   then
    (blackboard-set-msg-field ?message "steal_control" TRUE))
  (blackboard-send-msg ?message))

(deffunction skill-fail-without-control (?skill ?controller)
  "Let a call fail whose skiller obeys somebody else, or nobody."
  (bind ?who (if (eq ?controller "") then "nobody" else ?controller))
  (bind ?error (str-cat "Lost exclusive control of " (fact-slot-value ?skill skiller) " to " ?who))
  (printout warn "Skill " (fact-slot-value ?skill name) " was "
                 (fact-slot-value ?skill status) ": " ?error ", assuming failure" crlf)
  (modify ?skill (status S_FAILED) (error-msg ?error)))

(defrule skill-control-acquire
  "Ask for control, and ask again when nothing came of it: a refusal is silent."
  ?control <- (skiller-control (skiller ?skiller) (acquired FALSE) (last-try $?last))
  (time $?now&:(timeout ?now ?last ?*SKILL-ACQUIRE-CONTROL-RETRY-INTERVAL-SEC*))
  =>
  (printout t "Acquiring exclusive skiller control for " ?skiller crlf)
  (bind ?sent (neq 0 (skill-control-ask ?skiller)))
  (modify ?control (acquiring ?sent) (last-try ?now)))

(defrule skill-control-acquired
  ?control <- (skiller-control (skiller ?skiller) (acquired FALSE) (acquiring TRUE))
  (blackboard-interface (type "SkillerInterface") (id ?skiller) (serial ?us))
  (SkillerInterface (id ?skiller) (exclusive_controller ?us))
  =>
  (printout t "Acquired exclusive skiller control" crlf)
  (modify ?control (acquiring FALSE) (acquired TRUE)))

(defrule skill-control-lost
  "Whatever runs goes on running, but what is shown may be of another's skill by now: our
   calls have failed, before any status is looked at. We ask for control again.
   When nobody has got control, the end of a call that is shown is that of ours."
  (declare (salience ?*SALIENCE-HIGH*))
  ?control <- (skiller-control (skiller ?skiller) (acquired TRUE))
  (blackboard-interface (type "SkillerInterface") (id ?skiller) (serial ?us))
  (SkillerInterface (id ?skiller) (exclusive_controller ?other&~?us)
                    (skill_string ?text) (msgid ?msgid) (status ?status))
  =>
  (printout t "Lost exclusive skiller control" crlf)
  (modify ?control (acquired FALSE))
  (bind ?ended (and (eq ?other "") (member$ ?status (create$ S_FINAL S_FAILED))))
  (do-for-all-facts ((?skill skill))
      (and (eq ?skill:skiller ?skiller) (member$ ?skill:status (create$ S_IDLE S_RUNNING))
           (not (and ?ended (= ?skill:msgid ?msgid) (eq ?skill:skill-string ?text))))
    (skill-fail-without-control ?skill ?other)))

(defrule skill-control-release
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

;; ---- what becomes of a call

(defrule skill-status-update
  "The interface speaks of this call when it shows the id of its message, and nobody else
   has control. A call that is over stays as it is."
  ?skill <- (skill (name ?name) (msgid ?msgid) (skiller ?skiller) (status ?old&S_IDLE|S_RUNNING))
  (blackboard-interface (type "SkillerInterface") (id ?skiller) (serial ?us))
  ?update <- (SkillerInterface (id ?skiller) (msgid ?msgid) (status ?new&~?old) (error ?error)
                               (exclusive_controller ?us|""))
  =>
  (printout t "Skill " ?name " is " ?new ", was: " ?old crlf)
  (modify ?skill (status ?new) (error-msg ?error))
  (retract ?update))

(defrule skill-stolen
  "A skill that was called without control runs on unseen when somebody takes control."
  ?skill <- (skill (skiller ?skiller) (status S_RUNNING))
  (not (skiller-control (skiller ?skiller) (acquired TRUE)))
  (blackboard-interface (type "SkillerInterface") (id ?skiller) (serial ?us))
  (SkillerInterface (id ?skiller) (exclusive_controller ?other&~?us&~""))
  =>
  (skill-fail-without-control ?skill ?other))

(defrule skill-start-timeout
  "The skiller has never taken up the call."
  ?skill <- (skill (name ?name) (status S_IDLE) (start-time $?start))
  (time $?now&:(timeout ?now ?start ?*SKILL-INIT-TIMEOUT-SEC*))
  =>
  (printout warn "Timeout starting skill " ?name " (" ?*SKILL-INIT-TIMEOUT-SEC*
                 " sec): assuming failure" crlf)
  (modify ?skill (status S_FAILED) (error-msg "Start timeout")))
