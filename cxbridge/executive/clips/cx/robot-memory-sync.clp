; Copies the domain to the robot memory, for the PDDL problem generator: adds objects,
; and adds and removes facts. The rules have Fawkes' names, and Fawkes' salience, which is
; above 0, so that the copy is complete before rules at salience 0 fire.
;
; Needs domain.clp and the feature robot_memory.

(deftemplate robot-memory-sync-mapped
  "A domain-fact that is in the robot memory."
  (multislot param-values)
  (slot name (type SYMBOL))
)

(deffunction robot-memory-sync-clean-domain-facts ()
  "Remove the domain-facts of earlier runs from the robot memory."
  (printout warn "Clearing domain facts from robot memory" crlf)
  (bind ?query (bson-create))
  (bson-append ?query "relation" domain-fact)
  (robmem-remove "robmem.clipswm" ?query)
  (bson-destroy ?query)
)

(deffunction robot-memory-sync-write (?fact)
  "Internal. Write the document of a fact, unless an equal document exists."
  (bind ?doc (rm-structured-fact-to-bson ?fact))
  (robmem-upsert "robmem.clipswm" ?doc ?doc)
  (bson-destroy ?doc)
)

(defrule robot-memory-sync-add-object
  (declare (salience 100))
  ?object <- (domain-object)
  =>
  (robot-memory-sync-write ?object)
)

(defrule robot-memory-sync-add-fact
  (declare (salience 100))
  ?fact <- (domain-fact (name ?name) (param-values $?values))
  (not (robot-memory-sync-mapped (name ?name) (param-values $?values)))
  =>
  (robot-memory-sync-write ?fact)
  (assert (robot-memory-sync-mapped (name ?name) (param-values ?values)))
)

(defrule robot-memory-sync-retract-fact
  "The document has the relation domain-fact, and the slots of the former fact."
  (declare (salience 100))
  ?mapped <- (robot-memory-sync-mapped (name ?name) (param-values $?values))
  (not (domain-fact (name ?name) (param-values $?values)))
  =>
  (bind ?doc (rm-structured-fact-to-bson ?mapped domain-fact))
  (robmem-remove "robmem.clipswm" ?doc)
  (bson-destroy ?doc)
  (retract ?mapped)
)
