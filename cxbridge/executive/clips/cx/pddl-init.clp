; Prepares planning with PDDL: opens the interfaces of the problem generator and of
; the planner, waits until both have writers, and loads pddl.clp. For STAGE-3, with
; wait-for pddl-planner-initialized.
;
; Needs the features blackboard and robot_memory. The rules have Fawkes' names.

(defglobal
  ; the collection from which problems are generated
  ?*PDDL-ROBMEM-COLLECTION* = "robmem.clipswm"
  ; the seconds between two checks for writers, as in Fawkes
  ?*PDDL-INIT-CONTROL-RETRY-INTERVAL-SEC* = 1
)

(deftemplate pddl-init-control
  "An interface whose writer is awaited."
  (slot interface-id (type STRING))
  (multislot last-try    ; time of the last check for a writer
    (type INTEGER) (cardinality 2 2)
    (default (create$ 0 0)))
  (slot has-writer
    (type SYMBOL) (allowed-values TRUE FALSE)
    (default FALSE))
)

(deffunction pddl-robmem-flush ()
  "Remove all documents of the collection from which problems are generated."
  (bind ?everything (bson-create))  ; an empty query matches all documents
  (robmem-remove ?*PDDL-ROBMEM-COLLECTION* ?everything)
  (bson-destroy ?everything)
)

(defrule pddl-init-open-interfaces
  (ff-feature-loaded blackboard)
  (executive-init)
  =>
  (assert (pddl-init-control (interface-id "pddl-gen"))
          (pddl-init-control (interface-id "pddl-planner")))
  (blackboard-open-reading "PddlGenInterface" "pddl-gen")
  (blackboard-open-reading "PddlPlannerInterface" "pddl-planner")
)

(defrule pddl-init-update-blackboard-info
  "Assert blackboard-interface-info facts again after a time, while a writer is awaited."
  ?control <- (pddl-init-control (has-writer FALSE) (last-try $?last))
  (time $?now&:(timeout ?now ?last ?*PDDL-INIT-CONTROL-RETRY-INTERVAL-SEC*))
  =>
  (blackboard-get-info)
  (modify ?control (last-try ?now))
)

(defrule pddl-init-check-if-writer-available
  ?info <- (blackboard-interface-info (id ?id) (has-writer TRUE))
  ?control <- (pddl-init-control (interface-id ?id) (has-writer FALSE))
  =>
  (modify ?control (has-writer TRUE))
  (retract ?info)
)

(defrule pddl-init-register-trigger
  (ff-feature-loaded robot_memory)
  (executive-init)
  (not (registered-trigger "robmem.pddl-plan" ?))
  =>
  (printout t "Registering robot memory trigger for new plans" crlf)
  (bind ?everything (bson-create))
  (assert (registered-trigger "robmem.pddl-plan"
            (robmem-trigger-register "robmem.pddl-plan" ?everything "new-plan")))
  (bson-destroy ?everything)
)

(defrule pddl-init-pddl-interface
  "Both interfaces have writers: load the rules of planning, and report that planning is ready."
  (registered-trigger "robmem.pddl-plan" ?)
  ?planner <- (pddl-init-control (interface-id "pddl-planner") (has-writer TRUE))
  ?generator <- (pddl-init-control (interface-id "pddl-gen") (has-writer TRUE))
  =>
  (retract ?generator ?planner)
  (path-load "pddl.clp")
  (assert (executive-init-signal (id pddl-planner-initialized))
          (ff-feature-loaded pddl_planner))
)
