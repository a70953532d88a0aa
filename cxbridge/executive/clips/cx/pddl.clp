; Expands a goal with the plan of a PDDL planner. (pddl-call GOAL-ID FORMULA)
; requests a problem, generated from the robot memory, and then the planner. The
; plan arrives in the robot memory, in the collection robmem.pddl-plan.
;
; Loaded by pddl-init.clp. Needs goal.clp, plan.clp and the feature robot_memory. All rules except
; pddl-fetch-plan have Fawkes' names.

(deftemplate pddl-plan
  "A requested plan, until the goal is expanded, fails, or leaves the mode
   SELECTED."
  (slot goal (type STRING))       ; the formula to achieve
  (slot goal-id (type SYMBOL))
  ; ids of the messages to the generator and to the planner, whose interfaces show
  ; the id of the message in execution
  (slot gen-id (type INTEGER))
  (slot plan-id (type INTEGER))
  ; in the order of the steps; PLAN-FETCHED is a status of Fawkes, which no rule sets here
  (slot status (type SYMBOL)
    (allowed-values GEN-PENDING GEN-RUNNING GENERATED
                    PENDING RUNNING PLANNED PLAN-FETCHED))
)

(deffunction pddl-call (?goal-id ?formula)
  "Request a plan that achieves the PDDL formula ?formula (a string), for the SELECTED
   goal ?goal-id."
  (printout info "Calling PDDL planner for goal '" ?formula "'" crlf)
  (bind ?message (blackboard-create-msg "PddlGenInterface::pddl-gen" "GenerateMessage"))
  (blackboard-set-msg-field ?message "goal" ?formula)
  (bind ?message-id (blackboard-send-msg ?message))
  (assert (pddl-plan (goal ?formula) (goal-id ?goal-id)
                     (gen-id ?message-id) (status GEN-PENDING)))
)

(deffunction pddl-get-max-action-id ()
  "The greatest id of all plan-actions; 0 without plan-actions."
  (bind ?greatest 0)
  (do-for-all-facts ((?action plan-action)) TRUE
    (bind ?greatest (max ?greatest ?action:id))
  )
  (return ?greatest)
)

; *** The problem ***

(defrule pddl-check-if-generation-running
  ?plan <- (pddl-plan (gen-id ?message-id) (status GEN-PENDING))
  (PddlGenInterface (id "pddl-gen") (msg_id ?message-id))
  =>
  (modify ?plan (status GEN-RUNNING))
  (printout t "PDDL problem generation started for ID " ?message-id crlf)
)

(defrule pddl-check-if-generation-finished
  ?plan <- (pddl-plan (gen-id ?message-id) (status GEN-RUNNING))
  (PddlGenInterface (id "pddl-gen") (final TRUE) (msg_id ?message-id))
  =>
  (modify ?plan (status GENERATED))
  (printout t "PDDL problem generation finished for ID " ?message-id crlf)
)

; *** The planner ***

(defrule pddl-start-planner
  ?plan <- (pddl-plan (gen-id ?gen-id) (status GENERATED))
  =>
  (printout t "Starting to plan " ?gen-id crlf)
  (bind ?message (blackboard-create-msg "PddlPlannerInterface::pddl-planner" "PlanMessage"))
  (modify ?plan (status PENDING) (plan-id (blackboard-send-msg ?message)))
)

(defrule pddl-check-if-planner-running
  ?plan <- (pddl-plan (plan-id ?message-id) (status PENDING))
  (PddlPlannerInterface (id "pddl-planner") (msg_id ?message-id))
  =>
  (modify ?plan (status RUNNING))
)

(defrule pddl-check-if-planner-finished
  ?plan <- (pddl-plan (plan-id ?message-id) (status RUNNING))
  (PddlPlannerInterface (id "pddl-planner") (success TRUE) (final TRUE)
                        (msg_id ?message-id))
  =>
  (modify ?plan (status PLANNED))
)

(defrule pddl-check-if-planner-failed
  ?plan <- (pddl-plan (plan-id ?message-id) (goal-id ?goal-id) (status RUNNING))
  (PddlPlannerInterface (id "pddl-planner") (success FALSE) (final TRUE)
                        (msg_id ?message-id))
  ?goal <- (goal (id ?goal-id))
  =>
  (retract ?plan)
  (printout error "Planning failed for goal " ?goal-id crlf)
  (cx-modify-goal ?goal (outcome FAILED) (mode FINISHED))
)

; *** The plan ***

(deffunction pddl-upcase-symbols (?values)
  "Internal. The values as upper-case symbols."
  (bind ?symbols (create$))
  (progn$ (?value ?values)
    (bind ?symbols (create$ ?symbols (sym-cat (upcase ?value))))
  )
  (return ?symbols)
)

(deffunction pddl-is-plan (?doc ?prefix)
  "Internal. TRUE if each action in the document of a plan has a name and arguments.
   The fields of the plan are below ?prefix. bson-get-array returns a list with FALSE
   for a value that is not a list."
  (bind ?is-plan TRUE)
  (progn$ (?action (bson-get-array ?doc (str-cat ?prefix "actions")))
    (if (external-addressp ?action) then
      (if (or (not (stringp (bson-get ?action "name")))
              (member$ FALSE (bson-get-array ?action "args"))) then
        (bind ?is-plan FALSE))
      (bson-destroy ?action)
     else
      (bind ?is-plan FALSE))
  )
  (return ?is-plan)
)

(deffunction pddl-refuse-plan (?plan ?goal)
  "Internal. Fail the goal, because the document is not a plan."
  (printout error "The document for goal " (fact-slot-value ?goal id)
                  " is not a plan: no list of actions, or one lacks its name or its arguments" crlf)
  (retract ?plan)
  (cx-modify-goal ?goal (outcome FAILED) (mode FINISHED))
)

(deffunction pddl-take-plan (?doc ?prefix ?plan ?goal)
  "Internal. Assert the plan of a document, whose fields are below ?prefix, and expand
   the goal. The id of an action is its position in the document; the domain model adds
   the parameter names. REACH-GOAL is not an action: the planner FF ends its plans
   with this line."
  (if (not (pddl-is-plan ?doc ?prefix)) then
    (return (pddl-refuse-plan ?plan ?goal)))
  (printout t "Fetched a new plan!" crlf)
  (bind ?plan-id (fact-slot-value ?plan plan-id))
  (bind ?goal-id (fact-slot-value ?plan goal-id))
  (assert (plan (id ?plan-id) (goal-id ?goal-id)))
  (progn$ (?action (bson-get-array ?doc (str-cat ?prefix "actions")))
    (bind ?name (sym-cat (bson-get ?action "name")))
    (if (neq ?name REACH-GOAL) then
      (assert (plan-action (id ?action-index) (action-name ?name)
                           (plan-id ?plan-id) (goal-id ?goal-id)
                           (param-values (pddl-upcase-symbols
                                           (bson-get-array ?action "args"))))))
    (bson-destroy ?action)
  )
  (retract ?plan)
  (cx-modify-goal ?goal (mode EXPANDED))
)

(deffunction pddl-event-has-plan (?event)
  "Internal. TRUE if the document in the event has a plan. Documents with plan 0 report that
   the planner found no plan."
  (return (and (bson-has-field ?event "fullDocument.plan")
               (eq 1 (bson-get ?event "fullDocument.plan"))))
)

(defrule pddl-cleanup-trigger-no-plan
  "Destroy the event of a document without a plan."
  ?event <- (robmem-trigger (name "new-plan") (ptr ?obj&:(not (pddl-event-has-plan ?obj))))
  =>
  (retract ?event)
  (bson-destroy ?obj)
)

(defrule pddl-expand-goal
  "The event of the new plan arrives in the loop in which the planner has finished. The
   pddl-plan is matched twice: first for its goal, then for the message id in the event."
  (pddl-plan (goal-id ?goal-id) (status PLANNED))
  ?goal <- (goal (id ?goal-id) (mode SELECTED))
  (robmem-trigger (name "new-plan") (ptr ?obj&:(pddl-event-has-plan ?obj)))
  ?plan <- (pddl-plan (goal-id ?goal-id) (status PLANNED)
                      (plan-id ?id&:(eq ?id (bson-get ?obj "fullDocument.msg_id"))))
  =>
  (pddl-take-plan ?obj "fullDocument." ?plan ?goal)
)

(defrule pddl-fetch-plan
  "The event arrived in another loop: find the document of the plan. The latest
   document counts, because message ids are used again after a restart."
  ?plan <- (pddl-plan (goal-id ?goal-id) (status PLANNED) (plan-id ?id))
  ?goal <- (goal (id ?goal-id) (mode SELECTED))
  =>
  (bind ?query (bson-create))
  (bson-append ?query "plan" 1)
  (bson-append ?query "msg_id" ?id)
  (bind ?latest-first (bson-create))
  (bson-append ?latest-first "_id" -1)
  (bind ?cursor (robmem-query-sort "robmem.pddl-plan" ?query ?latest-first))
  (if ?cursor then
    (bind ?doc (robmem-cursor-next ?cursor))
    (if ?doc then
      (pddl-take-plan ?doc "" ?plan ?goal)
      (bson-destroy ?doc))
    (robmem-cursor-destroy ?cursor))
  (bson-destroy ?latest-first)
  (bson-destroy ?query)
)

(defrule pddl-clean-up-stale-plans
  "The goal was retracted, or left the mode SELECTED, before the plan arrived."
  ?plan <- (pddl-plan (goal-id ?goal-id))
  (not (goal (mode SELECTED) (id ?goal-id)))
  =>
  (retract ?plan)
)
