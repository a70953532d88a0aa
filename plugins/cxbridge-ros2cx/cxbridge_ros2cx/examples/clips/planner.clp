; Requests a plan of pddl_manager for a problem file, with the robot in the cellar as goal, and prints
; the plan.

; sends a request; ?fields are the name and the value of a field in turn
(deffunction send-request (?service ?type $?fields)
  (bind ?name (str-cat "/pddl_manager/" ?service))
  (bind ?request (ros-msgs-create-request (str-cat "cx_pddl_interfaces/srv/" ?type)))
  (while (> (length$ ?fields) 0)
    (ros-msgs-set-field ?request (nth$ 1 ?fields) (nth$ 2 ?fields))
    (bind ?fields (rest$ (rest$ ?fields))))
  (ros-msgs-async-send-request ?request ?name)
  (ros-msgs-destroy-message ?request))

; at the end of a run, (executive-finalize) keeps this rule from firing again after the rule `destroy-clients`
(defrule create-clients
  (not (ros-msgs-client))
  (not (executive-finalize))
  =>
  (ros-msgs-create-client "/pddl_manager/add_pddl_instance" "cx_pddl_interfaces/srv/AddPddlInstance")
  (ros-msgs-create-client "/pddl_manager/set_goals" "cx_pddl_interfaces/srv/SetGoals")
  (cx-pddl-interfaces-plan-temporal-create-client "/pddl_manager/temp_plan"))

; (time ?) is a fact of a tick: the rule fires at the first tick
(defrule add-problem
  (time ?)
  (ros-msgs-client (service "/pddl_manager/add_pddl_instance"))
  (not (added))
  =>
  (assert (added))
  (send-request "add_pddl_instance" "AddPddlInstance"
    name home domain_file "domain.pddl" problem_file "problem.pddl"
    directory (str-cat (ament-index-get-package-share-directory "cxbridge_examples") "/pddl")))

; `base` is the goal that each problem of pddl_manager has from the start, without fluents
(defrule set-goal
  ?fact <- (ros-msgs-response (service "/pddl_manager/add_pddl_instance") (msg-ptr ?response))
  =>
  (retract ?fact)
  (printout info "read: "
    (ros-msgs-get-field ?response "success") (ros-msgs-get-field ?response "error") crlf)
  (ros-msgs-destroy-message ?response)
  (bind ?fluent (ros-msgs-create-message "cx_pddl_interfaces/msg/Fluent"))
  (ros-msgs-set-field ?fluent "pddl_instance" "home")
  (ros-msgs-set-field ?fluent "name" "at")
  (ros-msgs-set-field ?fluent "args" (create$ "cellar"))
  (bind ?request (ros-msgs-create-request "cx_pddl_interfaces/srv/SetGoals"))
  (ros-msgs-set-field ?request "goal_instance" "base")
  (ros-msgs-set-field ?request "fluents" (create$ ?fluent))
  (ros-msgs-async-send-request ?request "/pddl_manager/set_goals")
  (ros-msgs-destroy-message ?fluent)
  (ros-msgs-destroy-message ?request))

(defrule request-plan
  ?fact <- (ros-msgs-response (service "/pddl_manager/set_goals") (msg-ptr ?response))
  =>
  (retract ?fact)
  (ros-msgs-destroy-message ?response)
  (bind ?goal (cx-pddl-interfaces-plan-temporal-goal-create))
  (cx-pddl-interfaces-plan-temporal-goal-set-field ?goal "pddl_instance" "home")
  (cx-pddl-interfaces-plan-temporal-goal-set-field ?goal "goal_instance" "base")
  (cx-pddl-interfaces-plan-temporal-send-goal ?goal "/pddl_manager/temp_plan"))

(defrule print-plan
  ?fact <- (cx-pddl-interfaces-plan-temporal-wrapped-result (result-ptr ?result))
  =>
  (retract ?fact)
  (foreach ?step (cx-pddl-interfaces-plan-temporal-result-get-field ?result "actions")
    (printout info (cx-pddl-interfaces-timed-plan-action-get-field ?step "name") " "
      (implode$ (cx-pddl-interfaces-timed-plan-action-get-field ?step "args")) crlf))
  (cx-pddl-interfaces-plan-temporal-result-destroy ?result)
  (cx-shutdown))

(defrule destroy-clients
  (executive-finalize)
  (ros-msgs-client (service ?service))
  =>
  (ros-msgs-destroy-client ?service))
