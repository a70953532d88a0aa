;;; The domain model, and what we share with the other robot.

(deftemplate room "A room, and the mutex of it as a resource."
  (slot name (type SYMBOL))
  (slot number (type INTEGER))  ; the smaller the sooner
  (slot mutex (type SYMBOL)))

(defglobal
  ?*ROOMS* = (create$ kitchen bath hall study))

(defrule house-domain-load
  (executive-init)
  (not (domain-loaded))
  =>
  (parse-pddl-domain (path-resolve "domain.pddl"))
  (assert (domain-loaded)))

(defrule house-domain-facts
  "No room is clean as far as we know. What we learn of rooms the other one shall know."
  (domain-loaded)
  (wm-fact (id "/cx/identity") (value ?me))
  (not (domain-facts-loaded))
  =>
  (progn$ (?room ?*ROOMS*)
    (assert (room (name ?room) (number ?room-index) (mutex (resource-to-mutex ?room)))))
  (wm-robmem-sync-enable "/domain/fact/swept" "/domain/fact/mopped")
  (blackboard-open-reading "SkillerInterface" ?me)
  (assert (skiller-control (skiller ?me))
          (domain-facts-loaded)))

(deffunction house-is (?what ?room)
  "Whether a room is swept, or mopped, as far as we know."
  (any-factp ((?fact domain-fact))
    (and (eq ?fact:name ?what) (eq ?fact:param-values (create$ ?room)))))

(deffunction house-is-noted (?id)
  "Whether the robot memory has the wm-fact."
  (bind ?query (bson-create))
  (bson-append ?query "_id" ?id)
  (bind ?cursor (robmem-query ?*WM-ROBMEM-SYNC-COLLECTION* ?query))
  (bson-destroy ?query)
  (if (not ?cursor) then (return FALSE))
  (bind ?document (robmem-cursor-next ?cursor))
  (if ?document then (bson-destroy ?document))
  (robmem-cursor-destroy ?cursor)
  (neq ?document FALSE))

(deffunction house-is-shared (?room)
  "Whether the robot memory knows what we know of a room. What it lacks (it may have been away) is sent again."
  (bind ?shared TRUE)
  (do-for-all-facts ((?fact wm-fact))
    (and (wm-key-prefix ?fact:key (create$ domain fact)) (eq (wm-key-arg ?fact:key room) ?room))
    (if (not (house-is-noted ?fact:id)) then
      (wm-robmem-sync-fact-update ?fact (cx-identity) (wm-robmem-sync-now))
      (bind ?shared FALSE)))
  ?shared)
